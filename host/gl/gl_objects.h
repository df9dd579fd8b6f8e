// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <epoxy/gl.h>

#include <span>
#include <string_view>
#include <utility>

namespace mf {

// One OpenGL name, deleted with its owner; move-only. A current context is a precondition of everything here.
template <void (*Delete)(GLuint)>
class GlObject {
 public:
  GlObject() = default;
  explicit GlObject(GLuint name) : name_(name) {}
  GlObject(const GlObject&) = delete;
  GlObject& operator=(const GlObject&) = delete;
  GlObject(GlObject&& other) noexcept : name_(std::exchange(other.name_, 0U)) {}
  GlObject& operator=(GlObject&& other) noexcept {
    std::swap(name_, other.name_);
    return *this;
  }
  ~GlObject() {
    if (name_ != 0) Delete(name_);
  }
  [[nodiscard]] GLuint name() const { return name_; }

 private:
  GLuint name_ = 0;
};

namespace gl_delete {
void texture(GLuint);
void buffer(GLuint);
void framebuffer(GLuint);
void vertex_array(GLuint);
void program(GLuint);
}  // namespace gl_delete

using GlTexture = GlObject<gl_delete::texture>;
using GlBuffer = GlObject<gl_delete::buffer>;
using GlFramebuffer = GlObject<gl_delete::framebuffer>;
using GlVertexArray = GlObject<gl_delete::vertex_array>;
using GlProgram = GlObject<gl_delete::program>;

[[nodiscard]] GlTexture make_texture();
[[nodiscard]] GlBuffer make_buffer();
[[nodiscard]] GlFramebuffer make_framebuffer();
[[nodiscard]] GlVertexArray make_vertex_array();

// From the sources named `vertex` and `fragment` in shaders/ (see shader_source). A fault in them is a bug of ours: the
// driver's message is in the std::logic_error.
[[nodiscard]] GlProgram make_program(std::string_view vertex, std::string_view fragment);

// A length of an array or the like that a shader's text needs: `const int NAME = VALUE;` before its first line of code.
struct ShaderConstant {
  std::string_view name;
  int value = 0;
};
[[nodiscard]] GlProgram make_compute_program(std::string_view compute, std::span<const ShaderConstant> constants = {});

// Runs the compute program in use over a picture's pixels, in groups of group_side².
void dispatch_over(int width, int height, int group_side);
[[nodiscard]] GLint gl_limit(GLenum name);

// Throws std::logic_error naming `what` when OpenGL has reported an error since the last call.
void check_gl(std::string_view what);

}  // namespace mf
