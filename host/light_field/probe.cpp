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
  Eigen::Vector4f sum = Eigen::Vector4f::Zero();  // colour · say, say
  float confidence = 0;
  for (std::size_t i = 0; i < near.index.size(); ++i) {
    const Eigen::Vector4f seen = sample_tile(field_, near.index[i], ray.p_in_plane);
    sum += near.weight[i] * say_of(seen) * Eigen::Vector4f(seen.x(), seen.y(), seen.z(), 1);
    confidence += near.weight[i] * seen.w();
  }
  if (sum.w() <= 0) return Eigen::Vector4f::Zero();
  return {sum.x() / sum.w(), sum.y() / sum.w(), sum.z() / sum.w(), confidence};
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

double lat_long_solid_angle(LatLongConvention convention, int width, int height, int x, int y) {
  using std::numbers::pi;
  const double across = lat_long_direction(convention, width, height, x, y).head<2>().norm();
  if (convention != LatLongConvention::openexr) return 2 * pi / width * pi / height * across;
  const double share = x == 0 || x == width - 1 ? 0.5 : 1;  // the first and the last column are the same directions
  return share * 2 * pi / (width - 1) * pi / (height - 1) * across;
}

namespace {

constexpr int part_splits = 3;  // 48 parts a cell: at 2500 directions each is about a pixel of the panorama

// An emitter behind its occluders, as a ray of the field sees it; nothing when the ray meets none, or one of which no
// view told.
std::optional<Eigen::Vector3f> emitter_light(const LightField& field, const FieldRay& ray) {
  const Rigid3& world_from_plane = field.plane.world_from_plane;
  const Eigen::Vector3f p = (world_from_plane * Eigen::Vector3d(static_cast<double>(ray.p_in_plane.x()),
                                                                static_cast<double>(ray.p_in_plane.y()), 0))
                                .cast<float>();
  const Eigen::Vector3f d = world_from_plane.rotation.cast<float>() * ray.direction;
  for (const ShadedEmitter& e : field.emitters) {
    if (!e.met_at(p, d)) continue;
    const auto visibility = e.visibility(p, d);
    return visibility ? std::optional<Eigen::Vector3f>(*visibility * e.radiance) : std::nullopt;
  }
  return std::nullopt;
}

// What is finer than the field, averaged over a cell as the point x sees it.
struct CellMeans {
  Eigen::Vector4f panorama = Eigen::Vector4f::Zero();  // colour and weight, of the parts that see no emitter
  float on_emitters = 0;                               // share of the parts that do
};

CellMeans cell_means(const LightField& field, const FieldSampler& sampler, const Eigen::Vector3d& x_in_world,
                     std::size_t cell) {
  CellMeans means;
  Eigen::Vector4f sum = Eigen::Vector4f::Zero();
  float solid_angle = 0;
  for (const CellSample& part : split_cell(field.directions, cell, part_splits)) {
    const auto ray =
        sampler.field_ray(x_in_world, field.plane.world_from_plane.rotation * part.direction.cast<double>());
    solid_angle += part.solid_angle_sr;
    if (!ray) continue;
    if (emitter_light(field, *ray)) {
      means.on_emitters += part.solid_angle_sr;
      continue;
    }
    const Eigen::Vector4f seen = field.surroundings.panorama_at(sampler.seen_from_centre(*ray));
    sum += part.solid_angle_sr * seen.w() * Eigen::Vector4f(seen.x(), seen.y(), seen.z(), 1);
  }
  if (solid_angle <= 0) return means;
  means.on_emitters /= solid_angle;
  if (sum.w() > 0) means.panorama << sum.head<3>() / sum.w(), sum.w() / solid_angle;
  return means;
}

// The field at one point, with the detail inside its cells: emitters as they are, the rest as the panorama has it.
class DetailedProbe {
 public:
  DetailedProbe(const LightField& field, const FieldSampler& sampler, const Eigen::Vector3d& x_in_world)
      : field_(field), sampler_(sampler), x_in_world_(x_in_world) {
    if (field.surroundings.panorama.empty()) return;
    means_.resize(field.directions.size());
    tbb::parallel_for(std::size_t{0}, means_.size(),
                      [&](std::size_t i) { means_[i] = cell_means(field, sampler, x_in_world, i); });
  }

  [[nodiscard]] Eigen::Vector4f radiance(const Eigen::Vector3d& direction) const {
    const auto ray = sampler_.field_ray(x_in_world_, direction);
    if (!ray) return Eigen::Vector4f::Zero();
    Eigen::Vector4f seen = sampler_.radiance(*ray);
    if (means_.empty()) return seen;
    if (const auto light = emitter_light(field_, *ray))
      seen.head<3>() = *light;
    else
      seen.head<3>() = beside_emitters(*ray, seen);
    return seen;
  }

 private:
  // What the field has at the ray, with the panorama's detail: that relative to its cells' means, one factor a channel.
  // In a cell that holds a part of an emitter the field is mostly the emitter's light: there the panorama alone speaks.
  [[nodiscard]] Eigen::Vector3f beside_emitters(const FieldRay& ray, const Eigen::Vector4f& seen) const {
    Eigen::Vector4f smooth = Eigen::Vector4f::Zero();
    float on_emitters = 0;
    const DirectionWeights near = sampler_.locator().locate(ray.direction);
    for (std::size_t i = 0; i < near.index.size(); ++i) {
      const CellMeans& mean = means_[near.index[i]];
      const Eigen::Vector4f& panorama = mean.panorama;
      smooth += near.weight[i] * panorama.w() * Eigen::Vector4f(panorama.x(), panorama.y(), panorama.z(), 1);
      on_emitters = std::max(on_emitters, mean.on_emitters);
    }
    const Eigen::Vector4f fine = field_.surroundings.panorama_at(sampler_.seen_from_centre(ray));
    constexpr float enough = 0.5F;  // weight below which the panorama says too little
    if (smooth.w() + on_emitters < enough || fine.w() < enough) return seen.head<3>();
    if (on_emitters > 0) return fine.head<3>();
    constexpr float strongest = 32;  // a lamp of a pixel in a dark cell; more would be noise
    const Eigen::Array3f mean = (smooth.head<3>() / smooth.w()).array().max(1e-6F);
    return seen.head<3>().array() * (fine.head<3>().array() / mean).min(strongest);
  }

  const LightField& field_;
  const FieldSampler& sampler_;
  Eigen::Vector3d x_in_world_;
  std::vector<CellMeans> means_;
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
