// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "common/image.h"
#include "host/light_field/light_field.h"
#include "host/light_field/probe.h"

namespace mf {

// What arrives at the probe point from one direction.
struct DirectionReading {
  Eigen::Vector3d direction_in_world;      // unit, towards the light
  Eigen::Vector4f radiance;                // red, green, blue, confidence
  std::optional<double> inverse_distance;  // of the surroundings from the probe point, 1/m (0: distant); none: unknown
};

// A light field looked at from a probe point that the user moves over its plane. Pictures are linear and made when
// they are first asked for after the point moved.
//
// Discs are the upper hemisphere seen from below: Lambert's equal-area map, the zenith in the middle, plane +x to the
// right and +y up (equal_area_square); outside the disc everything is 0. Positions in pictures are fractions of their
// width and height, (0, 0) the upper left corner.
class LightFieldView {
 public:
  explicit LightFieldView(LightField);
  LightFieldView(const LightFieldView&) = delete;
  LightFieldView& operator=(const LightFieldView&) = delete;
  ~LightFieldView() = default;

  [[nodiscard]] const LightField& field() const { return field_; }

  // The probe point: on the plane, metres, kept inside the rectangle, and how far above. Starts in the middle at 0.
  [[nodiscard]] const Eigen::Vector2d& probe_in_plane() const { return probe_in_plane_; }
  [[nodiscard]] double height_m() const { return height_m_; }
  [[nodiscard]] Eigen::Vector3d probe_in_world() const;
  void move_probe(const Eigen::Vector2d& p_in_plane);
  void set_height(double metres);  // 0 or more

  // Irradiance of the bare plane, RGB; its position (0, 0) is (min x, max y) of the rectangle.
  [[nodiscard]] const ImageF& irradiance() const { return irradiance_; }
  [[nodiscard]] Eigen::Vector2d plane_point(const Eigen::Vector2d& position) const;
  [[nodiscard]] Eigen::Vector2d plane_position(const Eigen::Vector2d& p_in_plane) const;
  [[nodiscard]] Eigen::Vector3f irradiance_at(const Eigen::Vector2d& p_in_plane) const;

  // Disc of the radiance that arrives at the point, RGB.
  [[nodiscard]] const ImageF& hemisphere(int size_px);
  // Disc of the inverse distance to the surroundings, 1/m, one channel; empty for a field focused on its own plane.
  [[nodiscard]] const ImageF& inverse_distances(int size_px);
  // Lat-long panorama of the light at the point (LatLongConvention::blender: world +Y at its centre, −X a quarter to
  // the left), width_px × width_px / 2, RGB.
  [[nodiscard]] const ImageF& panorama(int width_px);

  // Nothing outside of the disc, and below the horizon of the panorama.
  [[nodiscard]] std::optional<DirectionReading> read_disc(const Eigen::Vector2d& position) const;
  [[nodiscard]] std::optional<DirectionReading> read_panorama(const Eigen::Vector2d& position) const;

 private:
  [[nodiscard]] Eigen::Vector4f radiance_from(const Eigen::Vector3d& direction_in_world) const;
  [[nodiscard]] std::optional<double> inverse_distance_towards(const Eigen::Vector3d& direction_in_world) const;
  [[nodiscard]] DirectionReading read(const Eigen::Vector3d& direction_in_world) const;
  void forget_pictures();

  LightField field_;
  FieldSampler sampler_;
  ImageF irradiance_;
  Eigen::Vector2d probe_in_plane_;
  double height_m_ = 0;
  ImageF hemisphere_;  // empty: not made for this point
  ImageF inverse_distances_;
  ImageF panorama_;
};

// Direction of a position of a disc, plane frame; nothing outside of the disc.
[[nodiscard]] std::optional<Eigen::Vector3d> disc_direction(const Eigen::Vector2d& position);

// Inverse distances as a grey picture: white is `nearest_m` or nearer, black is distant.
[[nodiscard]] ImageU8 show_inverse_distances(const ImageF&, double nearest_m);

// A line for people: "azimuth 30°, elevation 45°: 1.2 0.9 0.7, 2.3 m away". Azimuth is counter-clockwise from world +x.
[[nodiscard]] std::string describe(const DirectionReading&);

}  // namespace mf
