// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/panorama.h"

#include <tbb/parallel_for.h>

#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include "host/blending/view_weights.h"
#include "host/light_field/view_rays.h"
#include "host/light_field/view_sieve.h"

namespace mf {

namespace {

// Of a panorama's texel: zenith in the first row, horizon in the last.
Eigen::Vector3f direction_of(int x, int y, const ImageF& panorama) {
  constexpr float pi = std::numbers::pi_v<float>;
  const float zenith = (static_cast<float>(y) + 0.5F) / static_cast<float>(panorama.height) * 0.5F * pi;
  const float azimuth = (static_cast<float>(x) + 0.5F) / static_cast<float>(panorama.width) * 2 * pi;
  return {std::sin(zenith) * std::cos(azimuth), std::sin(zenith) * std::sin(azimuth), std::cos(zenith)};
}

// Texels of a panorama that `is_hole`, from their rim inwards: each the mean of its neighbours that are known.
template <typename IsHole>
void fill_from_around(ImageF& panorama, const IsHole& is_hole) {
  std::vector<Eigen::Vector2i> holes;
  for (int y = 0; y < panorama.height; ++y)
    for (int x = 0; x < panorama.width; ++x)
      if (is_hole(x, y)) holes.emplace_back(x, y);
  for (bool again = true; again && !holes.empty();) {
    again = false;
    const ImageF known = panorama;
    std::erase_if(holes, [&](const Eigen::Vector2i& hole) {
      Eigen::Vector4f sum = Eigen::Vector4f::Zero();
      int count = 0;
      for (int i = 0; i < 9; ++i) {
        const int x = (hole.x() + i % 3 - 1 + known.width) % known.width, y = hole.y() + i / 3 - 1;
        if (y < 0 || y >= known.height || known.at(x, y, 3) <= 0) continue;
        sum += Eigen::Vector4f(known.at(x, y, 0), known.at(x, y, 1), known.at(x, y, 2), known.at(x, y, 3));
        ++count;
      }
      if (count == 0) return false;
      for (int c = 0; c < 4; ++c) panorama.at(hole.x(), hole.y(), c) = sum[c] / static_cast<float>(count);
      again = true;
      return true;
    });
  }
}

}  // namespace

ImageF make_panorama(const std::vector<FieldView>& views, const Surroundings& surroundings,
                     const EmitterBlender& emitters, int width, const Team& team) {
  constexpr int k = 4;  // few: every further view blurs what the distance gets wrong
  const int height = width / 4;
  const float texel_rad = 2 * std::numbers::pi_v<float> / static_cast<float>(width);
  ImageF panorama(width, height, 4);
  std::vector<std::uint32_t> all_views(views.size());
  std::iota(all_views.begin(), all_views.end(), 0U);
  const ViewSieve sieve(views);
  tbb::parallel_for(0, height, [&](int y) {
    if (!team.has(static_cast<std::size_t>(y))) return;
    std::vector<ViewPenalty> ranked;
    std::vector<std::uint32_t> lookers;
    std::array<ViewWeight, k> weights;
    for (int x = 0; x < width; ++x) {
      const Eigen::Vector3f d = direction_of(x, y, panorama);
      const ProxyPoint point = proxy_point(surroundings.centre_in_world, d, surroundings.inverse_distance_of(d));
      const auto look = [&](const FieldView& view) -> Eigen::Vector4f {
        const Eigen::Vector3f pixel = pixel_of(view, point);
        if (pixel.z() <= 0) return Eigen::Vector4f::Zero();
        return view.fetch(level_for_angle(view, point, texel_rad), pixel.x() / pixel.z(), pixel.y() / pixel.z());
      };
      if (emitters.concerns(surroundings.centre_in_world, d, texel_rad)) {
        // An emitter, and what stands before it, looks different from every point: the field keeps it by itself.
        if (emitter_met(emitters.emitters(), surroundings.centre_in_world, d) != nullptr) continue;
        const Eigen::Vector4f seen = emitters.radiance(nullptr, surroundings.centre_in_world, d, texel_rad, all_views);
        for (int c = 0; c < 4; ++c) panorama.at(x, y, c) = seen[c];
        continue;
      }
      ranked.clear();
      sieve.find(point, texel_rad, lookers);
      for (const std::uint32_t v : lookers) {
        const float weight = look(views[v]).w();
        if (weight > 0.02F)
          ranked.push_back({v, ray_distance(surroundings.centre_in_world, point, views[v].centre_in_world) / weight});
      }
      const std::size_t speaking = blend_weights(ranked, k, 1e-3F, weights);
      Eigen::Vector4f sum = Eigen::Vector4f::Zero();
      for (std::size_t i = 0; i < speaking; ++i) {
        const Eigen::Vector4f seen = look(views[weights[i].view]);
        sum += weights[i].weight / seen.w() * Eigen::Vector4f(seen.x(), seen.y(), seen.z(), seen.w());
      }
      for (int c = 0; c < 4; ++c) panorama.at(x, y, c) = sum[c];
    }
  });
  share_rows(team, panorama);
  fill_from_around(panorama, [&](int x, int y) {
    const Eigen::Vector3f d = direction_of(x, y, panorama);
    return panorama.at(x, y, 3) <= 0 && emitters.concerns(surroundings.centre_in_world, d, texel_rad);
  });
  return panorama;
}

}  // namespace mf
