// SPDX-License-Identifier: Apache-2.0
#include "host/gl/gl_objects.h"

#include <fmt/format.h>

#include <string>

#include "common/check.h"
#include "host/gl/shader_source.h"

namespace mf {

namespace gl_delete {
void texture(GLuint name) {
  glDeleteTextures(1, &name);
}
void buffer(GLuint name) {
  glDeleteBuffers(1, &name);
}
void framebuffer(GLuint name) {
  glDeleteFramebuffers(1, &name);
}
void vertex_array(GLuint name) {
  glDeleteVertexArrays(1, &name);
}
void program(GLuint name) {
  glDeleteProgram(name);
}
}  // namespace gl_delete

GlTexture make_texture() {
  GLuint name = 0;
  glGenTextures(1, &name);
  return GlTexture(name);
}

GlBuffer make_buffer() {
  GLuint name = 0;
  glGenBuffers(1, &name);
  return GlBuffer(name);
}

GlFramebuffer make_framebuffer() {
  GLuint name = 0;
  glGenFramebuffers(1, &name);
  return GlFramebuffer(name);
}

GlVertexArray make_vertex_array() {
  GLuint name = 0;
  glGenVertexArrays(1, &name);
  return GlVertexArray(name);
}

namespace {

void attach(const GlProgram& program, GLenum kind, std::string_view name,
            std::span<const ShaderConstant> constants = {}) {
  std::string source = shader_source(name);
  const std::size_t after_version = source.find('\n') + 1;
  for (const ShaderConstant& constant : constants)
    source.insert(after_version, fmt::format("const int {} = {};\n", constant.name, constant.value));
  const char* text = source.c_str();
  const GLuint shader = glCreateShader(kind);
  glShaderSource(shader, 1, &text, nullptr);
  glCompileShader(shader);
  GLint compiled = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
  std::string log(4096, '\0');
  GLsizei length = 0;
  glGetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), &length, log.data());
  log.resize(static_cast<std::size_t>(length));
  glAttachShader(program.name(), shader);
  glDeleteShader(shader);  // lives on with the program
  check(compiled == GL_TRUE, fmt::format("{} compiles: {}", name, log));
}

void link(const GlProgram& program, std::string_view what) {
  glLinkProgram(program.name());
  GLint linked = 0;
  glGetProgramiv(program.name(), GL_LINK_STATUS, &linked);
  std::string log(4096, '\0');
  GLsizei length = 0;
  glGetProgramInfoLog(program.name(), static_cast<GLsizei>(log.size()), &length, log.data());
  log.resize(static_cast<std::size_t>(length));
  check(linked == GL_TRUE, fmt::format("{} link: {}", what, log));
}

}  // namespace

GlProgram make_program(std::string_view vertex, std::string_view fragment) {
  GlProgram program(glCreateProgram());
  attach(program, GL_VERTEX_SHADER, vertex);
  attach(program, GL_FRAGMENT_SHADER, fragment);
  link(program, fmt::format("{} and {}", vertex, fragment));
  return program;
}

GlProgram make_compute_program(std::string_view compute, std::span<const ShaderConstant> constants) {
  GlProgram program(glCreateProgram());
  attach(program, GL_COMPUTE_SHADER, compute, constants);
  link(program, compute);
  return program;
}

void dispatch_over(int width, int height, int group_side) {
  const auto groups = [&](int pixels) { return static_cast<GLuint>((pixels + group_side - 1) / group_side); };
  glDispatchCompute(groups(width), groups(height), 1);
}

GLint gl_limit(GLenum name) {
  GLint value = 0;
  glGetIntegerv(name, &value);
  return value;
}

void check_gl(std::string_view what) {
  const GLenum error = glGetError();
  check(error == GL_NO_ERROR, fmt::format("{}: OpenGL error 0x{:x}", what, error));
}

}  // namespace mf
