// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/emitters.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <random>

#include "host/light_field/emitter_centre.h"
#include "host/light_field/emitter_outline.h"

namespace mf {

namespace {

constexpr int spot_level = 2;         // level in which spots are looked for: a few pixels, so that noise is no lamp
constexpr float uncut_weight = 0.9F;  // a spot that touches the border may be cut off
constexpr int proposals = 400;        // pairs of rays tried for one emitter
constexpr float least_parallax_rad = 0.02F;  // between two rays that propose a position

struct Spot {
  Eigen::Vector3f origin;
  Eigen::Vector3f direction;  // unit
  float radius_rad = 0;       // of a disc of its solid angle
};

float mean_luminance(const std::vector<FieldView>& views) {
  double sum = 0, weight = 0;
  for (const FieldView& view : views) {
    const Eigen::Vector4f all = view.levels.back().at(0, 0);
    sum += static_cast<double>(shown_luminance(all) * all.w());
    weight += static_cast<double>(all.w());
  }
  return weight > 0 ? static_cast<float>(sum / weight) : 0;
}

// World direction through a level-0 pixel.
Eigen::Vector3f ray_of(const FieldView& view, float u, float v) {
  const Eigen::Matrix3f turn = view.pixel_from_world.leftCols<3>();
  return (turn.inverse() * Eigen::Vector3f(u, v, 1)).normalized();
}

// A connected bright area of a view.
struct Area {
  Eigen::Vector2f weighted_sum = Eigen::Vector2f::Zero();
  float weight = 0;
  float luminance_sum = 0;
  float luminance_max = 0;
  bool cut = false;  // touches the view's border
};

Area flood(const PremultipliedImage& image, int x, int y, float threshold, std::vector<char>& visited) {
  Area area;
  std::vector<Eigen::Vector2i> open{{x, y}};
  visited[static_cast<std::size_t>(y * image.width() + x)] = 1;
  while (!open.empty()) {
    const Eigen::Vector2i at = open.back();
    open.pop_back();
    const Eigen::Vector4f& texel = image.at(at.x(), at.y());
    area.cut = area.cut || texel.w() < uncut_weight;
    // Above a few times the threshold all of a lamp counts alike: the centroid is of its shape, not of its glints.
    const float weight = std::min(shown_luminance(texel), 4 * threshold);
    area.weighted_sum += weight * (at.cast<float>().array() + 0.5F).matrix();
    area.weight += weight;
    area.luminance_sum += shown_luminance(texel);
    area.luminance_max = std::max(area.luminance_max, shown_luminance(texel));
    for (int side = 0; side < 4; ++side) {
      const Eigen::Vector2i step(side == 0 ? 1 : side == 1 ? -1 : 0, side == 2 ? 1 : side == 3 ? -1 : 0);
      const Eigen::Vector2i next = at + step;
      if ((next.array() < 0).any() || next.x() >= image.width() || next.y() >= image.height()) continue;
      char& seen = visited[static_cast<std::size_t>(next.y() * image.width() + next.x())];
      if (seen != 0 || shown_luminance(image.at(next.x(), next.y())) < threshold) continue;
      seen = 1;
      open.push_back(next);
    }
  }
  return area;
}

void collect_spots(const FieldView& view, float threshold, const EmitterOptions& options, std::vector<Spot>& spots) {
  if (view.levels.size() <= spot_level) return;
  const PremultipliedImage& image = view.levels[spot_level];
  constexpr float scale = 1 << spot_level;
  std::vector<char> visited(static_cast<std::size_t>(image.width()) * static_cast<std::size_t>(image.height()), 0);
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) {
      if (visited[static_cast<std::size_t>(y * image.width() + x)] != 0 || shown_luminance(image.at(x, y)) < threshold)
        continue;
      const Area area = flood(image, x, y, threshold, visited);
      const Eigen::Vector2f centre = area.weighted_sum / area.weight * scale;
      // Pixels at its edge hold only a part of it: the area is that of the same light at full brightness, which a small
      // lamp has only in the finest level.
      const float peak = std::max(area.luminance_max, shown_luminance(view.fetch(0, centre.x(), centre.y())));
      const float pixels = area.luminance_sum / peak;
      const Eigen::Vector3f ray = ray_of(view, centre.x(), centre.y());
      // A pixel's solid angle falls with the cube of the cosine to the axis.
      const float cosine = view.pixel_from_world.row(2).head<3>().dot(ray);
      const float radius =
          std::sqrt(pixels * cosine * cosine * cosine / std::numbers::pi_v<float>) * scale / view.focal_px;
      if (area.cut || 2 * radius > options.largest_angle_rad) continue;
      spots.push_back({view.centre_in_world, ray, radius});
    }
}

// The point nearest to all rays, each weighted by 1/distance² (so that angles count): a linear system, iterated.
std::optional<Eigen::Vector3f> nearest_point(const std::vector<const Spot*>& rays, const Eigen::Vector3f& start) {
  Eigen::Vector3f x = start;
  for (int iteration = 0; iteration < 3; ++iteration) {
    Eigen::Matrix3f a = Eigen::Matrix3f::Zero();
    Eigen::Vector3f b = Eigen::Vector3f::Zero();
    for (const Spot* ray : rays) {
      const float w = 1 / std::max((x - ray->origin).squaredNorm(), 1e-4F);
      const Eigen::Matrix3f across = Eigen::Matrix3f::Identity() - ray->direction * ray->direction.transpose();
      a += w * across;
      b += w * across * ray->origin;
    }
    if (std::abs(a.determinant()) < 1e-9F) return std::nullopt;
    x = a.inverse() * b;
  }
  return x;
}

bool agrees(const Spot& ray, const Eigen::Vector3f& x, float tolerance) {
  const Eigen::Vector3f to = x - ray.origin;
  const float along = to.dot(ray.direction);
  return along > 0 && to.cross(ray.direction).norm() < tolerance * to.norm();
}

std::vector<const Spot*> voters(const std::vector<Spot>& spots, const Eigen::Vector3f& x, float tolerance) {
  std::vector<const Spot*> all;
  for (const Spot& s : spots)
    if (agrees(s, x, tolerance + 0.3F * s.radius_rad)) all.push_back(&s);  // a large lamp is hit less exactly
  return all;
}

std::optional<Eigen::Vector3f> propose(const Spot& a, const Spot& b, const EmitterOptions& options) {
  if (a.direction.cross(b.direction).norm() < least_parallax_rad) return std::nullopt;
  auto x = nearest_point({&a, &b}, a.origin + a.direction);
  if (!x || (*x - a.origin).norm() > options.farthest_m) return std::nullopt;
  if (!agrees(a, *x, options.tolerance_rad) || !agrees(b, *x, options.tolerance_rad)) return std::nullopt;
  return x;
}

float typical_radius(const std::vector<const Spot*>& rays, const Eigen::Vector3f& x) {
  std::vector<float> radii;
  radii.reserve(rays.size());
  for (const Spot* ray : rays) radii.push_back(ray->radius_rad * (x - ray->origin).norm());
  // The median: occluders make some spots smaller, blur makes others larger.
  const auto upper = radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2);
  std::nth_element(radii.begin(), upper, radii.end());
  return *upper;
}

}  // namespace

