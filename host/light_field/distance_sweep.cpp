// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/distance_sweep.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "host/light_field/view_sieve.h"

namespace mf {

namespace {

constexpr float voting_weight = 0.5F;      // views nearer to their border than this do not vote
constexpr float darkest_radiance = 1e-4F;  // below, the logarithm only magnifies noise

constexpr int map_size = 96;           // cells along the equal-area square: about 1.5° each
constexpr int level_count = 28;        // inverse distances, evenly from 0
constexpr float nearest_share = 0.8F;  // of the rectangle's half diagonal: nothing nearer is looked for
constexpr float sweep_angle_rad = 0.015F;
constexpr float occluded_stops = 1.0F;  // a vote further off than this counts as this
constexpr std::size_t fewest_votes = 4;
constexpr float doubt_votes = 8;               // a cost counts as if so many further votes had said doubt_stops:
constexpr float doubt_stops = 0.6F;            // few views that happen to agree are no evidence
constexpr float far_preference_stops = 0.05F;  // by which the nearest level must be better than the farthest
constexpr float smoothing_cells = 1.3F;        // σ over directions

float cost_of(std::vector<float>& votes, int level) {
  const float n = static_cast<float>(votes.size()), spread = static_cast<float>(robust_spread(votes, occluded_stops));
  return (n * spread + doubt_votes * doubt_stops) / (n + doubt_votes) +
         far_preference_stops * static_cast<float>(level) / (level_count - 1);
}

// Gaussian over directions; cells without a cost are left out, and filled from their neighbours.
ImageF smoothed(const ImageF& cost) {
  const int reach = static_cast<int>(std::ceil(3 * smoothing_cells));
  ImageF out(cost.width, cost.height, 1, std::numeric_limits<float>::infinity());
  for (int y = 0; y < cost.height; ++y)
    for (int x = 0; x < cost.width; ++x) {
      float sum = 0, weights = 0;
      for (int dy = -reach; dy <= reach; ++dy)
        for (int dx = -reach; dx <= reach; ++dx) {
          const int tx = x + dx, ty = y + dy;
          if (tx < 0 || ty < 0 || tx >= cost.width || ty >= cost.height || !std::isfinite(cost.at(tx, ty))) continue;
          const float w = std::exp(-0.5F * static_cast<float>(dx * dx + dy * dy) / (smoothing_cells * smoothing_cells));
          sum += w * cost.at(tx, ty);
          weights += w;
        }
      if (weights > 0) out.at(x, y) = sum / weights;
    }
  return out;
}

}  // namespace

Eigen::Vector3f DistanceSweep::direction(int x, int y) const {
  return equal_area_direction(Eigen::Vector2f(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F) /
                              static_cast<float>(side()));
}

float DistanceSweep::cost_at(int x, int y, float inverse_distance) const {
  const float level = std::clamp(inverse_distance / level_step, 0.0F, static_cast<float>(levels() - 1));
  const auto below = static_cast<std::size_t>(level);
  const std::size_t above = std::min(below + 1, cost.size() - 1);
  const float f = level - static_cast<float>(below);
  return f > 0 ? cost[below].at(x, y) * (1 - f) + cost[above].at(x, y) * f : cost[below].at(x, y);
}

DistanceSweep sweep_surroundings(const std::vector<FieldView>& views, const PlaneRectangle& rectangle,
                                 const Team& team) {
  const float nearest_m = nearest_share * 0.5F * static_cast<float>(rectangle.size_m().norm());
  DistanceSweep sweep;
  sweep.centre_in_world = centre_of(rectangle);
  sweep.level_step = 1 / nearest_m / static_cast<float>(level_count - 1);
  sweep.cost.assign(static_cast<std::size_t>(level_count),
                    ImageF(map_size, map_size, 1, std::numeric_limits<float>::infinity()));
  const ViewSieve sieve(views);
  tbb::parallel_for(0, map_size, [&](int y) {
    if (!team.has(static_cast<std::size_t>(y))) return;
    std::vector<float> votes;
    std::vector<std::uint32_t> voters;
    for (int x = 0; x < map_size; ++x)
      for (int level = 0; level < level_count; ++level) {
        const ProxyPoint point =
            proxy_point(sweep.centre_in_world, sweep.direction(x, y), static_cast<float>(level) * sweep.level_step);
        votes.clear();
        sieve.find(point, sweep_angle_rad, voters);
        for (const std::uint32_t v : voters)
          if (const auto value = log_luminance(views[v], point, sweep_angle_rad)) votes.push_back(*value);
        if (votes.size() >= fewest_votes) sweep.cost[static_cast<std::size_t>(level)].at(x, y) = cost_of(votes, level);
      }
  });
  for (ImageF& level : sweep.cost) share_rows(team, level);
  tbb::parallel_for(std::size_t{0}, sweep.cost.size(),
                    [&](std::size_t level) { sweep.cost[level] = smoothed(sweep.cost[level]); });
  return sweep;
}

namespace {

// Penalties of semi-global matching, stops; and what a cell costs that too few views know.
constexpr float next_level_stops = 0.015F;
constexpr float any_level_stops = 0.06F;
constexpr float unknown_stops = doubt_stops;

// One path's costs at a cell, from those of the cell before it on the path.
void continue_path(std::span<const float> before, std::span<const float> own, std::span<float> path) {
  const float least = *std::min_element(before.begin(), before.end());
  for (std::size_t i = 0; i < own.size(); ++i) {
    float from = std::min(before[i], least + any_level_stops);
    if (i > 0) from = std::min(from, before[i - 1] + next_level_stops);
    if (i + 1 < own.size()) from = std::min(from, before[i + 1] + next_level_stops);
    path[i] = own[i] + from - least;
  }
}

}  // namespace

DistanceSweep regularized(const DistanceSweep& sweep) {
  const int side = sweep.side();
  const auto levels = static_cast<std::size_t>(sweep.levels());
  const auto cell = [&](int x, int y) { return static_cast<std::size_t>(y * side + x) * levels; };
  std::vector<float> own(static_cast<std::size_t>(side * side) * levels), sum(own.size(), 0.0F);
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x)
      for (std::size_t i = 0; i < levels; ++i) {
        const float cost = sweep.cost[i].at(x, y);
        own[cell(x, y) + i] = std::isfinite(cost) ? cost : unknown_stops;
      }
  constexpr std::array<std::array<int, 2>, 8> steps{
      {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, -1}, {1, -1}, {-1, 1}}};
  for (const auto& [dx, dy] : steps) {
    std::vector<float> path = own;
    for (int row = 0; row < side; ++row)
      for (int column = 0; column < side; ++column) {
        const int x = dx < 0 ? side - 1 - column : column, y = dy < 0 ? side - 1 - row : row;
        const int px = x - dx, py = y - dy;
        const std::size_t at = cell(x, y);
        if (px >= 0 && py >= 0 && px < side && py < side)
          continue_path({&path[cell(px, py)], levels}, {&own[at], levels}, {&path[at], levels});
        for (std::size_t i = 0; i < levels; ++i) sum[at + i] += path[at + i];
      }
  }
  DistanceSweep out = sweep;
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x)
      for (std::size_t i = 0; i < levels; ++i)
        out.cost[i].at(x, y) = sum[cell(x, y) + i] / static_cast<float>(steps.size());
  return out;
}

std::optional<float> log_luminance(const FieldView& view, const ProxyPoint& x, float angle_rad) {
  const Eigen::Vector3f pixel = pixel_of(view, x);
  if (pixel.z() <= 0) return std::nullopt;
  const Eigen::Vector4f seen =
      view.fetch(level_for_angle(view, x, angle_rad), pixel.x() / pixel.z(), pixel.y() / pixel.z());
  if (seen.w() < voting_weight) return std::nullopt;
  return std::log2(std::max(shown_luminance(seen), darkest_radiance));
}

double robust_spread(std::vector<float>& values, float limit) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  const float median = *middle;
  double sum = 0;
  for (const float v : values) sum += static_cast<double>(std::min(std::abs(v - median), limit));
  return sum / static_cast<double>(values.size());
}

Eigen::Vector3f centre_of(const PlaneRectangle& rectangle) {
  const Eigen::Vector2d middle = 0.5 * (rectangle.min_m + rectangle.max_m);
  return (rectangle.world_from_plane * Eigen::Vector3d(middle.x(), middle.y(), 0)).cast<float>();
}

}  // namespace mf
