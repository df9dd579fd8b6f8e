// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "host/gl/egl_context.h"
#include "host/lumigraph/lumigraph.h"

namespace mf {

// New views of a lumigraph by whichever back end was chosen; both make the same picture. The lumigraph outlives this
// and keeps its proxy.
class FrameRenderer {
 public:
  // See open_backend; without a context on the CPU, by the lumigraph itself, which is so taken wherever a renderer of
  // its frames is. Throws InputError when the card has no room for the photos.
  FrameRenderer(const Lumigraph&, std::optional<EglContext> = {});
  FrameRenderer(FrameRenderer&&) noexcept;
  ~FrameRenderer();

  // See Lumigraph::render. gl: on the thread that opened the context.
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
