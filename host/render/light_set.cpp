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

struct Tangents {
  Eigen::Vector3f u, v;
};
Tangents tangents(const Eigen::Vector3f& n) {
  const Eigen::Vector3f u = n.unitOrthogonal();
  return {u, n.cross(u)};
}

// The directions whose cells may touch that of `centre`: all within twice the cells' spacing.
std::vector<Eigen::Vector3f> neighbours(const DirectionSet& set, std::size_t centre, float radius) {
  std::vector<Eigen::Vector3f> near;
  const float least_cosine = std::cos(std::min(6 * radius, 3.F));
  for (std::size_t i = 0; i < set.size(); ++i)
    if (i != centre && set.directions[i].dot(set.directions[centre]) > least_cosine) near.push_back(set.directions[i]);
  return near;
}

// About `count` points spread evenly over the Voronoi cell of a direction, above the horizon: a sunflower pattern on a
// disc that is larger than the cell, less what is nearer to another direction. Never empty.
std::vector<Eigen::Vector3f> points_of_cell(const DirectionSet& set, std::size_t cell, int count) {
  const Eigen::Vector3f centre = set.directions[cell];
  const auto [u, v] = tangents(centre);
  const float radius = std::sqrt(set.solid_angles_sr[cell] / std::numbers::pi_v<float>);
  const std::vector<Eigen::Vector3f> others = neighbours(set, cell, radius);
  constexpr float reach = 1.5F;  // of the circle of the same area: holds the corners of five- and six-sided cells
  const int candidates = static_cast<int>(std::ceil(static_cast<float>(count) * reach * reach));
  std::vector<Eigen::Vector3f> points;
  for (int k = 0; k < candidates; ++k) {
    const float r = reach * radius * std::sqrt((static_cast<float>(k) + 0.5F) / static_cast<float>(candidates));
    const auto angle = static_cast<float>(k * golden_angle);
    const Eigen::Vector3f d = (centre + r * (std::cos(angle) * u + std::sin(angle) * v)).normalized();
    const float own = d.dot(centre);
    const bool inside = std::none_of(others.begin(), others.end(), [&](const auto& o) { return d.dot(o) > own; });
    if (inside && d.z() > 1e-3F) points.push_back(d);  // below 0.06° the plane point lies beyond any rectangle
  }
  if (points.empty()) points.push_back(centre);
  return points;
}

std::vector<int> points_per_cell(const LightField& field, const ImportanceOptions& options) {
  const std::vector<double> power = cell_power(field);
  const double total = std::accumulate(power.begin(), power.end(), 0.);
  std::vector<int> counts(power.size(), 1);
  if (!(total > 0)) return counts;
  for (std::size_t i = 0; i < power.size(); ++i)
    counts[i] = std::clamp(static_cast<int>(std::lround(options.extra_directions * power[i] / total)), 1,
                           options.most_per_cell);
  return counts;
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
  const std::vector<int> counts = points_per_cell(field, options);
  for (std::size_t i = 0; i < field.directions.size(); ++i) {
    set.images.push_back({min, max, field.resolution, field.resolution, field.tile(i)});
    const float solid_angle = field.directions.solid_angles_sr[i];
    if (counts[i] == 1) {
      set.lights.push_back({field.directions.directions[i], solid_angle, static_cast<std::uint32_t>(i)});
      continue;
    }
    const std::vector<Eigen::Vector3f> points = points_of_cell(field.directions, i, counts[i]);
    for (const Eigen::Vector3f& d : points)
      set.lights.push_back({d, solid_angle / static_cast<float>(points.size()), static_cast<std::uint32_t>(i)});
  }
  return set;
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

ImageF plane_irradiance(const LightField& field) {
  ImageF map(field.resolution, field.resolution, 3);
  for (std::size_t i = 0; i < field.directions.size(); ++i) {
    const Eigen::Vector4f* tile = field.tile(i);
    const float weight = field.directions.solid_angles_sr[i] * field.directions.directions[i].z();
    for (std::size_t t = 0; t < field.texel_count(); ++t)
      for (int c = 0; c < 3; ++c) map.data[3 * t + static_cast<std::size_t>(c)] += weight * tile[t][c];
  }
  return map;
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
