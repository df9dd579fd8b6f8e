// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/distance_sweep.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

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
constexpr float doubt_votes = 8;        // a cost counts as if so many further votes of the pool had said doubt_stops
constexpr float doubt_stops = 0.25F;
constexpr float far_preference_stops = 0.05F;  // by which the nearest level must be better than the farthest
constexpr float pool_cells = 1.3F;             // σ over directions

// A level's votes for each direction: the sum of their distances from their median, and how many tell something, which
// the first does not.
constexpr int disagreement = 0, told = 1;

// Gaussian sums over directions, and what they say.
ImageF pooled_cost(const ImageF& votes, int level) {
  const int reach = static_cast<int>(std::ceil(3 * pool_cells));
  const float preference = far_preference_stops * static_cast<float>(level) / (level_count - 1);
  ImageF cost(votes.width, votes.height, 1);
  for (int y = 0; y < votes.height; ++y)
    for (int x = 0; x < votes.width; ++x) {
      float stops = doubt_votes * doubt_stops, count = doubt_votes;
      for (int ty = std::max(y - reach, 0); ty <= std::min(y + reach, votes.height - 1); ++ty)
        for (int tx = std::max(x - reach, 0); tx <= std::min(x + reach, votes.width - 1); ++tx) {
          const auto squared = static_cast<float>((tx - x) * (tx - x) + (ty - y) * (ty - y));
          const float w = std::exp(-0.5F * squared / (pool_cells * pool_cells));
          stops += w * votes.at(tx, ty, disagreement);
          count += w * votes.at(tx, ty, told);
        }
      cost.at(x, y) = stops / count + preference;
    }
  return cost;
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
  sweep.cost.assign(static_cast<std::size_t>(level_count), ImageF(map_size, map_size, 1));
  std::vector<ImageF> votes_of(static_cast<std::size_t>(level_count), ImageF(map_size, map_size, 2));
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
        if (votes.size() < 2) continue;
        const auto count = static_cast<float>(votes.size());
        ImageF& level_votes = votes_of[static_cast<std::size_t>(level)];
        level_votes.at(x, y, disagreement) = count * static_cast<float>(robust_spread(votes, occluded_stops));
        level_votes.at(x, y, told) = count - 1;
      }
  });
  for (ImageF& votes : votes_of) share_rows(team, votes);
  tbb::parallel_for(0, level_count, [&](int level) {
    const auto i = static_cast<std::size_t>(level);
    sweep.cost[i] = pooled_cost(votes_of[i], level);
  });
  return sweep;
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
