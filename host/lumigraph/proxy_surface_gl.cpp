// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/proxy_surface_gl.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "common/check.h"
#include "common/error.h"
#include "host/lumigraph/ray_answers.h"

namespace mf {

namespace {

constexpr float no_ray = 1e30F;       // shaders/common_view.glsl
constexpr float no_wall = 1e30F;      // shaders/proxy_box.comp
constexpr int group_side = 8;         // shaders/common_surface.glsl
constexpr GLuint triangles_unit = 1;  // before the surface takes it

// std140; mirrors ViewBlock of shaders/common_view.glsl.
struct GlslView {
  std::array<std::array<float, 4>, 3> axes;
  std::array<float, 4> eye;
  std::array<int, 4> size;
};
static_assert(offsetof(GlslView, eye) == 48 && offsetof(GlslView, size) == 64 && sizeof(GlslView) == 80);

const char* shader_for(const Proxy& proxy) {
  constexpr std::array<const char*, 4> names{"proxy_plane.comp", "proxy_sphere.comp", "proxy_box.comp",
                                             "proxy_mesh.comp"};
  static_assert(std::variant_size_v<Proxy> == names.size());
  return names[proxy.index()];
}

Eigen::Vector3f eye_of(const View& view) {
  return view.cam_from_world.inverse().translation.cast<float>();
}

void set_nearest(GLenum target) {
  glTexParameteri(target, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(target, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
}

GlTexture make_target(GLenum format, int width, int height) {
  GlTexture texture = make_texture();
  glBindTexture(GL_TEXTURE_2D, texture.name());
  glTexStorage2D(GL_TEXTURE_2D, 1, format, width, height);
  set_nearest(GL_TEXTURE_2D);
  return texture;
}

// x and y of every pixel's ray: the distortion's inverse is found in double precision, once for a camera.
std::vector<float> rays_of(const CameraModel& camera) {
  const auto width = static_cast<std::size_t>(camera.width);
  std::vector<float> rays(2 * width * static_cast<std::size_t>(camera.height), no_ray);
  tbb::parallel_for(0, camera.height, [&](int y) {
    for (int x = 0; x < camera.width; ++x) {
      const auto ray = camera.unproject({x + 0.5, y + 0.5});
      if (!ray) continue;
      const std::size_t at = 2 * (static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x));
      rays[at] = static_cast<float>(ray->x());
      rays[at + 1] = static_cast<float>(ray->y());
    }
  });
  return rays;
}

// A pinhole that sees what the camera sees, texel by pixel where it has no distortion.
CameraModel pinhole_for(const CameraModel& camera) {
  if (!camera.has_distortion()) return camera;
  constexpr double finer = 4;  // at half of it 0.15 % of a picture's pixels were off, at this 0.04 %
  const int most_texels = std::min(1 << 13, gl_limit(GL_MAX_TEXTURE_SIZE));  // a side: half a gigabyte in all
  const AnsweringCamera limits = answering_camera(camera);
  const auto texels = [&](double extent, double focal) {
    return std::clamp(static_cast<int>(std::ceil(extent * finer * focal)), 1, most_texels);
  };
  const double across = limits.right - limits.left;
  const double down = limits.bottom - limits.top;
  CameraModel pinhole;
  pinhole.width = texels(across, camera.fx());
  pinhole.height = texels(down, camera.fy());
  const double fx = pinhole.width / across;
  const double fy = pinhole.height / down;
  pinhole.parameters = {fx, fy, -fx * limits.left, -fy * limits.top, 0, 0, 0, 0, 0};
  return pinhole;
}

template <typename T>
GlBuffer make_storage(const std::vector<T>& values) {
  const std::size_t bytes = values.size() * sizeof(T);
  if (bytes > static_cast<std::size_t>(gl_limit(GL_MAX_SHADER_STORAGE_BLOCK_SIZE)))
    throw InputError("--proxy", "",
                     fmt::format("has too large a mesh for OpenGL here, {} of {} MB: use --backend cpu", bytes >> 20U,
                                 gl_limit(GL_MAX_SHADER_STORAGE_BLOCK_SIZE) >> 20));
  GlBuffer buffer = make_buffer();
  glBindBuffer(GL_SHADER_STORAGE_BUFFER, buffer.name());
  glBufferData(GL_SHADER_STORAGE_BUFFER, static_cast<GLsizeiptr>(bytes), values.data(), GL_STATIC_DRAW);
  return buffer;
}

}  // namespace

GlProxySurface::GlProxySurface(const Proxy& proxy)
    : proxy_(&proxy), view_block_(make_buffer()), meet_(make_compute_program(shader_for(proxy))) {
  if (const auto* mesh = std::get_if<MeshProxy>(&proxy)) {
    draw_ = make_program("proxy_mesh.vert", mesh->inside ? "proxy_walls.frag" : "proxy_mesh.frag");
    upload_mesh(mesh->mesh);
  }
  check_gl("setting up the proxy");
}

void GlProxySurface::upload_mesh(const TriangleMesh& mesh) {
  constexpr float nearest_of_radius = 1e-4F;
  positions_ = make_storage(mesh.positions);
  normals_ = make_storage(mesh.normals);
  triangles_ = make_storage(mesh.triangles);
  layout_ = make_vertex_array();
  glBindVertexArray(layout_.name());
  glBindBuffer(GL_ARRAY_BUFFER, positions_.name());
  glEnableVertexAttribArray(0);
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(Eigen::Vector3f), nullptr);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, triangles_.name());
  nearest_ = std::max(nearest_of_radius * bounds_of(mesh).radius, std::numeric_limits<float>::min());
}

