// SPDX-License-Identifier: Apache-2.0
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "host/blending/view_weights.h"
#include "host/light_field/resample.h"
#include "host/light_field/view_rays.h"

namespace mf {

namespace {

constexpr int test_directions = 400;
constexpr int test_points = 4;  // along each side of the rectangle
constexpr float test_angle_rad =
    0.025F;  // what is compared: coarser than noise and calibration errors, finer than walls

struct TestRay {
  Eigen::Vector3f p;
  Eigen::Vector3f direction;
};

std::vector<TestRay> test_rays(const PlaneRectangle& rectangle) {
  const DirectionSet set = geodesic_hemisphere(test_directions);
  std::vector<TestRay> rays;
  for (const Eigen::Vector3f& d : set.directions)
    for (int y = 0; y < test_points; ++y)
      for (int x = 0; x < test_points; ++x) {
        const Eigen::Vector2d f((x + 0.5) / test_points, (y + 0.5) / test_points);
        const Eigen::Vector2d p = rectangle.min_m + f.cwiseProduct(rectangle.size_m());
        rays.push_back({(rectangle.world_from_plane * Eigen::Vector3d(p.x(), p.y(), 0)).cast<float>(),
                        rectangle.world_from_plane.rotation.cast<float>() * d});
      }
  return rays;
}

// Mean distance of log2 radiance from its median over the k best views, or nothing when too few of them saw the ray.
std::optional<double> inconsistency(const std::vector<FieldView>& views, const TestRay& ray, const ProxyPoint& x,
                                    int k) {
  std::vector<std::pair<float, float>> answers;  // penalty, log2 luminance
  for (const FieldView& view : views) {
    const Eigen::Vector3f pixel = pixel_of(view, x);
    if (pixel.z() <= 0) continue;
    const Eigen::Vector4f seen =
        view.fetch(level_for_angle(view, x, test_angle_rad), pixel.x() / pixel.z(), pixel.y() / pixel.z());
    if (seen.w() < 0.5F) continue;
    const float luminance = (0.2126F * seen.x() + 0.7152F * seen.y() + 0.0722F * seen.z()) / seen.w();
    constexpr float darkest = 1e-4F;  // below, the logarithm only magnifies noise
    answers.emplace_back(ray_distance(ray.p, x, view.centre_in_world), std::log2(std::max(luminance, darkest)));
  }
  const std::size_t wanted = static_cast<std::size_t>(std::max(k, 4));
  if (answers.size() < wanted) return std::nullopt;
  std::partial_sort(answers.begin(), answers.begin() + static_cast<std::ptrdiff_t>(wanted), answers.end());
  std::vector<float> logs;
  for (std::size_t i = 0; i < wanted; ++i) logs.push_back(answers[i].second);
  std::nth_element(logs.begin(), logs.begin() + static_cast<std::ptrdiff_t>(wanted / 2), logs.end());
  const float median = logs[wanted / 2];
  double sum = 0;
  for (const float v : logs) sum += std::abs(static_cast<double>(v - median));
  return sum / static_cast<double>(wanted);
}

}  // namespace

std::vector<ProxyScore> score_proxies(const std::vector<FieldView>& views, const PlaneRectangle& rectangle, int k) {
  const double smallest = 1.2 * 0.5 * rectangle.size_m().norm();
  std::vector<ProxyScore> scores;
  for (const double radius :
       {0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 16.0, std::numeric_limits<double>::infinity()})
    if (radius > smallest) scores.push_back({{radius}, 0});
  const std::vector<TestRay> rays = test_rays(rectangle);
  const Eigen::Vector2d middle = 0.5 * (rectangle.min_m + rectangle.max_m);
  const Eigen::Vector3f centre =
      (rectangle.world_from_plane * Eigen::Vector3d(middle.x(), middle.y(), 0)).cast<float>();
  std::vector<std::vector<double>> spread(rays.size());
  tbb::parallel_for(std::size_t{0}, rays.size(), [&](std::size_t r) {
    for (const ProxyScore& s : scores) {
      const float inverse = inverse_distance_to_sphere(rays[r].p, rays[r].direction, centre, s.proxy.radius_m);
      const auto value = inconsistency(views, rays[r], proxy_point(rays[r].p, rays[r].direction, inverse), k);
      if (!value) {  // every radius is judged by the same rays
        spread[r].clear();
        return;
      }
      spread[r].push_back(*value);
    }
  });
  for (std::size_t i = 0; i < scores.size(); ++i) {
    double sum = 0, count = 0;
    for (const auto& values : spread)
      if (!values.empty()) {
        sum += values[i];
        count += 1;
      }
    scores[i].inconsistency = count > 0 ? sum / count : std::numeric_limits<double>::infinity();
  }
  return scores;
}

}  // namespace mf
