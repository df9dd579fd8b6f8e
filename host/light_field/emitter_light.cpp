// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/emitter_light.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "host/light_field/block_blend.h"
#include "host/light_field/emitter_blender.h"
#include "host/light_field/rectified_views.h"

namespace mf {

namespace {

// The emitters' light in one cell, mean over it, at the vertices of the resampler's blocks; empty where it has none.
class DrawnLight {
 public:
  explicit DrawnLight(const LightField& field)
      : field_(field),
        world_from_plane_(field.plane.world_from_plane.rotation.toRotationMatrix().cast<float>()),
        grid_(field.plane, field.resolution),
        side_((field.resolution + vertex_step - 1) / vertex_step + 1) {}

  [[nodiscard]] std::vector<Eigen::Vector3f> of_cell(std::size_t cell) const {
    const Eigen::Vector3f direction = world_from_plane_ * field_.directions.directions[cell];
    const float angle = std::sqrt(field_.directions.solid_angles_sr[cell]);  // no corner is farther from the direction
    std::vector<Eigen::Vector3f> light;
    std::vector<CellSample> parts;
    for (int i = 0; i < side_ * side_; ++i) {
      const Eigen::Vector3f p =
          grid_.at(static_cast<float>(i % side_ * vertex_step), static_cast<float>(i / side_ * vertex_step));
      if (!may_meet_emitter(field_.emitters, p, direction, angle)) continue;
      if (parts.empty()) {
        light.assign(static_cast<std::size_t>(side_ * side_), Eigen::Vector3f::Zero());
        const int splits = splits_near_emitter(field_.directions.solid_angles_sr[cell]);
        parts = split_cell(field_.directions, cell, splits, world_from_plane_);
      }
      light[static_cast<std::size_t>(i)] = mean_over(parts, p);
    }
    return light;
  }

  // The tile's texels, less that light.
  [[nodiscard]] PlaneTile without(std::size_t cell, const std::vector<Eigen::Vector3f>& light) const {
    const int n = field_.resolution;
    PlaneTile tile{field_.plane.min_m.cast<float>(), field_.plane.max_m.cast<float>(), n, n, {}};
    const Eigen::Vector4f* texel = field_.tile(cell);
    tile.texels.assign(texel, texel + field_.texel_count());
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x) {
        Eigen::Vector4f& t = tile.texels[static_cast<std::size_t>(y * n + x)];
        // A texel's colour is the mean over what was seen of the cell, and its confidence how much that is.
        if (t.w() > 0) t.head<3>() -= at_texel(light, x, y) / t.w();
      }
    return tile;
  }

 private:
  [[nodiscard]] Eigen::Vector3f mean_over(const std::vector<CellSample>& parts, const Eigen::Vector3f& p) const {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    float solid_angle = 0;
    for (const CellSample& part : parts) {
      solid_angle += part.solid_angle_sr;
      const ShadedEmitter* const met = emitter_met(field_.emitters, p, part.direction);
      if (met == nullptr) continue;
      const float visible = met->visibility(p, part.direction).value_or(0);  // without a mask nothing is drawn apart
      sum += part.solid_angle_sr * (visible * met->radiance);
    }
    return sum / solid_angle;
  }
  [[nodiscard]] Eigen::Vector3f at_texel(const std::vector<Eigen::Vector3f>& light, int x, int y) const {
    const int x0 = x / vertex_step, y0 = y / vertex_step;
    const float fx = (static_cast<float>(x % vertex_step) + 0.5F) / static_cast<float>(vertex_step);
    const float fy = (static_cast<float>(y % vertex_step) + 0.5F) / static_cast<float>(vertex_step);
    const Eigen::Vector3f* row = light.data() + static_cast<std::ptrdiff_t>(y0) * side_ + x0;
    const Eigen::Vector3f* below = row + side_;
    return (1 - fy) * ((1 - fx) * row[0] + fx * row[1]) + fy * ((1 - fx) * below[0] + fx * below[1]);
  }

  const LightField& field_;
  Eigen::Matrix3f world_from_plane_;
  TexelGrid grid_;
  int side_;  // vertices along a side of the tile
};

}  // namespace

DarkTiles tiles_without_emitters(const LightField& field) {
  DarkTiles tiles;
  tiles.images = images_of(field);
  if (field.emitters.empty()) return tiles;
  const DrawnLight drawn(field);
  tiles.changed.resize(field.directions.size());
  tbb::parallel_for(std::size_t{0}, field.directions.size(), [&](std::size_t i) {
    const std::vector<Eigen::Vector3f> light = drawn.of_cell(i);
    if (light.empty()) return;
    tiles.changed[i] = drawn.without(i, light);
    tiles.images[i] = tiles.changed[i].image();
  });
  return tiles;
}

}  // namespace mf
