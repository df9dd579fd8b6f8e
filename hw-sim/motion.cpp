// SPDX-License-Identifier: Apache-2.0
#include "hw-sim/motion.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "hw-sim/sampler.h"

namespace mf::sim {

namespace {

using Eigen::Vector3d;

constexpr double clearance_m = 0.02;
constexpr double longest_reach_m = 0.16;  // farther from the point the mirror would leave the picture
constexpr double table_half_m = 0.17;     // the part of the table that the sweep covers
constexpr double lowest_z = 0.08;         // of the spiral's directions: below it the table is in the way

Eigen::Matrix3d facing(const Vector3d& normal, double roll_rad) {
  const Vector3d y = normal.cross(Vector3d::UnitX()).normalized();  // the upper edge stays level, as hands hold it
  Eigen::Matrix3d rotation;
  rotation << y.cross(normal), y, normal;
  return rotation * Eigen::AngleAxisd(roll_rad, Vector3d::UnitZ()).toRotationMatrix();
}

double height_below_centre(const Eigen::Matrix3d& rotation, const Eigen::Vector2d& half_size) {
  return std::abs(rotation(2, 0)) * half_size.x() + std::abs(rotation(2, 1)) * half_size.y();
}

// Saff & Kuijlaars 1997: points of equal area along a spiral, here over the upper hemisphere.
std::vector<Vector3d> spiral(int count) {
  std::vector<Vector3d> directions;
  double azimuth = 0;
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (1 - lowest_z) * (i + 0.5) / count;
    const double r = std::sqrt(1 - z * z);
    azimuth += 3.6 / std::sqrt(2.0 * count) / r;
    directions.emplace_back(r * std::cos(azimuth), r * std::sin(azimuth), z);
  }
  return directions;
}

// Rows back and forth over the square [−1, 1]².
std::vector<Eigen::Vector2d> rows(int count) {
  std::vector<Eigen::Vector2d> points;
  const int row_count = std::max(1, static_cast<int>(std::lround(std::sqrt(count))));
  for (int i = 0; i < count; ++i) {
    const double s = (i + 0.5) / count * row_count;
    const int row = std::min(row_count - 1, static_cast<int>(s));
    const double along = 2 * (s - row) - 1;
    points.emplace_back(row % 2 == 0 ? along : -along, 2 * (row + 0.5) / row_count - 1);
  }
  return points;
}

}  // namespace

Rigid3 mirror_pose(const MotionInput& input, const Vector3d& p, const Vector3d& direction, double roll_rad) {
  // The mirror's place depends on its tilt (it must clear the table) and its tilt on its place: a few rounds settle it.
  Vector3d centre = p + 0.15 * direction;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  for (int i = 0; i < 8; ++i) {
    const Vector3d to_camera = (input.camera_in_world - centre).normalized();
    rotation = facing((direction + to_camera).normalized(), roll_rad);
    const double height = clearance_m + height_below_centre(rotation, input.plate_half_size_m);
    centre = p + std::min(height / direction.z(), longest_reach_m) * direction;
    centre.z() = height;
  }
  return {Eigen::Quaterniond(rotation), centre};
}

std::vector<Rigid3> wave_mirror(const MotionInput& input, int frames, std::uint64_t seed) {
  const int sweep_count = frames * 2 / 5;
  Random random(mix(seed, 0x4d6f7665));
  const auto tremor = [&](double amplitude) { return amplitude * (2 * static_cast<double>(random.uniform()) - 1); };
  std::vector<Rigid3> poses;
  int i = 0;
  for (const Vector3d& direction : spiral(frames - sweep_count)) {
    // The hand wanders over the table while it turns; the two rates share no period.
    const Vector3d p(0.06 * std::sin(0.83 * i) + tremor(0.02), 0.06 * std::sin(0.59 * i + 1) + tremor(0.02), 0);
    poses.push_back(mirror_pose(input, p, direction, tremor(0.06)));
    ++i;
  }
  for (const Eigen::Vector2d& at : rows(sweep_count)) {
    const Vector3d p(table_half_m * at.x() + tremor(0.01), table_half_m * at.y() + tremor(0.01), 0);
    poses.push_back(mirror_pose(input, p, (input.lamp_in_world - p).normalized(), tremor(0.06)));
  }
  return poses;
}

}  // namespace mf::sim
