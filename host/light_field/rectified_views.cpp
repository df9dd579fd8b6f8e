// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/rectified_views.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "host/light_field/view_rays.h"

namespace mf {

TexelGrid::TexelGrid(const PlaneRectangle& plane, int resolution) {
  const Eigen::Vector2d step = plane.size_m() / resolution;
  const Eigen::Matrix3d turn = plane.world_from_plane.rotation.toRotationMatrix();
  origin = (plane.world_from_plane * Eigen::Vector3d(plane.min_m.x(), plane.max_m.y(), 0)).cast<float>();
  step_x = (turn.col(0) * step.x()).cast<float>();
  step_y = (turn.col(1) * -step.y()).cast<float>();
}

RectifiedViews::RectifiedViews(const std::vector<FieldView>& views, const PlaneRectangle& plane, int resolution)
    : grid_(plane, resolution),
      texel_m_(static_cast<float>(plane.size_m().maxCoeff() / resolution)),
      blocks_((resolution + block_side - 1) / block_side),
      block_(static_cast<std::size_t>(blocks_ * blocks_)),
      vertex_(static_cast<std::size_t>((blocks_ + 1) * (blocks_ + 1))) {
  // Straight colours are up to 1 / smallest_view_weight = 50 times the premultiplied ones that a view's unit is made
  // for, which leave a factor of two.
  constexpr float straight = 32;
  for (const FieldView& view : views) {
    centre_.push_back(view.centre_in_world);
    unit_.push_back(straight * view.levels.front().unit());
  }
  tbb::parallel_for(0, blocks_ * blocks_, [&](int i) { rectify(views, i % blocks_, i / blocks_); });
  const int side = blocks_ + 1;
  tbb::parallel_for(0, side * side, [&](int i) { look_at_vertex(views, i % side, i / side); });
}

namespace {

// What a view shows of a texel of the plane.
Eigen::Vector4f look_at(const FieldView& view, const Eigen::Vector3f& p, float texel_m) {
  const ProxyPoint x = p.homogeneous();
  const Eigen::Vector3f pixel = pixel_of(view, x);
  if (pixel.z() <= 0) return Eigen::Vector4f::Zero();
  return view.fetch(level_for_angle(view, x, texel_m), pixel.x() / pixel.z(), pixel.y() / pixel.z());
}

// As one lane of a quarter.
void store(const Eigen::Vector4f& texel, float unit, std::uint16_t* lane) {
  const bool speaks = texel.w() >= smallest_view_weight;
  for (std::size_t c = 0; c < 3; ++c)
    lane[c * quarter_lanes] =
        speaks ? to_normal_half(texel[static_cast<Eigen::Index>(c)] / (unit * texel.w())) : std::uint16_t{0};
  lane[3 * quarter_lanes] = speaks ? to_normal_half(texel.w()) : std::uint16_t{0};
}

// Whether a view may show some of a quadrangle: its corners do not all lie beyond one edge of the picture. `reach_px`:
// how far an interpolation reaches.
bool may_see(const FieldView& view, const std::array<Eigen::Vector3f, 4>& corners, float reach_px) {
  const float width = static_cast<float>(view.levels.front().width()) + reach_px;
  const float height = static_cast<float>(view.levels.front().height()) + reach_px;
  int left = 0, right = 0, above = 0, below = 0, behind = 0;
  for (const Eigen::Vector3f& corner : corners) {
    const Eigen::Vector3f pixel = pixel_of(view, corner.homogeneous());
    if (pixel.z() <= 0) {
      ++behind;
      continue;
    }
    const float u = pixel.x() / pixel.z(), v = pixel.y() / pixel.z();
    left += u < -reach_px ? 1 : 0;
    right += u > width ? 1 : 0;
    above += v < -reach_px ? 1 : 0;
    below += v > height ? 1 : 0;
  }
  if (behind > 0) return behind < 4;
  return left < 4 && right < 4 && above < 4 && below < 4;
}

// The largest angle between a unit ray and those through the corners.
float spread_of(const Eigen::Vector3f& ray, const std::array<Eigen::Vector3f, 4>& corners,
                const Eigen::Vector3f& centre) {
  float spread = 0;
  for (const Eigen::Vector3f& corner : corners) {
    const Eigen::Vector3f other = corner - centre;
    spread = std::max(spread, std::atan2(ray.cross(other).norm(), ray.dot(other)));
  }
  return spread;
}

}  // namespace

void RectifiedViews::rectify(const std::vector<FieldView>& views, int block_x, int block_y) {
  Block& block = block_[static_cast<std::size_t>(block_y * blocks_ + block_x)];
  const float x0 = static_cast<float>(block_x * block_side), y0 = static_cast<float>(block_y * block_side);
  const std::array<Eigen::Vector3f, 4> corners{grid_.at(x0, y0), grid_.at(x0 + block_side, y0),
                                               grid_.at(x0, y0 + block_side),
                                               grid_.at(x0 + block_side, y0 + block_side)};
  const Eigen::Vector3f middle = grid_.at(x0 + 0.5F * block_side, y0 + 0.5F * block_side);
  std::array<std::uint16_t, quarters * quarter_halves> shown;
  for (std::uint32_t v = 0; v < views.size(); ++v) {
    const float texel_px = texel_m_ * views[v].focal_px / (corners[0] - views[v].centre_in_world).norm();
    if (!may_see(views[v], corners, 2 * texel_px + 2)) continue;
    float most = 0;
    for (std::size_t q = 0; q < quarters; ++q)
      for (std::size_t i = 0; i < quarter_lanes; ++i) {
        const auto [x, y] = texel_of(q, i);
        const Eigen::Vector3f p = grid_.at(x0 + static_cast<float>(x) + 0.5F, y0 + static_cast<float>(y) + 0.5F);
        const Eigen::Vector4f texel = look_at(views[v], p, texel_m_);
        store(texel, unit_[v], shown.data() + q * quarter_halves + i);
        most = std::max(most, texel.w());
      }
    if (most < smallest_view_weight) continue;
    const Eigen::Vector3f ray = (middle - views[v].centre_in_world).normalized();
    block.views.push_back(v);
    block.ray_x.push_back(ray.x());
    block.ray_y.push_back(ray.y());
    block.ray_z.push_back(ray.z());
    block.spread_rad.push_back(spread_of(ray, corners, views[v].centre_in_world));
    block.most.push_back(most);
    block.halves.insert(block.halves.end(), shown.begin(), shown.end());
  }
}

void RectifiedViews::look_at_vertex(const std::vector<FieldView>& views, int x, int y) {
  const Eigen::Vector3f p = grid_.at(static_cast<float>(x * block_side), static_cast<float>(y * block_side));
  Vertex& vertex = vertex_[static_cast<std::size_t>(y * (blocks_ + 1) + x)];
  for (const FieldView& view : views) {
    const float weight = look_at(view, p, texel_m_).w();
    if (weight < smallest_view_weight) continue;
    const Eigen::Vector3f ray = (p - view.centre_in_world).normalized();
    vertex.ray_x.push_back(ray.x());
    vertex.ray_y.push_back(ray.y());
    vertex.ray_z.push_back(ray.z());
    vertex.weight.push_back(weight);
    vertex.factor.push_back(1 / (weight * weight));
  }
}

}  // namespace mf
