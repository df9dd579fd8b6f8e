// SPDX-License-Identifier: Apache-2.0
#include "host/render/light_set.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "common/check.h"

namespace mf {

namespace {

constexpr double golden_angle = 2.399963229728653;  // π (3 − √5)

float luminance(const Eigen::Vector4f& rgb) {
  return 0.2126F * rgb[0] + 0.7152F * rgb[1] + 0.0722F * rgb[2];
}

// Mean over the tile of the light that each cell brings, any unit.
std::vector<double> cell_power(const LightField& field) {
  std::vector<double> power(field.directions.size());
  for (std::size_t i = 0; i < power.size(); ++i) {
    const Eigen::Vector4f* tile = field.tile(i);
    double sum = 0;
    for (std::size_t t = 0; t < field.texel_count(); ++t) sum += luminance(tile[t]);
    power[i] = std::max(0., sum) * field.directions.solid_angles_sr[i];
  }
  return power;
}

// How often to halve the fan of a cell's triangles (see split_cell), or −1: not at all.
std::vector<int> splits_per_cell(const LightField& field, const ImportanceOptions& options) {
  constexpr double fan = 6;  // triangles of a usual cell
  const std::vector<double> power = cell_power(field);
  const double total = std::accumulate(power.begin(), power.end(), 0.);
  std::vector<int> splits(power.size(), -1);
  if (!(total > 0)) return splits;
  for (std::size_t i = 0; i < power.size(); ++i) {
    const double parts = std::min<double>(options.extra_directions * power[i] / total, options.most_per_cell);
    if (parts >= 2) splits[i] = std::max(0, static_cast<int>(std::lround(std::log2(parts / fan))));
  }
  return splits;
}

}  // namespace

std::optional<std::string> ImportanceOptions::validate() const {
  if (extra_directions < 0 || extra_directions > 100000) return "extra_directions must lie between 0 and 100000";
  if (most_per_cell < 1 || most_per_cell > 1024) return "most_per_cell must lie between 1 and 1024";
  return std::nullopt;
}

LightSet make_light_set(const LightField& field, const ImportanceOptions& options) {
  check(!options.validate(), "valid importance options");
  LightSet set;
  const Eigen::Vector2f min = field.plane.min_m.cast<float>();
  const Eigen::Vector2f max = field.plane.max_m.cast<float>();
  const std::vector<int> splits = splits_per_cell(field, options);
  for (std::size_t i = 0; i < field.directions.size(); ++i) {
    const auto image = static_cast<std::uint32_t>(i);
    set.images.push_back({min, max, field.resolution, field.resolution, field.tile(i)});
    if (splits[i] < 0) {
      set.lights.push_back({field.directions.directions[i], field.directions.solid_angles_sr[i], image});
      continue;
    }
    for (const CellSample& part : split_cell(field.directions, i, splits[i]))
      set.lights.push_back({part.direction, part.solid_angle_sr, image});
  }
  return set;
}

LightField coarsened(const LightField& field, int directions) {
  const DirectionSet coarse = geodesic_hemisphere(directions);
  if (coarse.size() >= field.directions.size()) return field;
  const DirectionLocator locator(coarse);
  const std::vector<double> power = cell_power(field);
  LightField result;
  result.plane = field.plane;
  result.surroundings = field.surroundings;
  result.resolution = field.resolution;
  result.directions.directions.assign(coarse.size(), Eigen::Vector3f::Zero());
  result.directions.solid_angles_sr.assign(coarse.size(), 0);
  result.rgbc.assign(coarse.size() * field.texel_count(), Eigen::Vector4f::Zero());
  for (std::size_t i = 0; i < field.directions.size(); ++i) {
    const Eigen::Vector3f& d = field.directions.directions[i];
    const DirectionWeights w = locator.locate(d);
    const auto nearest = std::max_element(w.weight.begin(), w.weight.end()) - w.weight.begin();
    const std::uint32_t to = w.index[static_cast<std::size_t>(nearest)];
    const float solid_angle = field.directions.solid_angles_sr[i];
    // A trace of the solid angle gives a cell without light a direction too.
    result.directions.directions[to] += (static_cast<float>(power[i]) + 1e-6F * solid_angle) * d;
    result.directions.solid_angles_sr[to] += solid_angle;
    for (std::size_t t = 0; t < field.texel_count(); ++t) result.tile(to)[t] += solid_angle * field.tile(i)[t];
  }
  for (std::size_t i = 0; i < coarse.size(); ++i) {
    const float solid_angle = result.directions.solid_angles_sr[i];
    Eigen::Vector3f& d = result.directions.directions[i];
    d = solid_angle > 0 ? d.normalized() : coarse.directions[i];
    if (solid_angle > 0)
      for (std::size_t t = 0; t < field.texel_count(); ++t) result.tile(i)[t] /= solid_angle;
  }
  return result;
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

Eigen::Vector4f sample(const PlaneImage& image, const Eigen::Vector2f& p) {
  const auto coordinate = [](float fraction, int size) {
    return std::clamp(fraction * static_cast<float>(size) - 0.5F, 0.F, static_cast<float>(size - 1));
  };
  const Eigen::Vector2f size = image.max_m - image.min_m;
  const float x = coordinate((p.x() - image.min_m.x()) / size.x(), image.width);
  const float y = coordinate((image.max_m.y() - p.y()) / size.y(), image.height);
  const int x0 = std::min(static_cast<int>(x), std::max(0, image.width - 2));
  const int y0 = std::min(static_cast<int>(y), std::max(0, image.height - 2));
  const float fx = x - static_cast<float>(x0);
  const float fy = y - static_cast<float>(y0);
  const int step = image.width > 1 ? 1 : 0;
  const Eigen::Vector4f* row = image.texels + static_cast<std::ptrdiff_t>(y0) * image.width + x0;
  const Eigen::Vector4f* below = row + (image.height > 1 ? image.width : 0);
  return (1 - fy) * ((1 - fx) * row[0] + fx * row[step]) + fy * ((1 - fx) * below[0] + fx * below[step]);
}

}  // namespace mf
