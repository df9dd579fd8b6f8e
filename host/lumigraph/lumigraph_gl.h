// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "host/gl/egl_context.h"
#include "host/lumigraph/lumigraph.h"

namespace mf {

// A lumigraph's frames on OpenGL 4.3: the same picture as Lumigraph::render's, up to rounding and to what a graphics
// card's bilinear filter leaves of a fraction (8 bits), and up to pixels at a mesh' outlines.
//
// Two passes: where each pixel's ray meets the proxy (GlProxySurface), then a compute shader with a group for 8 × 8
// pixels. Of photos in the order of how well they speak for the middle of the picture, 64 at a time, the group finds
// those that could yet be among the k + 1 best of one of its pixels, by what no ray of theirs undercuts
// (view_bounds.h); each pixel ranks these, and blends its k best.
//
// Photos may be as many as memory holds: cameras and poses lie in storage buffers, the levels of all pyramids side by
// side in the layers of up to eight array textures (Atlas), what photos see of the proxy in two more.
class GlLumigraph {
 public:
  // Copies the photos to the card. The context is current and, as the lumigraph, outlives this; the proxy stays the one
  // that the lumigraph has now. Throws InputError when the card has no room for them.
  GlLumigraph(const EglContext&, const Lumigraph&);
  GlLumigraph(GlLumigraph&&) noexcept;
  ~GlLumigraph();

  // See Lumigraph::render. On the context's thread.
  [[nodiscard]] LumigraphPicture render(const View&, const LumigraphOptions&,
                                        std::span<const std::uint32_t> views = {}) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mf
