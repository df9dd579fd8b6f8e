// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/emitter_centre.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "host/light_field/view_rays.h"

namespace mf {

namespace {

constexpr float ray_reach = 1.6F;  // times the radius: rays farther off show something else
constexpr float rim_power = 8;
constexpr int rim_rounds = 60;
constexpr std::size_t fewest_rays = 200;
constexpr float unframed_weight = 0.8F;  // darker pixels are at the view's own border

struct BrightRay {
  Eigen::Vector3f origin;
  Eigen::Vector3f direction;  // unit
  float luminance = 0;
};

float distance_to(const BrightRay& ray, const Eigen::Vector3f& x) {
  return (x - ray.origin).cross(ray.direction).norm();
}

// The pixels of a view about the emitter's picture.
void collect_rays(const FieldView& view, const Emitter& e, std::vector<BrightRay>& rays) {
  const Eigen::Vector3f pixel = pixel_of(view, e.position.homogeneous());
  if (pixel.z() <= 0) return;
  const PremultipliedImage& image = view.levels.front();
  const Eigen::Vector2f middle = pixel.head<2>() / pixel.z();
  const float reach = ray_reach * e.radius_m / (e.position - view.centre_in_world).norm() * view.focal_px + 2;
  const Eigen::Matrix3f ray_from_pixel = Eigen::Matrix3f(view.pixel_from_world.leftCols<3>()).inverse();
  const int x0 = std::max(0, static_cast<int>(middle.x() - reach));
  const int y0 = std::max(0, static_cast<int>(middle.y() - reach));
  const int x1 = std::min(image.width(), static_cast<int>(middle.x() + reach) + 1);
  const int y1 = std::min(image.height(), static_cast<int>(middle.y() + reach) + 1);
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x) {
      const Eigen::Vector4f& texel = image.at(x, y);
      if (texel.w() < unframed_weight) continue;
      const Eigen::Vector3f at(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F, 1);
      const BrightRay ray{view.centre_in_world, (ray_from_pixel * at).normalized(), shown_luminance(texel)};
      if (distance_to(ray, e.position) < ray_reach * e.radius_m) rays.push_back(ray);
    }
}

// The emitter's own level: of the brightest tenth of the pixels about it, the darkest.
float level_of_rays(const std::vector<BrightRay>& rays) {
  std::vector<float> luminances;
  luminances.reserve(rays.size());
  for (const BrightRay& ray : rays) luminances.push_back(ray.luminance);
  const auto at = luminances.begin() + static_cast<std::ptrdiff_t>(0.9 * static_cast<double>(luminances.size() - 1));
  std::nth_element(luminances.begin(), at, luminances.end());
  return *at;
}

// One round of iteratively reweighted least squares for Σ dist^p.
Eigen::Vector3f next_centre(const std::vector<BrightRay>& rays, const Eigen::Vector3f& centre) {
  float farthest = 0;
  for (const BrightRay& ray : rays) farthest = std::max(farthest, distance_to(ray, centre));
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const BrightRay& ray : rays) {
    const double w = std::pow(static_cast<double>(distance_to(ray, centre) / farthest), rim_power - 2);
    const Eigen::Vector3d d = ray.direction.cast<double>();
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - d * d.transpose();
    a += w * across;
    b += w * (across * ray.origin.cast<double>());
  }
  const Eigen::Vector3f full = (a.inverse() * b).cast<float>();
  return centre + (full - centre) / (rim_power - 1);  // a Newton step of the power
}

}  // namespace

Emitter centred_on_rays(const std::vector<FieldView>& views, const Emitter& start) {
  std::vector<BrightRay> rays;
  for (const FieldView& view : views) collect_rays(view, start, rays);
  if (rays.size() < fewest_rays) return start;
  const float half = 0.5F * level_of_rays(rays);
  std::erase_if(rays, [&](const BrightRay& ray) { return ray.luminance < half; });
  if (rays.size() < fewest_rays) return start;
  Emitter e = start;
  for (int round = 0; round < rim_rounds; ++round) e.position = next_centre(rays, e.position);
  return e.position.allFinite() && (e.position - start.position).norm() < start.radius_m ? e : start;
}

}  // namespace mf
