// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/atlas_gl.h"

#include <fmt/format.h>

#include "common/check.h"
#include "common/error.h"

namespace mf {

namespace {

constexpr int page_bytes = 1 << 30;  // a page: what even the software rasterizer allows a texture

AtlasLimits limits_of(const GlAtlas::Format& format, int pages) {
  AtlasLimits limits;
  limits.largest_side = gl_limit(GL_MAX_TEXTURE_SIZE);
  limits.largest_layers = gl_limit(GL_MAX_ARRAY_TEXTURE_LAYERS);
  limits.pages = pages;
  limits.page_texels = page_bytes / format.texel_bytes;
  return limits;
}

[[noreturn]] void throw_no_room(const char* what) {
  throw InputError(
      "OpenGL", "--backend gl",
      fmt::format("has no room here for {}: make the photos smaller with --scale, or use --backend cpu", what));
}

}  // namespace

GlAtlas::GlAtlas(std::span<const std::array<int, 2>> sizes, const Format& format, int pages, const char* what)
    : sizes_(sizes.begin(), sizes.end()), format_(format) {
  if (sizes.empty()) return;
  auto packed = pack_atlas(sizes, limits_of(format, pages));
  if (!packed) throw_no_room(what);
  atlas_ = std::move(*packed);
  check_gl("before textures are made");
  for (const int layers : atlas_.layers) {
    pages_.push_back(make_texture());
    glBindTexture(GL_TEXTURE_2D_ARRAY, pages_.back().name());
    glTexStorage3D(GL_TEXTURE_2D_ARRAY, 1, format.stored, atlas_.side, atlas_.side, layers);
    if (glGetError() != GL_NO_ERROR) throw_no_room(what);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  }
}

void GlAtlas::upload(std::size_t rectangle, const void* texels) {
  const AtlasPlace& at = atlas_.places[rectangle];
  glBindTexture(GL_TEXTURE_2D_ARRAY, pages_[static_cast<std::size_t>(at.page)].name());
  glTexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, at.x, at.y, at.layer, sizes_[rectangle][0], sizes_[rectangle][1], 1,
                  format_.given, format_.given_type, texels);
}

void GlAtlas::bind(GLuint first_unit) const {
  for (std::size_t i = 0; i < pages_.size(); ++i) {
    glActiveTexture(GL_TEXTURE0 + first_unit + static_cast<GLuint>(i));
    glBindTexture(GL_TEXTURE_2D_ARRAY, pages_[i].name());
  }
}

}  // namespace mf
