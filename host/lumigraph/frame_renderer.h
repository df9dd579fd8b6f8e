// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "host/gl/backend.h"
#include "host/lumigraph/lumigraph.h"

namespace mf {

// New views of a lumigraph by whichever back end was chosen; both make the same picture. The lumigraph outlives this
// and keeps its proxy.
class FrameRenderer {
 public:
  // On the CPU, by the lumigraph itself: it is taken wherever a renderer of its frames is.
  FrameRenderer(const Lumigraph&);
  // Throws InputError when gl is asked for and OpenGL 4.3 is not to be had, or has no room for the photos.
  FrameRenderer(const Lumigraph&, Backend);
  FrameRenderer(FrameRenderer&&) noexcept;
  ~FrameRenderer();

  // See Lumigraph::render. gl: on the thread that made this.
  [[nodiscard]] LumigraphPicture render(const View&, const LumigraphOptions&,
                                        std::span<const std::uint32_t> views = {}) const;

  [[nodiscard]] const Lumigraph& lumigraph() const { return *lumigraph_; }
  // "cpu", or "gl" with the renderer's name.
  [[nodiscard]] const std::string& description() const { return description_; }

 private:
  struct Gl;
  const Lumigraph* lumigraph_;
  std::unique_ptr<Gl> gl_;  // empty: cpu
  std::string description_;
};

}  // namespace mf
