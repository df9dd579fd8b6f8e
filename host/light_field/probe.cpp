// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/probe.h"

#include <tbb/parallel_for.h>

#include <cmath>
#include <numbers>

#include "common/check.h"

namespace mf {

FieldSampler::FieldSampler(const LightField& field)
    : field_(field), locator_(field.directions), plane_from_world_(field.plane.world_from_plane.inverse()) {}

std::optional<FieldRay> FieldSampler::field_ray(const Eigen::Vector3d& x_in_world,
                                                const Eigen::Vector3d& direction) const {
  const Eigen::Vector3d x = plane_from_world_ * x_in_world;
  const Eigen::Vector3d d = plane_from_world_.rotation * direction;
  constexpr double grazing = 1e-4;  // flatter rays cross the plane beyond anything that was captured
  if (d.z() <= grazing) return std::nullopt;
  const Eigen::Vector2d crossing = (x - d * (x.z() / d.z())).head<2>();
  const Eigen::Vector2d p = crossing.cwiseMax(field_.plane.min_m).cwiseMin(field_.plane.max_m);
  FieldRay ray{p.cast<float>(), d.cast<float>()};
  if (p == crossing || field_.surroundings.is_plane()) return ray;
  const float inverse = field_.surroundings.inverse_distance_along(x_in_world.cast<float>(), direction.cast<float>());
  const Eigen::Vector3d offset = x - Eigen::Vector3d(p.x(), p.y(), 0);
  ray.direction = (d + static_cast<double>(inverse) * offset).normalized().cast<float>();
  if (static_cast<double>(ray.direction.z()) <= grazing) return std::nullopt;
  return ray;
}

Eigen::Vector4f FieldSampler::radiance(const FieldRay& ray) const {
  const DirectionWeights near = locator_.locate(ray.direction);
  Eigen::Vector4f sum = Eigen::Vector4f::Zero();  // colour · confidence, confidence
  for (std::size_t i = 0; i < near.index.size(); ++i) {
    const Eigen::Vector4f seen = sample_tile(field_, near.index[i], ray.p_in_plane);
    sum += near.weight[i] * seen.w() * Eigen::Vector4f(seen.x(), seen.y(), seen.z(), 1);
  }
  if (sum.w() <= 0) return Eigen::Vector4f::Zero();
  return {sum.x() / sum.w(), sum.y() / sum.w(), sum.z() / sum.w(), sum.w()};
}

Eigen::Vector3f FieldSampler::seen_from_centre(const FieldRay& ray) const {
  const Rigid3& world_from_plane = field_.plane.world_from_plane;
  const Eigen::Vector3f p = (world_from_plane * Eigen::Vector3d(static_cast<double>(ray.p_in_plane.x()),
                                                                static_cast<double>(ray.p_in_plane.y()), 0))
                                .cast<float>();
  const Eigen::Vector3f d = world_from_plane.rotation.cast<float>() * ray.direction;
  const float inverse = field_.surroundings.inverse_distance_along(p, d);
  return (d + inverse * (p - field_.surroundings.centre_in_world)).normalized();
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

namespace {

constexpr int part_splits = 3;  // 48 parts a cell: at 2500 directions each is about a pixel of the panorama

// The panorama averaged over each cell of the field as the point x sees it: colour and weight.
std::vector<Eigen::Vector4f> panorama_cell_means(const LightField& field, const FieldSampler& sampler,
                                                 const Eigen::Vector3d& x_in_world) {
  const Rigid3& world_from_plane = field.plane.world_from_plane;
  std::vector<Eigen::Vector4f> means(field.directions.size(), Eigen::Vector4f::Zero());
  tbb::parallel_for(std::size_t{0}, means.size(), [&](std::size_t i) {
    Eigen::Vector4f sum = Eigen::Vector4f::Zero();
    float solid_angle = 0;
    for (const CellSample& part : split_cell(field.directions, i, part_splits)) {
      const auto ray = sampler.field_ray(x_in_world, world_from_plane.rotation * part.direction.cast<double>());
      solid_angle += part.solid_angle_sr;
      if (!ray) continue;
      const Eigen::Vector4f seen = field.surroundings.panorama_at(sampler.seen_from_centre(*ray));
      sum += part.solid_angle_sr * seen.w() * Eigen::Vector4f(seen.x(), seen.y(), seen.z(), 1);
    }
    if (sum.w() > 0) means[i] << sum.head<3>() / sum.w(), sum.w() / solid_angle;
  });
  return means;
}

// The field at one point, with the panorama's detail inside its cells.
class DetailedProbe {
 public:
  DetailedProbe(const LightField& field, const FieldSampler& sampler, const Eigen::Vector3d& x_in_world)
      : field_(field), sampler_(sampler), x_in_world_(x_in_world) {
    if (field.surroundings.panorama.empty()) return;
    means_ = panorama_cell_means(field, sampler, x_in_world);
  }

  [[nodiscard]] Eigen::Vector4f radiance(const Eigen::Vector3d& direction) const {
    const auto ray = sampler_.field_ray(x_in_world_, direction);
    if (!ray) return Eigen::Vector4f::Zero();
    Eigen::Vector4f seen = sampler_.radiance(*ray);
    if (means_.empty()) return seen;
    seen.head<3>().array() *= detail(*ray, sampler_.locator().locate(ray->direction));
    return seen;
  }

 private:
  // What the panorama has at the ray, relative to its cells' means: one factor a channel.
  [[nodiscard]] Eigen::Array3f detail(const FieldRay& ray, const DirectionWeights& near) const {
    Eigen::Vector4f smooth = Eigen::Vector4f::Zero();
    for (std::size_t i = 0; i < near.index.size(); ++i) {
      const Eigen::Vector4f& mean = means_[near.index[i]];
      smooth += near.weight[i] * mean.w() * Eigen::Vector4f(mean.x(), mean.y(), mean.z(), 1);
    }
    const Eigen::Vector4f fine = field_.surroundings.panorama_at(sampler_.seen_from_centre(ray));
    constexpr float enough = 0.5F;  // weight below which the panorama says too little
    if (smooth.w() < enough || fine.w() < enough) return Eigen::Array3f::Ones();
    constexpr float strongest = 32;  // a lamp of a pixel in a dark cell; more would be noise
    const Eigen::Array3f below = (smooth.head<3>() / smooth.w()).array().max(1e-6F);
    return (fine.head<3>().array() / below).min(strongest).max(1 / strongest);
  }

  const LightField& field_;
  const FieldSampler& sampler_;
  Eigen::Vector3d x_in_world_;
  std::vector<Eigen::Vector4f> means_;
};

}  // namespace

Probe make_probe(const LightField& field, const Eigen::Vector3d& at_in_world, LatLongConvention convention, int width) {
  check(width >= 4 && width % 2 == 0, "a lat-long picture has an even width of at least 4");
  Probe probe{ImageF(width, width / 2, 3), ImageF(width, width / 2, 1)};
  const FieldSampler sampler(field);
  const DetailedProbe detailed(field, sampler, at_in_world);
  tbb::parallel_for(0, width / 2, [&](int y) {
    for (int x = 0; x < width; ++x) {
      const Eigen::Vector4f seen = detailed.radiance(lat_long_direction(convention, width, width / 2, x, y));
      for (int c = 0; c < 3; ++c) probe.radiance.at(x, y, c) = seen[c];
      probe.confidence.at(x, y) = seen.w();
    }
  });
  return probe;
}

}  // namespace mf
