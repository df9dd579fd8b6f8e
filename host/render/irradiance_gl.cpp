// SPDX-License-Identifier: Apache-2.0
#include "host/render/irradiance_gl.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <variant>

#include "common/check.h"
#include "host/gl/gl_objects.h"

namespace mf {

namespace {

constexpr std::size_t max_lights = 32;  // shaders/common_lights.glsl
constexpr int row_points = 1024;

// std140; mirrors Light and LightBlock of shaders/common_lights.glsl.
struct GlslLight {
  std::array<float, 4> place;
  std::array<float, 4> emitter;
  std::array<float, 4> strength;
  std::array<float, 4> shadow_u;
  std::array<float, 4> shadow_v;
  std::array<float, 4> shadow_depth;
  std::array<float, 4> shadow_w;
  std::array<float, 4> image;
  std::array<float, 4> plane;
};
struct GlslLightBlock {
  std::array<GlslLight, max_lights> lights;
  std::array<int, 4> count;
};
static_assert(offsetof(GlslLight, emitter) == 16 && offsetof(GlslLight, strength) == 32 &&
              offsetof(GlslLight, shadow_u) == 48 && offsetof(GlslLight, shadow_v) == 64 &&
              offsetof(GlslLight, shadow_depth) == 80 && offsetof(GlslLight, shadow_w) == 96 &&
              offsetof(GlslLight, image) == 112 && offsetof(GlslLight, plane) == 128 && sizeof(GlslLight) == 144);
static_assert(offsetof(GlslLightBlock, count) == 144 * max_lights);

// The coordinate (dot(axis, x) − low) / (high − low) over the corners of a box.
struct Extent {
  Eigen::Vector3f axis;
  float low = 0;
  float size = 0;