std::vector<Emitter> find_emitters(const std::vector<FieldView>& views, const EmitterOptions& options) {
  std::vector<Spot> spots;
  const float threshold = options.brightness * mean_luminance(views);
  if (!(threshold > 0)) return {};
  for (const FieldView& view : views) collect_spots(view, threshold, options, spots);
  std::vector<Emitter> emitters;
  std::mt19937 random(1);  // the same proposals every time
  constexpr std::size_t most = 32;
  while (emitters.size() < most && static_cast<int>(spots.size()) >= options.fewest_views) {
    std::uniform_int_distribution<std::size_t> any(0, spots.size() - 1);
    std::vector<const Spot*> best;
    Eigen::Vector3f position = Eigen::Vector3f::Zero();
    for (int i = 0; i < proposals; ++i) {
      const auto x = propose(spots[any(random)], spots[any(random)], options);
      if (!x) continue;
      std::vector<const Spot*> agreeing = voters(spots, *x, options.tolerance_rad);
      if (agreeing.size() <= best.size()) continue;
      best = std::move(agreeing);
      position = *x;
    }
    if (static_cast<int>(best.size()) < options.fewest_views) break;
    position = nearest_point(best, position).value_or(position);
    const std::vector<const Spot*> all = voters(spots, position, options.tolerance_rad);
    if (static_cast<int>(all.size()) < options.fewest_views) break;
    position = nearest_point(all, position).value_or(position);
    const Emitter seen{position, typical_radius(all, position), static_cast<int>(all.size())};
    emitters.push_back(fit_outline(views, centred_on_rays(views, seen)));
    // What votes for this one, loosely, votes for no other.
    std::erase_if(spots, [&](const Spot& s) { return agrees(s, position, 3 * options.tolerance_rad + s.radius_rad); });
  }
  return emitters;
}

}  // namespace mf