void GlProxySurface::set_camera(const CameraModel& camera) {
  if (camera.width == camera_.width && camera.height == camera_.height && camera.parameters == camera_.parameters)
    return;
  camera_ = camera;
  rays_ = make_target(GL_RG32F, camera.width, camera.height);
  glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, camera.width, camera.height, GL_RG, GL_FLOAT, rays_of(camera).data());
  surface_ = make_target(GL_RGBA32F, camera.width, camera.height);
  if (std::holds_alternative<MeshProxy>(*proxy_)) make_raster(camera);
}

void GlProxySurface::make_raster(const CameraModel& camera) {
  raster_.camera = pinhole_for(camera);
  raster_.triangles = make_target(GL_R32UI, raster_.camera.width, raster_.camera.height);
  raster_.depth = make_target(GL_DEPTH_COMPONENT32F, raster_.camera.width, raster_.camera.height);
  raster_.target = make_framebuffer();
  glBindFramebuffer(GL_FRAMEBUFFER, raster_.target.name());
  glFramebufferTexture(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, raster_.triangles.name(), 0);
  glFramebufferTexture(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, raster_.depth.name(), 0);
  check(glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE, "a complete framebuffer of triangles");
}

void GlProxySurface::use_surface(const PlaneProxy& plane, const View& view) {
  glUseProgram(meet_.name());
  const Eigen::Vector3f& n = plane.normal;
  glUniform4f(0, n.x(), n.y(), n.z(), plane.offset - n.dot(eye_of(view)));
}

void GlProxySurface::use_surface(const SphereProxy& sphere, const View& view) {
  glUseProgram(meet_.name());
  const Eigen::Vector3f from_centre = eye_of(view) - sphere.centre;
  glUniform4f(0, from_centre.x(), from_centre.y(), from_centre.z(), sphere.radius);
}

void GlProxySurface::use_surface(const BoxProxy& box, const View& view) {
  glUseProgram(meet_.name());
  const Eigen::Matrix3f rotation = box.box_from_world.rotation.toRotationMatrix().cast<float>();
  const Eigen::Vector3f eye = (box.box_from_world * view.cam_from_world.inverse().translation).cast<float>();
  const auto wall = [](float from_eye) { return std::clamp(from_eye, -no_wall, no_wall); };
  const Eigen::Vector3f low = (box.low - eye).unaryExpr(wall);
  const Eigen::Vector3f high = (box.high - eye).unaryExpr(wall);
  glUniformMatrix3fv(0, 1, GL_FALSE, rotation.data());
  glUniform3fv(3, 1, low.data());
  glUniform3fv(4, 1, high.data());
}

void GlProxySurface::use_surface(const MeshProxy& proxy, const View&) {
  const CameraModel& c = raster_.camera;
  const auto fx = static_cast<float>(c.fx()), fy = static_cast<float>(c.fy());
  const auto cx = static_cast<float>(c.cx()), cy = static_cast<float>(c.cy());
  const auto width = static_cast<float>(c.width), height = static_cast<float>(c.height);
  const std::array<const GlBuffer*, 3> storage{&positions_, &normals_, &triangles_};
  for (GLuint i = 0; i < storage.size(); ++i) glBindBufferBase(GL_SHADER_STORAGE_BUFFER, i, storage[i]->name());
  glBindFramebuffer(GL_FRAMEBUFFER, raster_.target.name());
  glViewport(0, 0, c.width, c.height);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_GREATER);
  constexpr GLuint no_triangle = 0;
  constexpr float farthest = 0;
  glClearBufferuiv(GL_COLOR, 0, &no_triangle);
  glClearBufferfv(GL_DEPTH, 0, &farthest);
  glUseProgram(draw_.name());
  glUniform4f(0, fx / width, fy / height, cx / width, cy / height);
  glUniform1f(1, nearest_);
  if (proxy.inside) glUniform3fv(2, 1, proxy.inside->data());
  glBindVertexArray(layout_.name());
  glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(3 * proxy.mesh.triangles.size()), GL_UNSIGNED_INT, nullptr);
  glActiveTexture(GL_TEXTURE0 + triangles_unit);
  glBindTexture(GL_TEXTURE_2D, raster_.triangles.name());
  glUseProgram(meet_.name());
  glUniform4f(0, fx, fy, cx, cy);
}

void GlProxySurface::find(const View& view) {
  glActiveTexture(GL_TEXTURE0 + rays_unit);
  set_camera(view.camera);
  glBindTexture(GL_TEXTURE_2D, rays_.name());
  const Eigen::Matrix3f axes = view.cam_from_world.rotation.conjugate().toRotationMatrix().cast<float>();
  const Eigen::Vector3f eye = eye_of(view);
  GlslView block{};
  for (int i = 0; i < 3; ++i) block.axes[static_cast<std::size_t>(i)] = {axes(0, i), axes(1, i), axes(2, i), 0};
  block.eye = {eye.x(), eye.y(), eye.z(), 0};
  block.size = {view.camera.width, view.camera.height, 0, 0};
  glBindBuffer(GL_UNIFORM_BUFFER, view_block_.name());
  glBufferData(GL_UNIFORM_BUFFER, sizeof(block), &block, GL_STREAM_DRAW);
  glBindBufferBase(GL_UNIFORM_BUFFER, 0, view_block_.name());

  std::visit([&](const auto& surface) { use_surface(surface, view); }, *proxy_);
  glBindImageTexture(0, surface_.name(), 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_RGBA32F);
  dispatch_over(view.camera.width, view.camera.height, group_side);
  glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
  glActiveTexture(GL_TEXTURE0 + surface_unit);
  glBindTexture(GL_TEXTURE_2D, surface_.name());
}

}  // namespace mf
