// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "host/blending/view_weights.h"
#include "host/light_field/field_views.h"
#include "host/light_field/light_field.h"
#include "host/light_field/proxy_visibility.h"
#include "host/light_field/view_rays.h"

namespace mf::testing {

// The definition of a light field's texel, without any grid, structure or approximation: the ray is projected into
// every view, all views that see it are ranked, and the k best are blended. Emitters apart: those have their own rules.
class ReferenceTiles {
 public:
  ReferenceTiles(const std::vector<FieldView>& views, const LightField& field, int k)
      : views_(views),
        field_(field),
        visibility_(views, field.surroundings, field.plane),
        k_(k),
        weights_(static_cast<std::size_t>(k)) {}

  [[nodiscard]] Eigen::Vector3f point(int x, int y) const {
    const Eigen::Vector2d f((x + 0.5) / field_.resolution, (y + 0.5) / field_.resolution);
    const Eigen::Vector2d size = field_.plane.size_m();
    return (field_.plane.world_from_plane *
            Eigen::Vector3d(field_.plane.min_m.x() + f.x() * size.x(), field_.plane.max_m.y() - f.y() * size.y(), 0))
        .cast<float>();
  }

  [[nodiscard]] Eigen::Vector4f texel(std::size_t direction, int x, int y) {
    const Eigen::Vector3f p = point(x, y), d = to_world(field_.directions.directions[direction]);
    const bool plane = field_.surroundings.is_plane();
    const ProxyPoint focus =
        plane ? ProxyPoint(p.homogeneous()) : proxy_point(p, d, field_.surroundings.inverse_distance_along(p, d));
    if (direction != cell_of_ || parts_.empty()) {
      parts_ = split_cell(field_.directions, direction, 1);
      cell_of_ = direction;
    }
    ranked_.clear();
    seen_.clear();
    for (const FieldView& view : views_) {
      Eigen::Vector4f seen = plane ? look(view, focus) : look_at_cell(view, p, focus, parts_, direction);
      if (seen.w() < 0.02F) continue;
      seen *= visibility_.of_view(static_cast<std::size_t>(&view - views_.data()), focus);
      if (seen.w() < 0.02F) continue;
      const float penalty = plane ? angle(p - view.centre_in_world, d) : ray_distance(p, focus, view.centre_in_world);
      ranked_.push_back({static_cast<std::uint32_t>(seen_.size()), penalty / seen.w()});
      seen_.push_back(seen);
    }
    const std::size_t speaking = blend_weights(ranked_, k_, 1e-4F, weights_);
    Eigen::Vector4f sum = Eigen::Vector4f::Zero();
    for (std::size_t i = 0; i < speaking; ++i) {
      const Eigen::Vector4f& seen = seen_[weights_[i].view];
      sum.head<3>() += weights_[i].weight / seen.w() * seen.head<3>();
      sum.w() += seen.w();
    }
    sum.w() = std::min(sum.w(), 1.0F);
    return sum;
  }

 private:
  [[nodiscard]] Eigen::Vector3f to_world(const Eigen::Vector3f& d) const {
    return field_.plane.world_from_plane.rotation.cast<float>() * d;
  }
  static float angle(const Eigen::Vector3f& ray, const Eigen::Vector3f& d) {
    return std::atan2(ray.cross(d).norm(), ray.dot(d));
  }
  [[nodiscard]] Eigen::Vector4f look(const FieldView& view, const ProxyPoint& focus) const {
    const Eigen::Vector3f pixel = pixel_of(view, focus);
    if (pixel.z() <= 0) return Eigen::Vector4f::Zero();
    const float texel_m = static_cast<float>(field_.plane.size_m().maxCoeff() / field_.resolution);
    return view.fetch(level_for_angle(view, focus, texel_m), pixel.x() / pixel.z(), pixel.y() / pixel.z());
  }
  // Whether any of a cell may fall on the view's picture: the reference is plain, not wasteful.
  [[nodiscard]] bool within_reach(const FieldView& view, const ProxyPoint& focus, std::size_t direction) const {
    const Eigen::Vector3f pixel = pixel_of(view, focus);
    if (pixel.z() <= 0) return false;
    const float cell = std::sqrt(field_.directions.solid_angles_sr[direction]);
    const float reach = 4 * view.focal_px * cell / ray_to(focus, view.centre_in_world).norm();
    const float u = pixel.x() / pixel.z(), v = pixel.y() / pixel.z();
    return u > -reach && v > -reach && u < static_cast<float>(view.levels.front().width()) + reach &&
           v < static_cast<float>(view.levels.front().height()) + reach;
  }
  [[nodiscard]] Eigen::Vector4f look_at_cell(const FieldView& view, const Eigen::Vector3f& p, const ProxyPoint& focus,
                                             const std::vector<CellSample>& parts, std::size_t direction) const {
    if (!within_reach(view, focus, direction)) return Eigen::Vector4f::Zero();
    const float part_angle = std::sqrt(field_.directions.solid_angles_sr[direction] / static_cast<float>(parts.size()));
    const int level = level_for_angle(view, focus, part_angle);
    Eigen::Vector4f sum = Eigen::Vector4f::Zero();
    float solid_angle = 0;
    for (const CellSample& part : parts) {
      const Eigen::Vector3f pixel = pixel_of(view, proxy_point(p, to_world(part.direction), focus.w()));
      solid_angle += part.solid_angle_sr;
      if (pixel.z() > 0) sum += part.solid_angle_sr * view.fetch(level, pixel.x() / pixel.z(), pixel.y() / pixel.z());
    }
    return sum / solid_angle;
  }

  const std::vector<FieldView>& views_;
  const LightField& field_;
  ProxyVisibility visibility_;
  int k_;
  std::size_t cell_of_ = 0;
  std::vector<CellSample> parts_;
  std::vector<ViewPenalty> ranked_;
  std::vector<Eigen::Vector4f> seen_;
  std::vector<ViewWeight> weights_;
};

}  // namespace mf::testing
