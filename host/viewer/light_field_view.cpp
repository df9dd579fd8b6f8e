// SPDX-License-Identifier: Apache-2.0
#include "host/viewer/light_field_view.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/check.h"
#include "host/light_field/surroundings.h"

namespace mf {

namespace {

// Calls visit(x, y, direction) for every pixel of a disc; rows in parallel.
template <typename Visit>
void for_each_of_disc(int size_px, const Visit& visit) {
  tbb::parallel_for(0, size_px, [&](int y) {
    for (int x = 0; x < size_px; ++x)
      if (const auto direction = disc_direction({(x + 0.5) / size_px, (y + 0.5) / size_px})) visit(x, y, *direction);
  });
}

}  // namespace

std::optional<Eigen::Vector3d> disc_direction(const Eigen::Vector2d& position) {
  if ((2 * position - Eigen::Vector2d::Ones()).squaredNorm() >= 1) return std::nullopt;
  return equal_area_direction(position.cast<float>()).cast<double>().normalized();
}

LightFieldView::LightFieldView(LightField field)
    : field_(std::move(field)),
      sampler_(field_),
      irradiance_(plane_irradiance(field_)),
      probe_in_plane_(0.5 * (field_.plane.min_m + field_.plane.max_m)) {}

Eigen::Vector3d LightFieldView::probe_in_world() const {
  return field_.plane.world_from_plane * Eigen::Vector3d(probe_in_plane_.x(), probe_in_plane_.y(), height_m_);
}

void LightFieldView::move_probe(const Eigen::Vector2d& p_in_plane) {
  const Eigen::Vector2d inside = p_in_plane.cwiseMax(field_.plane.min_m).cwiseMin(field_.plane.max_m);
  if (inside == probe_in_plane_) return;
  probe_in_plane_ = inside;
  forget_pictures();
}

void LightFieldView::set_height(double metres) {
  check(metres >= 0, "the probe point is on the plane or above");
  if (metres == height_m_) return;
  height_m_ = metres;
  forget_pictures();
}

void LightFieldView::forget_pictures() {
  hemisphere_ = {};
  inverse_distances_ = {};
  panorama_ = {};
}

Eigen::Vector2d LightFieldView::plane_point(const Eigen::Vector2d& position) const {
  const Eigen::Vector2d from_min(position.x(), 1 - position.y());
  return field_.plane.min_m + from_min.cwiseProduct(field_.plane.size_m());
}

Eigen::Vector2d LightFieldView::plane_position(const Eigen::Vector2d& p_in_plane) const {
  const Eigen::Vector2d from_min = (p_in_plane - field_.plane.min_m).cwiseQuotient(field_.plane.size_m());
  return {from_min.x(), 1 - from_min.y()};
}

Eigen::Vector3f LightFieldView::irradiance_at(const Eigen::Vector2d& p_in_plane) const {
  const Eigen::Vector2d texel = plane_position(p_in_plane) * field_.resolution;
  const auto inside = [this](double t) { return std::clamp(static_cast<int>(t), 0, field_.resolution - 1); };
  return Eigen::Map<const Eigen::Vector3f>(&irradiance_.data[irradiance_.index(inside(texel.x()), inside(texel.y()))]);
}

Eigen::Vector4f LightFieldView::radiance_from(const Eigen::Vector3d& direction_in_world) const {
  const auto ray = sampler_.field_ray(probe_in_world(), direction_in_world);
  return ray ? sampler_.radiance(*ray) : Eigen::Vector4f::Zero();
}

std::optional<double> LightFieldView::inverse_distance_towards(const Eigen::Vector3d& direction_in_world) const {
  if (field_.surroundings.is_plane()) return std::nullopt;
  return static_cast<double>(
      field_.surroundings.inverse_distance_along(probe_in_world().cast<float>(), direction_in_world.cast<float>()));
}

DirectionReading LightFieldView::read(const Eigen::Vector3d& direction_in_world) const {
  return {direction_in_world, radiance_from(direction_in_world), inverse_distance_towards(direction_in_world)};
}

const ImageF& LightFieldView::hemisphere(int size_px) {
  if (hemisphere_.width == size_px) return hemisphere_;
  hemisphere_ = ImageF(size_px, size_px, 3);
  for_each_of_disc(size_px, [&](int x, int y, const Eigen::Vector3d& direction) {
    const Eigen::Vector4f seen = radiance_from(field_.plane.world_from_plane.rotation * direction);
    for (int c = 0; c < 3; ++c) hemisphere_.at(x, y, c) = seen[c];
  });
  return hemisphere_;
}

const ImageF& LightFieldView::inverse_distances(int size_px) {
  if (field_.surroundings.is_plane() || inverse_distances_.width == size_px) return inverse_distances_;
  inverse_distances_ = ImageF(size_px, size_px, 1);
  for_each_of_disc(size_px, [&](int x, int y, const Eigen::Vector3d& direction) {
    inverse_distances_.at(x, y) =
        static_cast<float>(*inverse_distance_towards(field_.plane.world_from_plane.rotation * direction));
  });
  return inverse_distances_;
}

const ImageF& LightFieldView::panorama(int width_px) {
  if (panorama_.width != width_px)
    panorama_ = make_probe(field_, probe_in_world(), LatLongConvention::blender, width_px).radiance;
  return panorama_;
}

std::optional<DirectionReading> LightFieldView::read_disc(const Eigen::Vector2d& position) const {
  const auto direction = disc_direction(position);
  if (!direction) return std::nullopt;
  return read(field_.plane.world_from_plane.rotation * *direction);
}

std::optional<DirectionReading> LightFieldView::read_panorama(const Eigen::Vector2d& position) const {
  constexpr int width = 4096;  // finer than any screen
  const auto pixel = [](double fraction, int size) {
    return std::clamp(static_cast<int>(fraction * size), 0, size - 1);
  };
  const Eigen::Vector3d direction = lat_long_direction(LatLongConvention::blender, width, width / 2,
                                                       pixel(position.x(), width), pixel(position.y(), width / 2));
  if ((field_.plane.world_from_plane.rotation.conjugate() * direction).z() <= 0) return std::nullopt;
  return read(direction);
}

ImageU8 show_inverse_distances(const ImageF& inverse_distances, double nearest_m) {
  ImageU8 shown(inverse_distances.width, inverse_distances.height, 1);
  std::transform(inverse_distances.data.begin(), inverse_distances.data.end(), shown.data.begin(), [&](float inverse) {
    return static_cast<std::uint8_t>(std::lround(255 * std::min(1.0, static_cast<double>(inverse) * nearest_m)));
  });
  return shown;
}

std::string describe(const DirectionReading& r) {
  constexpr double degrees = 180 / std::numbers::pi;
  const Eigen::Vector3d& d = r.direction_in_world;
  const double azimuth = std::atan2(d.y(), d.x()) * degrees;
  std::string line = fmt::format("azimuth {:.0f}°, elevation {:.0f}°: ", azimuth < -0.5 ? azimuth + 360 : azimuth,
                                 std::asin(std::clamp(d.z(), -1.0, 1.0)) * degrees);
  if (r.radiance.w() <= 0) return line + "no view looked there";
  line += fmt::format("{:.3g} {:.3g} {:.3g}", r.radiance.x(), r.radiance.y(), r.radiance.z());
  if (!r.inverse_distance) return line;
  return line + (*r.inverse_distance > 0 ? fmt::format(", {:.2f} m away", 1 / *r.inverse_distance) : ", distant");
}

}  // namespace mf
