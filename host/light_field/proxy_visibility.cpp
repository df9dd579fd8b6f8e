// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/proxy_visibility.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "host/light_field/map_lookup.h"

namespace mf {

namespace {

constexpr float map_step_rad = 0.018F;  // a degree, about what the proxy's own map resolves
constexpr float least_rise = 0.02F;

// Rays that cross the plane so far outside of the rectangle, as a share of its size, answer for none of its points.
constexpr float margin = 0.25F;

// From one of the rays that a view keeps to the next.
float pixels_apart(const FieldView& view) {
  return std::max(1.0F, map_step_rad * view.focal_px);
}

// Inverse distance from the plane to what each of the view's rays meets; 0 where a ray does not come by the rectangle.
ImageF met_by(const FieldView& view, const Surroundings& surroundings, const PlaneRectangle& rectangle) {
  const float apart = pixels_apart(view);
  const auto count = [&](int pixels) { return static_cast<int>(std::ceil(static_cast<float>(pixels) / apart)); };
  ImageF met(count(view.levels.front().width()), count(view.levels.front().height()), 1);
  const Eigen::Matrix3f ray_from_pixel = Eigen::Matrix3f(view.pixel_from_world.leftCols<3>()).inverse();
  const Rigid3 plane_from_world = rectangle.world_from_plane.inverse();
  const Eigen::Vector2d beyond = margin * rectangle.size_m();
  const float height = static_cast<float>(rectangle.world_from_plane.translation.z());
  for (int y = 0; y < met.height; ++y)
    for (int x = 0; x < met.width; ++x) {
      const Eigen::Vector3f pixel((static_cast<float>(x) + 0.5F) * apart, (static_cast<float>(y) + 0.5F) * apart, 1);
      const Eigen::Vector3f direction = (ray_from_pixel * pixel).normalized();
      if (direction.z() < least_rise) continue;
      const Eigen::Vector3f p = view.centre_in_world + (height - view.centre_in_world.z()) / direction.z() * direction;
      const Eigen::Array2d in_plane = (plane_from_world * p.cast<double>()).head<2>();
      const bool near = (in_plane > (rectangle.min_m - beyond).array()).all() &&
                        (in_plane < (rectangle.max_m + beyond).array()).all();
      if (near) met.at(x, y) = surroundings.inverse_distance_along(p, direction);
    }
  return met;
}

bool has_fronts(const Surroundings& s) {
  return !s.is_plane() && !s.box && (s.mesh != nullptr || s.inverse_distance.data.size() > 1);
}

}  // namespace

ProxyVisibility::ProxyVisibility(const std::vector<FieldView>& views, const Surroundings& surroundings,
                                 const PlaneRectangle& rectangle)
    : views_(views), plane_height_m_(static_cast<float>(rectangle.world_from_plane.translation.z())) {
  if (!has_fronts(surroundings)) return;
  met_.resize(views.size());
  nearest_met_.resize(views.size());
  tbb::parallel_for(std::size_t{0}, views.size(), [&](std::size_t i) {
    met_[i] = met_by(views[i], surroundings, rectangle);
    nearest_met_[i] = *std::max_element(met_[i].data.begin(), met_[i].data.end());
  });
}

float ProxyVisibility::of_view(std::size_t view, const ProxyPoint& x) const {
  if (met_.empty()) return 1;
  const Eigen::Vector3f& centre = views_[view].centre_in_world;
  const Eigen::Vector3f ray = ray_to(x, centre);  // to X, times X's w
  if (ray.z() <= 0) return 1;
  const float crossed = x.w() * (plane_height_m_ - centre.z()) / ray.z();  // the plane, at this share of the way to X
  if (crossed >= 1) return 1;
  const float expected = x.w() / (ray.norm() * (1 - crossed));
  constexpr float least_step = 0.1F, share = 0.1F;  // see the header
  const float step = least_step + share * expected;
  if (nearest_met_[view] <= expected + step) return 1;
  const Eigen::Vector3f pixel = pixel_of(views_[view], x);
  if (pixel.z() <= 0) return 1;
  const float texels = 1 / (pixel.z() * pixels_apart(views_[view]));
  const float met = bilinear(met_[view], pixel.x() * texels, pixel.y() * texels);
  return std::clamp(2 - (met - expected) / step, 0.0F, 1.0F);
}

}  // namespace mf
