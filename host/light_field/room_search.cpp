// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/room_search.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace mf {

namespace {

constexpr int side_count = 5;    // −x, −y, +x, +y, ceiling
constexpr int side_levels = 48;  // tried positions of a side
constexpr int most_rounds = 12;

using Sides = std::array<float, side_count>;  // inverse distances from the centre, 0: no wall

RoomBox box_of(const Sides& sides, const Eigen::Vector3f& centre) {
  RoomBox box;
  box.low = {centre.x() - 1 / sides[0], centre.y() - 1 / sides[1]};
  box.high = {centre.x() + 1 / sides[2], centre.y() + 1 / sides[3]};
  box.ceiling = centre.z() + 1 / sides[4];
  return box;
}

// A direction of the sweep, and its cosine to each side's normal.
struct Ray {
  int x = 0, y = 0;
  Sides towards{};
};

std::vector<Ray> rays_of(const DistanceSweep& sweep) {
  std::vector<Ray> rays;
  for (int y = 0; y < sweep.side(); ++y)
    for (int x = 0; x < sweep.side(); ++x) {
      const Eigen::Vector2f disc(2 * (static_cast<float>(x) + 0.5F) / static_cast<float>(sweep.side()) - 1,
                                 2 * (static_cast<float>(y) + 0.5F) / static_cast<float>(sweep.side()) - 1);
      if (disc.norm() >= 1) continue;
      const Eigen::Vector3f d = sweep.direction(x, y);
      rays.push_back({x, y, {-d.x(), -d.y(), d.x(), d.y(), d.z()}});
    }
  return rays;
}

double mean_cost(const DistanceSweep& sweep, const std::vector<Ray>& rays, const Sides& sides) {
  double sum = 0;
  for (const Ray& ray : rays) {
    float inverse = 0;
    for (std::size_t i = 0; i < sides.size(); ++i) inverse = std::max(inverse, sides[i] * ray.towards[i]);
    sum += static_cast<double>(sweep.cost_at(ray.x, ray.y, inverse));
  }
  return sum / static_cast<double>(rays.size());
}

struct Try {
  Sides sides{};
  double cost = 0;
};

// One side after the other at its best, until none moves.
Try descend(const DistanceSweep& sweep, const std::vector<Ray>& rays, Sides sides) {
  const float step = sweep.level_step * static_cast<float>(sweep.levels() - 1) / side_levels;
  Try best{sides, mean_cost(sweep, rays, sides)};
  for (int round = 0; round < most_rounds; ++round) {
    const double before = best.cost;
    for (std::size_t i = 0; i < sides.size(); ++i)
      for (int level = 0; level < side_levels; ++level) {
        Sides moved = best.sides;
        moved[i] = static_cast<float>(level) * step;
        const double cost = mean_cost(sweep, rays, moved);
        if (cost < best.cost) best = {moved, cost};
      }
    if (!(best.cost < before)) break;
  }
  return best;
}

}  // namespace

RoomBox fit_room(const DistanceSweep& sweep) {
  const std::vector<Ray> rays = rays_of(sweep);
  constexpr std::array<float, 6> shares{0, 0.08F, 0.16F, 0.25F, 0.4F, 0.6F};  // of the sweep's nearest, inverted
  std::array<Try, shares.size()> tries;
  tbb::parallel_for(std::size_t{0}, shares.size(), [&](std::size_t i) {
    Sides cube;
    cube.fill(shares[i] * sweep.level_step * static_cast<float>(sweep.levels() - 1));
    tries[i] = descend(sweep, rays, cube);
  });
  const auto best =
      std::min_element(tries.begin(), tries.end(), [](const Try& a, const Try& b) { return a.cost < b.cost; });
  return box_of(best->sides, sweep.centre_in_world);
}

}  // namespace mf
