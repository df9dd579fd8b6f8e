// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/occluder_mask.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "host/light_field/view_rays.h"
#include "host/light_field/view_sieve.h"

namespace mf {

namespace {

constexpr int mask_side = 192;
constexpr int sweep_side = 64;  // texels of the map of distances
constexpr int window = 3;       // its texels to each side that decide together
constexpr float nearest_share = 0.15F;
constexpr float share_step = 0.025F;
constexpr std::size_t shares = 30;     // up to 0.875
constexpr float prior = 0.01F;         // variance that a distance must gain to be chosen a whole way off the usual one
constexpr float margin_m = 0.06F;      // rays to the emitter's rim pass the occluder beside its centre's shadow
constexpr float most = 1.5F;           // noise goes both ways: it must average out
constexpr float least_weight = 0.02F;  // a view that shows less of a point does not speak for it

// What views say of one point: 1 light passes, 0 none does.
struct Votes {
  float weight = 0, sum = 0, squares = 0;
  int count = 0;

  void add(float value, float w) {
    weight += w;
    sum += w * value;
    squares += w * value * value;
    ++count;
  }
  [[nodiscard]] float mean() const { return std::min(sum / weight, 1.0F); }
  [[nodiscard]] float variance() const {  // without the bias of few votes
    const float m = sum / weight;
    return std::max(squares / weight - m * m, 0.0F) * static_cast<float>(count) / static_cast<float>(count - 1);
  }
};

struct Witnesses {
  const std::vector<FieldView>& views;
  ViewSieve sieve;
};

Votes ask(const Witnesses& witnesses, const ShadedEmitter& e, const Eigen::Vector3f& q, float angle) {
  Votes votes;
  const float full = std::max(e.radiance.sum(), 1e-6F);
  const ProxyPoint x = q.homogeneous();
  thread_local std::vector<std::uint32_t> lookers;  // called for every texel of many maps: no allocation each time
  witnesses.sieve.find(x, angle, lookers);
  for (const std::uint32_t v : lookers) {
    const FieldView& view = witnesses.views[v];
    if (!e.met_at(view.centre_in_world, ray_to(x, view.centre_in_world).normalized(), ShadedEmitter::well_inside))
      continue;
    const Eigen::Vector3f pixel = pixel_of(view, x);
    if (pixel.z() <= 0) continue;
    const Eigen::Vector4f seen =
        view.fetch(level_for_angle(view, x, angle), pixel.x() / pixel.z(), pixel.y() / pixel.z());
    if (seen.w() >= least_weight) votes.add(std::min(seen.head<3>().sum() / full / seen.w(), most), seen.w());
  }
  return votes;
}

Eigen::Vector2f mask_position(const ShadedEmitter& e, int side, int x, int y) {
  const Eigen::Vector2f texel = (e.mask_max_m - e.mask_min_m) / static_cast<float>(side);
  return {e.mask_min_m.x() + (static_cast<float>(x) + 0.5F) * texel.x(),
          e.mask_max_m.y() - (static_cast<float>(y) + 0.5F) * texel.y()};
}

// Sum over a window of the two channels, along one axis.
ImageF window_sums_along(const ImageF& in, int dx, int dy) {
  ImageF out(in.width, in.height, in.channels);
  for (int y = 0; y < in.height; ++y)
    for (int x = 0; x < in.width; ++x)
      for (int i = -window; i <= window; ++i) {
        const int u = x + i * dx, v = y + i * dy;
        if (u < 0 || v < 0 || u >= in.width || v >= in.height) continue;
        for (int c = 0; c < in.channels; ++c) out.at(x, y, c) += in.at(u, v, c);
      }
  return out;
}
ImageF window_sums(const ImageF& in) {
  return window_sums_along(window_sums_along(in, 1, 0), 0, 1);
}

// Variance and how many texels know it, for one distance everywhere; not summed yet.
ImageF disagreement(const Witnesses& witnesses, const ShadedEmitter& e, float share, const Team& team) {
  ImageF out(sweep_side, sweep_side, 2);
  const float angle = (e.mask_max_m - e.mask_min_m).mean() / sweep_side * (1 - share);
  tbb::parallel_for(0, sweep_side, [&](int y) {
    if (!team.has(static_cast<std::size_t>(y))) return;
    for (int x = 0; x < sweep_side; ++x) {
      const Votes votes = ask(witnesses, e, e.occluder_point(mask_position(e, sweep_side, x, y), share), angle);
      constexpr int enough = 4;
      if (votes.count < enough) continue;
      out.at(x, y, 0) = votes.variance();
      out.at(x, y, 1) = 1;
    }
  });
  share_rows(team, out);
  return out;
}

float share_of(std::size_t i) {
  return nearest_share + share_step * static_cast<float>(i);
}

// The distance at which views disagree least over the whole mask.
std::size_t usual_share(const std::vector<ImageF>& sweep) {
  const auto cost = [](const ImageF& disagreement) {
    float variance = 0, known = 1e-6F;
    for (std::size_t i = 0; i < disagreement.data.size(); i += 2) {
      variance += disagreement.data[i];
      known += disagreement.data[i + 1];
    }
    // Without any occluder nothing differs at any distance: then where most is known.
    constexpr float unknown = 0.005F;
    return variance / known + unknown * (1 - known / static_cast<float>(sweep_side * sweep_side));
  };
  return static_cast<std::size_t>(
      std::min_element(sweep.begin(), sweep.end(),
                       [&](const ImageF& a, const ImageF& b) { return cost(a) < cost(b); }) -
      sweep.begin());
}

// Share of the way from the plane to the emitter at which something may hide it, by line to the plane; one channel.
ImageF sweep_distances(const Witnesses& witnesses, const Team& team, ShadedEmitter& e) {
  std::vector<ImageF> sweep;
  for (std::size_t i = 0; i < shares; ++i) sweep.push_back(disagreement(witnesses, e, share_of(i), team));
  const std::size_t usual = usual_share(sweep);
  e.occluder_share = share_of(usual);
  std::vector<ImageF> sums;
  sums.reserve(shares);
  for (const ImageF& one : sweep) sums.push_back(window_sums(one));
  ImageF best(sweep_side, sweep_side, 1, e.occluder_share);
  for (int y = 0; y < sweep_side; ++y)
    for (int x = 0; x < sweep_side; ++x) {
      if (sums[usual].at(x, y, 1) < window) continue;  // hardly seen: what few views say of it decides nothing
      float least = INFINITY;
      for (std::size_t i = 0; i < shares; ++i) {
        const float known = sums[i].at(x, y, 1);
        if (known < window) continue;
        const float cost = sums[i].at(x, y, 0) / known + prior * std::abs(share_of(i) - e.occluder_share);
        if (cost >= least) continue;
        least = cost;
        best.at(x, y) = share_of(i);
      }
    }
  const ImageF summed = window_sums(best), counts = window_sums(ImageF(sweep_side, sweep_side, 1, 1.0F));
  for (std::size_t i = 0; i < best.data.size(); ++i) best.data[i] = summed.data[i] / counts.data[i];
  return best;
}

// Where no view looked, what the nearest texels that are known say, ring by ring.
void guess_the_rest(ImageF& mask) {
  constexpr float of_a_guess = 1e-4F;  // below any weight that a view gives: beside what is known, a guess says nothing
  std::vector<std::array<int, 2>> unknown;
  for (int y = 0; y < mask.height; ++y)
    for (int x = 0; x < mask.width; ++x)
      if (mask.at(x, y, 1) <= 0) unknown.push_back({x, y});
  while (!unknown.empty() && unknown.size() < static_cast<std::size_t>(mask.width * mask.height)) {
    const ImageF before = mask;
    std::erase_if(unknown, [&](const std::array<int, 2>& at) {
      float sum = 0, known = 0;
      for (int i = 0; i < 9; ++i) {
        const int x = std::clamp(at[0] + i % 3 - 1, 0, mask.width - 1);
        const int y = std::clamp(at[1] + i / 3 - 1, 0, mask.height - 1);
        if (before.at(x, y, 1) <= 0) continue;
        sum += before.at(x, y, 0);
        ++known;
      }
      if (known == 0) return false;
      mask.at(at[0], at[1], 0) = sum / known;
      mask.at(at[0], at[1], 1) = of_a_guess;
      return true;
    });
  }
}

}  // namespace

void draw_occluders(const std::vector<FieldView>& views, const PlaneRectangle& rectangle, const Team& team,
                    ShadedEmitter& e) {
  const auto corner = [&](const Eigen::Vector2d& p) -> Eigen::Vector2f {
    return (rectangle.world_from_plane * Eigen::Vector3d(p.x(), p.y(), 0)).head<2>().cast<float>();
  };
  e.mask_min_m = corner(rectangle.min_m).array() - margin_m;
  e.mask_max_m = corner(rectangle.max_m).array() + margin_m;
  const Witnesses witnesses{views, ViewSieve(views)};
  const ImageF distances = sweep_distances(witnesses, team, e);
  e.mask = ImageF(mask_side, mask_side, 3);
  const float texel_m = (e.mask_max_m - e.mask_min_m).mean() / mask_side;
  tbb::parallel_for(0, mask_side, [&](int y) {
    if (!team.has(static_cast<std::size_t>(y))) return;
    for (int x = 0; x < mask_side; ++x) {
      const float share = distances.at(x * sweep_side / mask_side, y * sweep_side / mask_side);
      const Votes votes =
          ask(witnesses, e, e.occluder_point(mask_position(e, mask_side, x, y), share), texel_m * (1 - share));
      e.mask.at(x, y, 2) = share;
      if (votes.weight <= 0) continue;
      e.mask.at(x, y, 0) = votes.mean();
      e.mask.at(x, y, 1) = std::min(votes.weight, 1.0F);
    }
  });
  share_rows(team, e.mask);
  guess_the_rest(e.mask);
}

}  // namespace mf
