// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <vector>

#include "common/image.h"

namespace mf::sim {

// Distant surroundings from an HDR panorama: lat-long, linear BT.709, top +Z, centre +Y, a quarter to the left −X
// (world).
class EnvironmentMap {
 public:
  // Three channels, twice as wide as high; no negative and no infinite values.
  explicit EnvironmentMap(ImageF panorama);

  // Radiance from a direction (unit length, towards the surroundings): between pixels, linear.
  [[nodiscard]] Eigen::Array3f radiance(const Eigen::Vector3f& direction) const;

  // A direction drawn by what arrives from it: pixels by luminance times solid angle, evenly within one.
  struct Drawn {
    Eigen::Vector3f direction;
    Eigen::Array3f radiance;
    float density;  // per steradian
  };
  [[nodiscard]] Drawn draw(const Eigen::Vector2f& u) const;  // u in [0, 1)²

 private:
  [[nodiscard]] Eigen::Array3f pixel(int x, int y) const;
  [[nodiscard]] double solid_angle(int y) const;
  [[nodiscard]] Eigen::Vector3f direction_at(float x, float y) const;

  ImageF panorama_;
  std::vector<double> sums_;  // of luminance × solid angle, up to and with each pixel
};

// An OpenEXR panorama. Throws InputError naming the file: it cannot be read, is not twice as wide as high, or holds
// negative or infinite values.
[[nodiscard]] EnvironmentMap read_environment_map(const std::filesystem::path&);

}  // namespace mf::sim