  Extent(const Eigen::Vector3f& a, const Bounds& box) : axis(a) {
    const Eigen::Vector3f half = (box.high - box.low) / 2;
    const float reach = std::max(axis.cwiseAbs().dot(half) * 1.02F, 1e-6F);  // a rim for the filter, and never nothing
    low = axis.dot((box.high + box.low) / 2) - reach;
    size = 2 * reach;
  }
  [[nodiscard]] std::array<float, 4> coordinate() const {
    return {axis.x() / size, axis.y() / size, axis.z() / size, -low / size};
  }
};

// What a layer of shadow maps shows: one light, and the image that goes with it.
using AnyLight = std::variant<DirectionalLight, EmitterPoint>;

std::uint32_t image_of(const AnyLight& light) {
  return std::visit([](const auto& l) { return l.image; }, light);
}

GlslLight shadow_of(const DirectionalLight& light, const Bounds& box, int shadow_map_size) {
  const Eigen::Vector3f& w = light.direction;
  const Eigen::Vector3f axis_u = w.unitOrthogonal();
  const Extent u(axis_u, box), v(w.cross(axis_u), box);
  const Extent depth(-w, box);  // grows away from the light
  GlslLight out{};
  out.place = {w.x(), w.y(), w.z(), 0};
  out.strength = {light.solid_angle_sr, 0, 0, 0};
  out.shadow_u = u.coordinate();
  out.shadow_v = v.coordinate();
  out.shadow_depth = depth.coordinate();
  out.shadow_w = {0, 0, 0, 1};
  out.image[1] = std::max(u.size, v.size) / static_cast<float>(shadow_map_size);
  return out;
}

// A pyramid from the point round the box: with d the distance ahead of the point, towards the box's middle,
//
//   u = 1/2 + a·(x − y) / (2 t d),   depth = far (d − near) / ((far − near) d)
GlslLight shadow_of(const EmitterPoint& light, const Bounds& box, int shadow_map_size) {
  const Eigen::Vector3f& y = light.position;
  const Eigen::Vector3f ahead = ((box.high + box.low) / 2 - y).normalized();
  const Eigen::Vector3f across = ahead.unitOrthogonal(), up = ahead.cross(across);
  constexpr float rim = 1.02F;      // for the filter
  constexpr float nearest = 0.01F;  // of the farthest: nearer than that, the object is not in the shadow map
  constexpr float widest = 20;      // tangent: a lamp beside the box sees no more of it
  float far = 1e-6F, near = std::numeric_limits<float>::infinity(), tangent = 1e-6F;
  for (const Eigen::Vector3f& x : corners_of(box)) {
    const float d = ahead.dot(x - y), side = std::max(std::abs(across.dot(x - y)), std::abs(up.dot(x - y)));
    far = std::max(far, rim * d);
    near = std::min(near, d / rim);
    tangent = std::max(tangent, d * widest > side ? rim * side / d : widest);
  }
  near = std::max(near, nearest * far);
  const auto row = [&](const Eigen::Vector3f& axis, float of_ahead, float offset) -> std::array<float, 4> {
    const Eigen::Vector3f n = axis + of_ahead * ahead;
    return {n.x(), n.y(), n.z(), offset - n.dot(y)};
  };
  GlslLight out{};
  out.place = {y.x(), y.y(), y.z(), 1};
  out.emitter = {light.centre.x(), light.centre.y(), light.centre.z(), light.radius_m};
  out.strength = {light.share, 0, 0, 0};
  out.shadow_u = row(across / (2 * tangent), 0.5F, 0);
  out.shadow_v = row(up / (2 * tangent), 0.5F, 0);
  const float stretch = far / (far - near);
  out.shadow_depth = row(Eigen::Vector3f::Zero(), stretch, -stretch * near);
  out.shadow_w = row(Eigen::Vector3f::Zero(), 1, 0);
  out.image[1] = 2 * tangent * far / static_cast<float>(shadow_map_size);
  return out;
}

GlslLight make_light(const AnyLight& light, const PlaneImage& image, const Bounds& box, int shadow_map_size) {
  GlslLight out = std::visit([&](const auto& l) { return shadow_of(l, box, shadow_map_size); }, light);
  const Eigen::Vector2f size = image.max_m - image.min_m;
  out.plane = {image.min_m.x(), image.max_m.y(), 1 / size.x(), 1 / size.y()};
  return out;
}

// Lights whose images have one size in texels, at most max_lights.
using Batch = std::vector<AnyLight>;

bool same_size(const PlaneImage& a, const PlaneImage& b) {
  return a.width == b.width && a.height == b.height;
}

std::vector<Batch> make_batches(const LightSet& set) {
  std::vector<Batch> batches;
  const auto add = [&](const AnyLight& light) {
    if (batches.empty() || batches.back().size() == max_lights ||
        !same_size(set.images[image_of(batches.back().front())], set.images[image_of(light)]))
      batches.emplace_back();
    batches.back().push_back(light);
  };
  for (const DirectionalLight& light : set.lights) add(light);
  for (const EmitterPoint& point : set.emitter_points) add(point);
  return batches;
}

void set_filter(GLenum target, GLint filter, GLint wrap) {
  glTexParameteri(target, GL_TEXTURE_MIN_FILTER, filter);
  glTexParameteri(target, GL_TEXTURE_MAG_FILTER, filter);
  glTexParameteri(target, GL_TEXTURE_WRAP_S, wrap);
  glTexParameteri(target, GL_TEXTURE_WRAP_T, wrap);
}

GlTexture upload_points(std::span<const SurfacePoint> points, int rows, Eigen::Vector3f SurfacePoint::*member) {
  std::vector<float> texels(3 * static_cast<std::size_t>(rows) * row_points, 0.F);
  for (std::size_t i = 0; i < points.size(); ++i)
    for (int c = 0; c < 3; ++c) texels[3 * i + static_cast<std::size_t>(c)] = (points[i].*member)[c];
  GlTexture texture = make_texture();
  glBindTexture(GL_TEXTURE_2D, texture.name());
  glTexStorage2D(GL_TEXTURE_2D, 1, GL_RGBA32F, row_points, rows);
  glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, row_points, rows, GL_RGB, GL_FLOAT, texels.data());
  set_filter(GL_TEXTURE_2D, GL_NEAREST, GL_CLAMP_TO_EDGE);
  return texture;
}

}  // namespace

struct GlIrradiance::Impl {
  Options options;
  Bounds bounds;
  GLsizei index_count = 0;
  GlBuffer vertices, indices, light_block;
  GlVertexArray mesh_layout, no_layout;
  GlTexture shadow_maps;
  GlFramebuffer shadow_target;
  GlProgram shadow_pass, visible_pass, blocked_pass;

