// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <span>
#include <vector>

#include "host/gl/gl_objects.h"
#include "host/lumigraph/atlas.h"

namespace mf {

// Rectangles of texels on OpenGL, as an atlas places them: a page is an array texture.
class GlAtlas {
 public:
  struct Format {
    GLenum stored;             // sized
    GLenum given, given_type;  // of what upload() gets
    int texel_bytes;
  };
  // A current context is a precondition of everything here. No rectangles: no pages. Throws InputError when the card
  // has no room for them, `what` they are, on at most `pages` pages.
  GlAtlas(std::span<const std::array<int, 2>> sizes, const Format&, int pages, const char* what);

  void upload(std::size_t rectangle, const void* texels);
  void bind(GLuint first_unit) const;

  [[nodiscard]] const AtlasPlace& place(std::size_t rectangle) const { return atlas_.places[rectangle]; }
  [[nodiscard]] int pages() const { return static_cast<int>(pages_.size()); }

 private:
  std::vector<std::array<int, 2>> sizes_;
  Format format_;
  Atlas atlas_;
  std::vector<GlTexture> pages_;
};

}  // namespace mf
