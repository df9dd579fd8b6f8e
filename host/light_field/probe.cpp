// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/probe.h"

#include <tbb/parallel_for.h>

#include <cmath>
#include <numbers>

#include "common/check.h"
#include "host/light_field/view_rays.h"

namespace mf {

FieldSampler::FieldSampler(const LightField& field)
    : field_(field), locator_(field.directions), plane_from_world_(field.plane.world_from_plane.inverse()) {}

Eigen::Vector4f FieldSampler::radiance(const Eigen::Vector3d& x_in_world, const Eigen::Vector3d& direction) const {
  const Eigen::Vector3d x = plane_from_world_ * x_in_world;
  Eigen::Vector3d d = plane_from_world_.rotation * direction;
  if (d.z() <= 1e-4) return Eigen::Vector4f::Zero();  // never crosses the plane before the surroundings
  const Eigen::Vector2d crossing = (x - d * (x.z() / d.z())).head<2>();
  const Eigen::Vector2d p = crossing.cwiseMax(field_.plane.min_m).cwiseMin(field_.plane.max_m);
  if (p != crossing && field_.proxy.radius_m > 0 && !std::isinf(field_.proxy.radius_m)) {
    const Eigen::Vector2d middle = 0.5 * (field_.plane.min_m + field_.plane.max_m);
    const Eigen::Vector3f centre(static_cast<float>(middle.x()), static_cast<float>(middle.y()), 0);
    const double inverse = static_cast<double>(
        inverse_distance_to_sphere(x.cast<float>(), d.cast<float>(), centre, field_.proxy.radius_m));
    const Eigen::Vector3d on_proxy = x + d / inverse;
    const Eigen::Vector3d aimed = on_proxy - Eigen::Vector3d(p.x(), p.y(), 0);
    if (aimed.z() <= 0) return Eigen::Vector4f::Zero();
    d = aimed.normalized();
  }
  const DirectionWeights near = locator_.locate(d.cast<float>());
  Eigen::Vector4f sum = Eigen::Vector4f::Zero();  // colour · confidence, confidence
  for (std::size_t i = 0; i < near.index.size(); ++i) {
    const Eigen::Vector4f seen = sample_tile(field_, near.index[i], p.cast<float>());
    sum += near.weight[i] * seen.w() * Eigen::Vector4f(seen.x(), seen.y(), seen.z(), 1);
  }
  if (sum.w() <= 0) return Eigen::Vector4f::Zero();
  return {sum.x() / sum.w(), sum.y() / sum.w(), sum.z() / sum.w(), sum.w()};
}

std::optional<LatLongConvention> parse_lat_long_convention(std::string_view name) {
  if (name == "openexr") return LatLongConvention::openexr;
  if (name == "blender") return LatLongConvention::blender;
  if (name == "threejs") return LatLongConvention::threejs;
  return std::nullopt;
}

Eigen::Vector3d lat_long_direction(LatLongConvention convention, int width, int height, int x, int y) {
  using std::numbers::pi;
  const double u = (x + 0.5) / width, v = (y + 0.5) / height;
  if (convention == LatLongConvention::openexr) {
    const double longitude = pi * (1 - 2.0 * x / (width - 1)),
                 latitude = pi * (0.5 - static_cast<double>(y) / (height - 1));
    const Eigen::Vector3d y_up(std::sin(longitude) * std::cos(latitude), std::sin(latitude),
                               std::cos(longitude) * std::cos(latitude));
    return {y_up.x(), -y_up.z(), y_up.y()};
  }
  const double angle = 2 * pi * (0.5 - u),
               latitude = pi * (0.5 - v);  // counter-clockwise from the centre, seen from above
  if (convention == LatLongConvention::blender)
    return {-std::sin(angle) * std::cos(latitude), std::cos(angle) * std::cos(latitude), std::sin(latitude)};
  const Eigen::Vector3d y_up(std::cos(angle) * std::cos(latitude), std::sin(latitude),
                             -std::sin(angle) * std::cos(latitude));
  return {y_up.x(), -y_up.z(), y_up.y()};
}

Probe make_probe(const LightField& field, const Eigen::Vector3d& at_in_world, LatLongConvention convention, int width) {
  check(width >= 4 && width % 2 == 0, "a lat-long picture has an even width of at least 4");
  Probe probe{ImageF(width, width / 2, 3), ImageF(width, width / 2, 1)};
  const FieldSampler sampler(field);
  tbb::parallel_for(0, width / 2, [&](int y) {
    for (int x = 0; x < width; ++x) {
      const Eigen::Vector4f seen =
          sampler.radiance(at_in_world, lat_long_direction(convention, width, width / 2, x, y));
      for (int c = 0; c < 3; ++c) probe.radiance.at(x, y, c) = seen[c];
      probe.confidence.at(x, y) = seen.w();
    }
  });
  return probe;
}

}  // namespace mf
