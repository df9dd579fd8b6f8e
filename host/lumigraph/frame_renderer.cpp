// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/frame_renderer.h"

#include <utility>

#include "host/gl/backend.h"
#include "host/lumigraph/lumigraph_gl.h"

namespace mf {

struct FrameRenderer::Gl {
  EglContext context;
  GlLumigraph frames;

  Gl(EglContext&& opened, const Lumigraph& lumigraph) : context(std::move(opened)), frames(context, lumigraph) {}
};

FrameRenderer::FrameRenderer(const Lumigraph& lumigraph, std::optional<EglContext> context)
    : lumigraph_(&lumigraph), description_(describe(context)) {
  if (context) gl_ = std::make_unique<Gl>(std::move(*context), lumigraph);
}
FrameRenderer::FrameRenderer(FrameRenderer&&) noexcept = default;
FrameRenderer::~FrameRenderer() = default;

LumigraphPicture FrameRenderer::render(const View& view, const LumigraphOptions& options,
                                       std::span<const std::uint32_t> views) const {
  return gl_ ? gl_->frames.render(view, options, views) : lumigraph_->render(view, options, views);
}

}  // namespace mf