  void upload_mesh(const TriangleMesh&);
  void make_shadow_maps();
  void upload_batch(const Batch&, const LightSet&, const GlTexture& tiles);
  void draw_shadow_maps(const Batch&);
  void accumulate(GLuint target, int rows, LightSum);
};

void GlIrradiance::Impl::upload_mesh(const TriangleMesh& mesh) {
  index_count = static_cast<GLsizei>(3 * mesh.triangles.size());
  glBindVertexArray(mesh_layout.name());
  glBindBuffer(GL_ARRAY_BUFFER, vertices.name());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(mesh.positions.size() * sizeof(Eigen::Vector3f)),
               mesh.positions.data(), GL_STATIC_DRAW);
  glEnableVertexAttribArray(0);
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(Eigen::Vector3f), nullptr);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices.name());
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(mesh.triangles.size() * sizeof(mesh.triangles[0])),
               mesh.triangles.data(), GL_STATIC_DRAW);
}

void GlIrradiance::Impl::make_shadow_maps() {
  glActiveTexture(GL_TEXTURE3);
  glBindTexture(GL_TEXTURE_2D_ARRAY, shadow_maps.name());
  glTexStorage3D(GL_TEXTURE_2D_ARRAY, 1, GL_DEPTH_COMPONENT32F, options.shadow_map_size, options.shadow_map_size,
                 max_lights);
  set_filter(GL_TEXTURE_2D_ARRAY, GL_LINEAR, GL_CLAMP_TO_BORDER);
  constexpr std::array<float, 4> nothing_there{1, 1, 1, 1};
  glTexParameterfv(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_BORDER_COLOR, nothing_there.data());
  glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
  glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
  glBindFramebuffer(GL_FRAMEBUFFER, shadow_target.name());
  glFramebufferTexture(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, shadow_maps.name(), 0);
  glDrawBuffer(GL_NONE);
  check(glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE, "a complete layered framebuffer");
  glClear(GL_DEPTH_BUFFER_BIT);
}

void GlIrradiance::Impl::upload_batch(const Batch& batch, const LightSet& set, const GlTexture& tiles) {
  GlslLightBlock block{};
  block.count = {static_cast<int>(batch.size()), 0, 0, 0};
  glActiveTexture(GL_TEXTURE4);
  glBindTexture(GL_TEXTURE_2D_ARRAY, tiles.name());
  int layer = -1;
  for (std::size_t i = 0; i < batch.size(); ++i) {
    const PlaneImage& image = set.images[image_of(batch[i])];
    block.lights[i] = make_light(batch[i], image, bounds, options.shadow_map_size);
    if (i == 0 || image_of(batch[i]) != image_of(batch[i - 1])) {  // points of one cell follow each other
      ++layer;
      glTexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, 0, 0, layer, image.width, image.height, 1, GL_RGBA, GL_FLOAT,
                      image.texels->data());
    }
    block.lights[i].image[0] = static_cast<float>(layer);
  }
  glBindBuffer(GL_UNIFORM_BUFFER, light_block.name());
  glBufferData(GL_UNIFORM_BUFFER, sizeof(block), &block, GL_STREAM_DRAW);
  glBindBufferBase(GL_UNIFORM_BUFFER, 0, light_block.name());
}

void GlIrradiance::Impl::draw_shadow_maps(const Batch& batch) {
  if (index_count == 0) return;  // the maps stay as cleared
  glBindFramebuffer(GL_FRAMEBUFFER, shadow_target.name());
  glViewport(0, 0, options.shadow_map_size, options.shadow_map_size);
  glDisable(GL_BLEND);
  glEnable(GL_DEPTH_TEST);
  glClear(GL_DEPTH_BUFFER_BIT);
  glUseProgram(shadow_pass.name());
  glBindVertexArray(mesh_layout.name());
  glDrawElementsInstanced(GL_TRIANGLES, index_count, GL_UNSIGNED_INT, nullptr, static_cast<GLsizei>(batch.size()));
}

