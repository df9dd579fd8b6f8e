// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "host/lumigraph/ray_answers.h"

namespace mf {

// What no ray of a region can undercut: photos are left out for many rays at once, and safely.
//
// Over a ball of radius r about M, with C a photo's centre and E the eye:
//
//   angle       the chord u − v of the unit vectors from X to E and C changes with X at a rate of at most
//               |1/|X−C| − 1/|X−E|| + |u − v| / max(|X−C|, |X−E|), so it is at least its value at M less r times that
//   resolution  the photo's cosine is at most the ray's and the chord, |n·v| ≤ |n·u| + |u − v|. It is also at most that
//               at M of the mean normal, and what normals and v differ by: |n·v| ≤ |m·v_M| + |n − m| + r / (|M−C| − r).
//               Its area f² |n·v| |X−C| / z³ is largest where z is least, z_M − r

// The weight is bounded over a rectangle of the photo: rays of a part of the new view, cut off at two depths, fill a
// frustum, which is convex, so that its picture lies between those of its eight corners. For photos near the eye it is
// no larger than the part, however slanted the surface is.

// Proxy points that rays of the new view meet, as a whole, and of the rays themselves what the bounds need.
struct RaysBox {
  Eigen::Array3f low = Eigen::Array3f::Constant(std::numeric_limits<float>::infinity());  // relative to E
  Eigen::Array3f high = Eigen::Array3f::Constant(-std::numeric_limits<float>::infinity());
  Eigen::Array3f low_normal = Eigen::Array3f::Constant(std::numeric_limits<float>::infinity());  // on the eye's side
  Eigen::Array3f high_normal = Eigen::Array3f::Constant(-std::numeric_limits<float>::infinity());
  float least_cosine = 1;  // of the angle between ray and normal
  // px² of the new view that a patch of 1 m² covers: across the ray, f² |X−E| / z³; and of the proxy, times its cosine.
  float least_area = std::numeric_limits<float>::infinity();
  float least_area_of_proxy = std::numeric_limits<float>::infinity();

  Eigen::Array3f least_in_cam = Eigen::Array3f::Constant(std::numeric_limits<float>::infinity());
  Eigen::Array3f largest_in_cam = Eigen::Array3f::Constant(-std::numeric_limits<float>::infinity());
  // x and y of the directions in the new view's camera, and depth

  [[nodiscard]] bool empty() const { return !(low.x() <= high.x()); }
  [[nodiscard]] Eigen::Vector3f centre() const { return (low + high) / 2; }
  [[nodiscard]] float radius() const {
    constexpr float rounding = 1e-6F;  // of the distance: what single precision loses of penalties, several times
    return (high - low).matrix().norm() / 2 + rounding * (low.abs().max(high.abs())).matrix().norm();
  }
  void extend(const RaysBox&);
};

// Precondition: full lanes of rays, see ray_lanes.
[[nodiscard]] RaysBox box_of(const RayBundle&, const Eigen::Matrix3f& world_from_cam);

// Of the frustum that the rays fill, relative to E.
struct RaysCorners {
  alignas(32) std::array<float, 8> x, y, z;
};
[[nodiscard]] RaysCorners corners_of(const RaysBox&, const Eigen::Matrix3f& world_from_cam);

// What the bounds need of many photos, by property, so that the loop over photos is vectorized.
class ViewTable {
 public:
  void clear();
  void add(std::uint32_t number, const AnsweringView&);
  void add(const ViewTable& from, std::size_t row);

  [[nodiscard]] std::size_t size() const { return number_.size(); }
  [[nodiscard]] std::span<const std::uint32_t> numbers() const { return number_; }

  // n · X + offset of all photos: X relative to E, n of unit length.
  enum Plane : std::size_t { right, left, bottom, top, depth, planes };  // beyond a side of the picture; the depth
  [[nodiscard]] const float* plane(Plane p, std::size_t coordinate) const { return column_[4 * p + coordinate].data(); }
  [[nodiscard]] const float* eye_from_centre(std::size_t coordinate) const {
    return column_[4 * planes + coordinate].data();
  }
  [[nodiscard]] const float* focal2() const { return column_[4 * planes + 3].data(); }
  [[nodiscard]] const float* time_penalty() const { return column_[4 * planes + 4].data(); }

 private:
  std::vector<std::uint32_t> number_;
  std::array<std::vector<float>, 4 * planes + 5> column_;
};

// For each photo of the table what no point of the box undercuts; infinite where none of them lies in its picture. The
// weight counts as 1: see largest_weight.
void least_penalties(const ViewTable&, const RaysBox&, const PenaltyOptions&, std::span<float> least);

// No point of the frustum gives the photo a larger weight (RayAnswers), so that its penalty is at least
// least_penalties' divided by this one to the γ.
[[nodiscard]] float largest_weight(const AnsweringView&, const RaysCorners&, float depth_tolerance);

}  // namespace mf
