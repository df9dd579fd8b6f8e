// SPDX-License-Identifier: Apache-2.0
#include "host/render/light_set.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/check.h"

namespace mf {

namespace {

constexpr double golden_angle = 2.399963229728653;  // π (3 − √5)

// How often to halve the fan of each group's triangles (see split_cell), or −1: not at all.
std::vector<int> splits_by_group(std::span<const CellGroup> groups, const ImportanceOptions& options) {
  constexpr double fan = 6;  // triangles of a usual cell
  double total = 0;
  for (const CellGroup& group : groups) total += group.light;
  std::vector<int> splits(groups.size(), -1);
  for (std::size_t i = 0; i < groups.size(); ++i) {
    if (groups[i].cells.size() > 1) continue;  // wide, and dim for that
    const double parts = std::min<double>(options.extra_directions * groups[i].light / total, options.most_per_cell);
    if (parts >= 2) splits[i] = std::max(0, static_cast<int>(std::lround(std::log2(parts / fan))));
  }
  return splits;
}

// The light of each image for the plane: Σ ω_z ΔΩ over the lights that show it.
std::vector<float> weights_on_plane(const LightSet& set) {
  std::vector<float> weights(set.images.size(), 0);
  for (const DirectionalLight& light : set.lights)
    weights[light.image] += std::max(0.F, light.direction.z()) * light.solid_angle_sr;
  return weights;
}

// Over the images of all parallel lights, as fine as the finest of them; but of no more than 64 texels a side, or as
// many as one of them has.
PlaneTile empty_tile_over(const LightSet& set) {
  constexpr float beyond = std::numeric_limits<float>::max();
  Eigen::Vector2f low = Eigen::Vector2f::Constant(beyond), high = -low;
  Eigen::Vector2f texel = Eigen::Vector2f::Constant(beyond), most = Eigen::Vector2f::Constant(64);
  for (const DirectionalLight& light : set.lights) {
    const PlaneImage& image = set.images[light.image];
    const Eigen::Vector2f texels(static_cast<float>(image.width), static_cast<float>(image.height));
    low = low.cwiseMin(image.min_m);
    high = high.cwiseMax(image.max_m);
    texel = texel.cwiseMin((image.max_m - image.min_m).cwiseQuotient(texels));
    most = most.cwiseMax(texels);
  }
  const Eigen::Vector2f texels = (high - low).cwiseQuotient(texel).cwiseMin(most);
  return black_tile(low, high, static_cast<int>(std::lround(texels.x())), static_cast<int>(std::lround(texels.y())));
}

bool same_grid(const PlaneImage& a, const PlaneImage& b) {
  return a.width == b.width && a.height == b.height && a.min_m == b.min_m && a.max_m == b.max_m;
}

}  // namespace

std::optional<std::string> ImportanceOptions::validate() const {
  if (extra_directions < 0 || extra_directions > 100000) return "extra_directions must lie between 0 and 100000";
  if (most_per_cell < 1 || most_per_cell > 1024) return "most_per_cell must lie between 1 and 1024";
  if (emitter_points < 1 || emitter_points > 1024) return "emitter_points must lie between 1 and 1024";
  return std::nullopt;
}

LightSet make_light_set(const DirectionSet& directions, std::span<const CellGroup> groups,
                        std::vector<PlaneImage> images, const ImportanceOptions& options) {
  check(!options.validate() && images.size() == groups.size(), "valid importance options, and an image for each group");
  LightSet set;
  set.images = std::move(images);
  const std::vector<int> splits = splits_by_group(groups, options);
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const auto image = static_cast<std::uint32_t>(i);
    if (splits[i] < 0) {
      set.lights.push_back({groups[i].direction, groups[i].solid_angle_sr, image});
      continue;
    }
    for (const CellSample& part : split_cell(directions, groups[i].cells.front(), splits[i]))
      set.lights.push_back({part.direction, part.solid_angle_sr, image});
  }
  return set;
}

LightSet make_light_set(const LightField& field, const ImportanceOptions& options) {
  std::vector<PlaneImage> images = images_of(field);
  const std::vector<double> light = light_of_tiles(field.directions, images);
  const auto all = static_cast<int>(field.directions.size());
  return make_light_set(field.directions, group_cells(field.directions, light, all), std::move(images), options);
}

PlaneTile bare_irradiance(const LightSet& set) {
  if (set.lights.empty()) return {};
  PlaneTile sum = empty_tile_over(set);
  const std::vector<float> weights = weights_on_plane(set);
  tbb::parallel_for(0, sum.height, [&](int y) {
    Eigen::Vector4f* row = sum.texels.data() + static_cast<std::ptrdiff_t>(y) * sum.width;
    for (std::size_t i = 0; i < set.images.size(); ++i) {
      if (weights[i] == 0) continue;
      const PlaneImage& image = set.images[i];
      const bool same = same_grid(image, sum.image());
      const Eigen::Vector4f* same_row = image.texels + static_cast<std::ptrdiff_t>(y) * sum.width;
      for (int x = 0; x < sum.width; ++x)
        row[x] += weights[i] * (same ? same_row[x] : sample(image, sum.position(x, y)));
    }
  });
  return sum;
}

Eigen::Vector3f emitted_irradiance(const LightSet& set, const Eigen::Vector2f& p) {
  const Eigen::Vector3f x(p.x(), p.y(), 0);
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (const EmitterPoint& point : set.emitter_points) {
    const float cosine = std::max(0.F, (point.position - x).normalized().z());
    sum += cosine * point.solid_angle_from(x) * sample(set.images[point.image], p).head<3>();
  }
  return sum;
}

void append_ground_light(LightSet& set, const PlaneImage& outgoing_radiance, int count) {
  check(count > 0, "some directions");
  const auto image = static_cast<std::uint32_t>(set.images.size());
  set.images.push_back(outgoing_radiance);
  const float solid_angle = 2 * std::numbers::pi_v<float> / static_cast<float>(count);
  for (int k = 0; k < count; ++k) {  // equal areas: z uniform (Archimedes), azimuth by the golden angle
    const float z = -(static_cast<float>(k) + 0.5F) / static_cast<float>(count);
    const float r = std::sqrt(1 - z * z);
    const auto angle = static_cast<float>(k * golden_angle);
    set.lights.push_back({{r * std::cos(angle), r * std::sin(angle), z}, solid_angle, image});
  }
}

}  // namespace mf
