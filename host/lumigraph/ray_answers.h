// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "host/blending/ray_penalty.h"
#include "host/io/view.h"
#include "host/lumigraph/source_sight.h"

namespace mf {

inline constexpr std::size_t largest_bundle = 64;  // rays
inline constexpr std::size_t ray_lanes = 8;        // rays that are handled side by side: bundles of a multiple are fast

// Cosines between normal and ray count as at least this: a patch seen edge-on covers no pixels, and where normals are
// interpolated or noisy that says nothing about resolution.
inline constexpr float edge_on_cosine = 0.05F;

// Rays of the new view and the proxy points that they meet, by coordinate. A ray's direction has length 1 along the new
// view's optical axis, so that `depth` is both its length's factor and the point's depth:  X = E + depth · d.
struct RayBundle {                    // at most largest_bundle rays
  std::span<const float> dx, dy, dz;  // world
  std::span<const float> depth;       // finite
  std::span<const float> nx, ny, nz;  // the proxy's normal at X, unit length, either side
  float focal2 = 1;                   // fx · fy, px², of the new view, or of the finest photo if that is less
  float beyond = 0;                   // octaves by which the new view is finer than that
};

// Where its values begin: loops over plain pointers are vectorized.
struct FirstRay {
  const float *dx, *dy, *dz, *depth, *nx, *ny, *nz;
};
[[nodiscard]] inline FirstRay first_of(const RayBundle& rays) {
  return {rays.dx.data(), rays.dy.data(), rays.dz.data(), rays.depth.data(),
          rays.nx.data(), rays.ny.data(), rays.nz.data()};
}

// What of a photo stays the same from view to view.
struct AnsweringCamera {
  float fx = 1, fy = 1, cx = 0, cy = 0;
  std::array<float, 5> distortion{};  // k1 k2 p1 p2 k3
  bool distorted = false;
  float width = 0, height = 0;
  // The picture's limits in normalized coordinates, with a little to spare where the camera distorts. Beyond largest_r2
  // the distortion's model folds back into the picture.
  float left = 0, right = 0, top = 0, bottom = 0;
  float largest_r2 = 0;
  float stretch = 1;  // by at most so much distortion lengthens a step up to there
};
[[nodiscard]] AnsweringCamera answering_camera(const CameraModel&);

// Normalized coordinates as the photo has them.
struct Distorted {
  float x = 0, y = 0;
};
[[nodiscard]] inline Distorted distorted(const AnsweringCamera& c, float x, float y) {
  const auto& d = c.distortion;
  const float r2 = x * x + y * y;
  const float radial = 1 + r2 * (d[0] + r2 * (d[1] + r2 * d[4]));
  return {x * radial + 2 * d[2] * x * y + d[3] * (r2 + 2 * x * x),
          y * radial + d[2] * (r2 + 2 * y * y) + 2 * d[3] * x * y};
}

// A photo as the rays of one new view see it: single precision suffices because everything is relative to E.
struct AnsweringView {
  AnsweringCamera camera;
  std::array<float, 9> cam_from_world{};   // rotation, by rows
  std::array<float, 3> eye_in_cam{};       // E in the photo's frame
  std::array<float, 3> eye_from_centre{};  // E − C, world
  float per_border_px = 1;                 // 1 / width of the soft border
  float time_penalty = 0;              // ≥ 0, before it is divided by the weight: taken at another time, see Moment
  const SourceSight* sight = nullptr;  // none: the photo shows whatever lies in its picture
};

// `border` is the soft border's width as a fraction of the photo's shorter side.
[[nodiscard]] AnsweringView answering_view(const AnsweringCamera&, const Rigid3& cam_from_world, const SourceSight&,
                                           const Eigen::Vector3d& eye, float border);

// How one photo answers for each ray of a bundle.
struct RayAnswers {
  std::span<float> x, y;     // photo pixels
  std::span<float> lod;      // level of the photo's pyramid whose bilinear fetch blurs as a wanted pixel does, ≥ 0
  std::span<float> weight;   // 0…1: soft border times sight, see RayTerms; 0: it says nothing
  std::span<float> penalty;  // infinite where it says nothing
};

//   angle       the chord |u − v| of the unit vectors from X to E and to C: 2 sin(θ/2), exact where it counts, at 0
//   resolution  octaves, from the areas that a patch of the proxy covers in both pictures: f² |n·(X−C)| / z³. What the
//               new view has beyond the finest photo (RayBundle) no photo can give, and none is blamed for
//   weight      the soft border, times what the photo sees of X (SourceSight)
// Penalties below `worst` of their ray are told; of rays where none is, the weight may count as 0.
// Precondition: full lanes of rays, at most largest_bundle.
void answer(const AnsweringView&, const RayBundle&, const PenaltyOptions&, float depth_tolerance,
            std::span<const float> worst, const RayAnswers&);

// The k + 1 least penalties of each ray, in rising order, and which candidate has them. One ray a column.
struct LeastPenalties {
  std::span<float> penalty;           // (k + 1) rows
  std::span<std::int32_t> candidate;  // (k + 1) rows; −1: none
  std::size_t rays = 0;
  int k = 1;
};
void clear(const LeastPenalties&);
[[nodiscard]] inline std::span<const float> worst_of(const LeastPenalties& least) {
  return least.penalty.subspan(static_cast<std::size_t>(least.k) * least.rays, least.rays);
}
// `penalty` is of the rays from `first` on. Whether it is among any ray's best.
bool add_candidate(const LeastPenalties&, std::int32_t candidate, std::size_t first, std::span<const float> penalty);

// Of full lanes of penalties. `of_lanes`: the largest of each ray_lanes neighbours.
struct PenaltyRange {
  float least = 0;
  float largest = 0;
  std::array<float, largest_bundle / ray_lanes> of_lanes{};
};
[[nodiscard]] PenaltyRange range_of(std::span<const float> penalty);

// What each of the k best of a ray weighs, k rows: view_weights.h. Without candidates all are 0.
void ray_weights(const LeastPenalties&, float floor, std::span<float> weight);

}  // namespace mf