void GlIrradiance::Impl::accumulate(GLuint target, int rows, LightSum sum) {
  glBindFramebuffer(GL_FRAMEBUFFER, target);
  glViewport(0, 0, row_points, rows);
  glDisable(GL_DEPTH_TEST);
  glEnable(GL_BLEND);
  glBlendFunc(GL_ONE, GL_ONE);
  glUseProgram(sum == LightSum::visible ? visible_pass.name() : blocked_pass.name());
  glBindVertexArray(no_layout.name());
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

GlIrradiance::GlIrradiance(const EglContext&, const TriangleMesh& mesh, const Options& options)
    : impl_(std::make_unique<Impl>()) {
  impl_->options = options;
  impl_->bounds = bounds_of(mesh);
  impl_->vertices = make_buffer();
  impl_->indices = make_buffer();
  impl_->light_block = make_buffer();
  impl_->mesh_layout = make_vertex_array();
  impl_->no_layout = make_vertex_array();
  impl_->shadow_maps = make_texture();
  impl_->shadow_target = make_framebuffer();
  impl_->shadow_pass = make_program("shadow_map.vert", "shadow_map.frag");
  impl_->visible_pass = make_program("full_screen.vert", "accumulate_visible.frag");
  impl_->blocked_pass = make_program("full_screen.vert", "accumulate_blocked.frag");
  impl_->upload_mesh(mesh);
  impl_->make_shadow_maps();
  check_gl("setting up");
}
GlIrradiance::GlIrradiance(GlIrradiance&&) noexcept = default;
GlIrradiance::~GlIrradiance() = default;

std::vector<Eigen::Vector3f> GlIrradiance::irradiance(std::span<const SurfacePoint> points, const LightSet& set,
                                                      LightSum sum, const Progress& progress) {
  if (points.empty() || (set.lights.empty() && set.emitter_points.empty()))
    return {points.size(), Eigen::Vector3f::Zero()};
  const int rows = static_cast<int>((points.size() + row_points - 1) / row_points);
  std::array<GlTexture, 3> g_buffer;
  glActiveTexture(GL_TEXTURE0);
  g_buffer[0] = upload_points(points, rows, &SurfacePoint::position);
  g_buffer[1] = upload_points(points, rows, &SurfacePoint::normal);
  g_buffer[2] = upload_points(points, rows, &SurfacePoint::geometric_normal);
  const GlTexture result = make_texture();
  glBindTexture(GL_TEXTURE_2D, result.name());
  glTexStorage2D(GL_TEXTURE_2D, 1, GL_RGBA32F, row_points, rows);
  const GlFramebuffer target = make_framebuffer();
  glBindFramebuffer(GL_FRAMEBUFFER, target.name());
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, result.name(), 0);
  glClear(GL_COLOR_BUFFER_BIT);
  for (unsigned i = 0; i < g_buffer.size(); ++i) {
    glActiveTexture(GL_TEXTURE0 + i);
    glBindTexture(GL_TEXTURE_2D, g_buffer[i].name());
  }
  const std::vector<Batch> batches = make_batches(set);
  GlTexture tiles;
  const PlaneImage* layout = nullptr;
  for (std::size_t b = 0; b < batches.size(); ++b) {
    const PlaneImage& image = set.images[image_of(batches[b].front())];
    if (layout == nullptr || layout->width != image.width || layout->height != image.height) {
      tiles = make_texture();
      glActiveTexture(GL_TEXTURE4);
      glBindTexture(GL_TEXTURE_2D_ARRAY, tiles.name());
      glTexStorage3D(GL_TEXTURE_2D_ARRAY, 1, GL_RGBA16F, image.width, image.height, max_lights);
      set_filter(GL_TEXTURE_2D_ARRAY, GL_LINEAR, GL_CLAMP_TO_EDGE);
      layout = &image;
    }
    impl_->upload_batch(batches[b], set, tiles);
    impl_->draw_shadow_maps(batches[b]);
    impl_->accumulate(target.name(), rows, sum);
    report_progress(progress, "light (gl)", static_cast<double>(b + 1) / static_cast<double>(batches.size()));
  }
  std::vector<float> texels(3 * static_cast<std::size_t>(rows) * row_points);
  glBindFramebuffer(GL_FRAMEBUFFER, target.name());
  glReadPixels(0, 0, row_points, rows, GL_RGB, GL_FLOAT, texels.data());
  check_gl("summing the light");
  std::vector<Eigen::Vector3f> sums;
  sums.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    sums.emplace_back(texels[3 * i], texels[3 * i + 1], texels[3 * i + 2]);
  return sums;
}

}  // namespace mf
