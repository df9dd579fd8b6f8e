// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/source_sight.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/check.h"
#include "host/blending/vectorized.h"
#include "host/lumigraph/area_average.h"
#include "host/lumigraph/proxy_rays.h"
#include "host/lumigraph/vector_math.h"

namespace mf {

namespace {

constexpr int step_px = 2;  // photo pixels a texel: silhouettes are given several pixels anyway
constexpr float code_range = 65535;
constexpr int columns = 8;            // of texels that bounds look at side by side
constexpr float least_trust = 1e-4F;  // smoothed it is nothing, but only a mask takes all

// Depth along the optical axis of each texel's centre; infinite: the proxy is not there.
ImageF depth_map(const CameraModel& camera, const Rigid3& cam_from_world, const Proxy& proxy, int width, int height) {
  const Eigen::Matrix3f world_from_cam = cam_from_world.rotation.conjugate().toRotationMatrix().cast<float>();
  const auto count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  std::array<std::vector<float>, 6> rays;
  rays.fill(std::vector<float>(count));
  const double px_x = static_cast<double>(camera.width) / width;
  const double px_y = static_cast<double>(camera.height) / height;
  for (std::size_t i = 0; i < count; ++i) {
    const auto x = static_cast<double>(i % static_cast<std::size_t>(width));
    const auto y = static_cast<double>(i / static_cast<std::size_t>(width));
    const auto ray = camera.unproject({(x + 0.5) * px_x, (y + 0.5) * px_y});
    const Eigen::Vector3f d = world_from_cam * ray.value_or(Eigen::Vector3d::UnitZ()).cast<float>();
    for (std::size_t c = 0; c < 3; ++c) rays[c][i] = d[static_cast<Eigen::Index>(c)];
  }
  ImageF depth(width, height, 1);
  trace(proxy, {cam_from_world.inverse().translation.cast<float>(), rays[0], rays[1], rays[2], depth.data, rays[3],
                rays[4], rays[5]});
  return depth;
}

// Where inverse depth bends more than any surface's does over two texels, it jumps.
bool jumps(float a, float b, float c) {
  constexpr float bend = 0.02F;  // of the nearest of the three; a wall's corner bends by a texel's angle, about 0.003
  return std::abs(a + c - 2 * b) > bend * std::max({a, b, c});
}

// Distance in texels to the nearest jump, up to `reach`.
ImageF distance_to_jumps(const ImageF& inverse, float reach) {
  ImageF distance(inverse.width, inverse.height, 1, reach);
  const auto mark = [&](int x, int y) { distance.at(x, y) = 0; };
  for (int y = 0; y < inverse.height; ++y)
    for (int x = 1; x + 1 < inverse.width; ++x)
      if (jumps(inverse.at(x - 1, y), inverse.at(x, y), inverse.at(x + 1, y))) mark(x, y);
  for (int y = 1; y + 1 < inverse.height; ++y)
    for (int x = 0; x < inverse.width; ++x)
      if (jumps(inverse.at(x, y - 1), inverse.at(x, y), inverse.at(x, y + 1))) mark(x, y);
  // Two chamfer passes (Borgefors 1986): straight steps 1, diagonal ones √2.
  const auto relax = [&](int x, int y, int from_x, int from_y) {
    if (from_x < 0 || from_y < 0 || from_x >= inverse.width || from_y >= inverse.height) return;
    const float length = from_x != x && from_y != y ? std::numbers::sqrt2_v<float> : 1.0F;
    distance.at(x, y) = std::min(distance.at(x, y), distance.at(from_x, from_y) + length);
  };
  for (int y = 0; y < inverse.height; ++y)
    for (int x = 0; x < inverse.width; ++x)
      for (const auto& [dx, dy] : {std::pair{-1, 0}, {-1, -1}, {0, -1}, {1, -1}}) relax(x, y, x + dx, y + dy);
  for (int y = inverse.height - 1; y >= 0; --y)
    for (int x = inverse.width - 1; x >= 0; --x)
      for (const auto& [dx, dy] : {std::pair{1, 0}, {1, 1}, {0, 1}, {-1, 1}}) relax(x, y, x + dx, y + dy);
  return distance;
}

bool hides_itself(const Proxy& proxy) {
  return std::holds_alternative<MeshProxy>(proxy);
}

std::uint32_t code(float value) {
  return static_cast<std::uint32_t>(std::lround(code_range * std::clamp(value, 0.0F, 1.0F)));
}

void set_depth(SourceSight& sight, const CameraModel& camera, const Rigid3& cam_from_world, const Proxy& proxy,
               const VisibilityOptions& options) {
  ImageF inverse = depth_map(camera, cam_from_world, proxy, sight.width, sight.height);
  for (float& value : inverse.data) value = 1 / value;  // of infinity: 0
  sight.scale = std::max(*std::max_element(inverse.data.begin(), inverse.data.end()),
                         std::numeric_limits<float>::min());  // > 0 although the photo sees nothing of the proxy
  const float reach = std::max(options.silhouette * sight.texels_per_px, 1e-3F);
  const ImageF distance = distance_to_jumps(inverse, reach);
  for (std::size_t i = 0; i < sight.texels.size(); ++i) {
    const float trust = std::max(distance.data[i] / reach, least_trust);
    sight.texels[i] = SourceSight::texel(code(inverse.data[i] / sight.scale), code(trust));
  }
}

void trust_mask(SourceSight& sight, const ImageU8& mask) {
  const ImageU8 small = area_average(mask, sight.width, sight.height);
  for (std::size_t i = 0; i < sight.texels.size(); ++i)
    sight.texels[i] = SourceSight::texel(sight.texels[i] >> 16U, (sight.texels[i] & 0xFFFFU) * small.data[i] / 255);
}

SourceSight::Cell bounding(SourceSight::Cell a, SourceSight::Cell b) {
  return {std::min(a.least_inverse_depth, b.least_inverse_depth), std::max(a.largest_trust, b.largest_trust)};
}

SourceSight::Cell cell_of(SourceSight::Texel texel) {
  return {static_cast<std::uint8_t>((texel >> 16U) / 257), static_cast<std::uint8_t>(((texel & 0xFFFFU) + 256) / 257)};
}

// Appends cells, each of two by two of `fine`, whose last row and column are repeated where their number is odd.
template <typename Fine>
SourceSight::Level add_level(SourceSight& sight, int fine_width, int fine_height, const Fine& fine) {
  const auto at = [&](int x, int y) { return fine(std::min(x, fine_width - 1), std::min(y, fine_height - 1)); };
  const SourceSight::Level level{(fine_width + 1) / 2, static_cast<std::int32_t>(sight.cells.size())};
  for (int y = 0; y < fine_height; y += 2)
    for (int x = 0; x < fine_width; x += 2)
      sight.cells.push_back(bounding(bounding(at(x, y), at(x + 1, y)), bounding(at(x, y + 1), at(x + 1, y + 1))));
  return level;
}

void add_levels(SourceSight& sight) {
  sight.levels[0] = add_level(sight, sight.width, sight.height, [&](int x, int y) {
    return cell_of(sight.texels[static_cast<std::size_t>(y) * static_cast<std::size_t>(sight.width) +
                                static_cast<std::size_t>(x)]);
  });
  int height = (sight.height + 1) / 2;
  for (std::size_t i = 0; sight.levels[i].width > 1 || height > 1; ++i) {
    check(i + 1 < sight.levels.size(), "a photo has fewer pixels than its sight has levels for");
    const SourceSight::Level level = sight.levels[i];
    sight.levels[i + 1] = add_level(sight, level.width, height, [&](int x, int y) {
      return sight.cells[static_cast<std::size_t>(level.first + y * level.width + x)];
    });
    height = (height + 1) / 2;
  }
}

struct CodeBounds {
  float least_inverse_depth, largest_trust;
};

// Over a rectangle of at most `columns` texels' width, in codes. Each column is that from one texel to the next; of its
// patch in each row counts what lies in the rectangle, whose corners have the extremes.
MF_VECTORIZED CodeBounds bounds_between(const SourceSight::Texel* texels, int width, float left, float top, float right,
                                        float bottom) {
  alignas(32) std::array<float, columns> from;
  alignas(32) std::array<float, columns> to;
  alignas(32) std::array<float, columns> least;
  alignas(32) std::array<float, columns> most;
  const int x0 = static_cast<int>(left);
  for (int i = 0; i < columns; ++i) {
    const auto x = static_cast<float>(x0 + i);
    from[i] = larger(left - x, 0.0F);
    to[i] = smaller(larger(right - x, 0.0F), 1.0F);
    least[i] = code_range;
    most[i] = 0;
  }
  const auto between = [](float a, float b, float t) { return a + t * (b - a); };
  for (int y = static_cast<int>(top); y <= static_cast<int>(bottom); ++y) {
    const float first = larger(top - static_cast<float>(y), 0.0F);
    const float last = smaller(bottom - static_cast<float>(y), 1.0F);
    const SourceSight::Texel* above = texels + y * width + x0;
    const SourceSight::Texel* below = above + width;
    for (int i = 0; i < columns; ++i) {
      const float depth_left = between(depth_code(above[i]), depth_code(above[i + 1]), from[i]);
      const float depth_right = between(depth_code(above[i]), depth_code(above[i + 1]), to[i]);
      const float depth_left_below = between(depth_code(below[i]), depth_code(below[i + 1]), from[i]);
      const float depth_right_below = between(depth_code(below[i]), depth_code(below[i + 1]), to[i]);
      const float trust_left = between(trust_code(above[i]), trust_code(above[i + 1]), from[i]);
      const float trust_right = between(trust_code(above[i]), trust_code(above[i + 1]), to[i]);
      const float trust_left_below = between(trust_code(below[i]), trust_code(below[i + 1]), from[i]);
      const float trust_right_below = between(trust_code(below[i]), trust_code(below[i + 1]), to[i]);
      least[i] = smaller(
          least[i],
          smaller(
              smaller(between(depth_left, depth_left_below, first), between(depth_left, depth_left_below, last)),
              smaller(between(depth_right, depth_right_below, first), between(depth_right, depth_right_below, last))));
      most[i] = larger(
          most[i],
          larger(
              larger(between(trust_left, trust_left_below, first), between(trust_left, trust_left_below, last)),
              larger(between(trust_right, trust_right_below, first), between(trust_right, trust_right_below, last))));
    }
  }
  CodeBounds all{least[0], most[0]};
  for (int i = 1; i <= static_cast<int>(right) - x0; ++i) {
    all.least_inverse_depth = smaller(all.least_inverse_depth, least[i]);
    all.largest_trust = larger(all.largest_trust, most[i]);
  }
  return all;
}

}  // namespace

std::optional<std::string> VisibilityOptions::validate() const {
  if (!(tolerance >= 1e-4F && tolerance <= 1)) return "tolerance: must be between 0.0001 and 1 of the depth";
  if (!(silhouette >= 0 && silhouette <= 64)) return "silhouette: must be between 0 and 64 pixels";
  return std::nullopt;
}

SourceSight make_sight(const CameraModel& camera, const Rigid3& cam_from_world, const ImageU8& mask, const Proxy& proxy,
                       const VisibilityOptions& options) {
  SourceSight sight;
  if (!hides_itself(proxy) && mask.empty()) return sight;
  sight.width = std::max(1, camera.width / step_px);
  sight.height = std::max(1, camera.height / step_px);
  sight.texels_per_px = static_cast<float>(sight.width) / static_cast<float>(camera.width);
  sight.texels.assign(static_cast<std::size_t>(sight.width) * static_cast<std::size_t>(sight.height),
                      SourceSight::texel(0, static_cast<std::uint32_t>(code_range)));
  if (hides_itself(proxy)) set_depth(sight, camera, cam_from_world, proxy, options);
  if (!mask.empty()) trust_mask(sight, mask);
  add_levels(sight);
  sight.texels.resize(sight.texels.size() + static_cast<std::size_t>(sight.width + columns));
  return sight;
}

SourceSight::Bounds SourceSight::bounds(float left, float top, float right, float bottom) const {
  const int x0 = static_cast<int>(left);
  const int y0 = static_cast<int>(top);
  const int x1 = static_cast<int>(right);
  const int y1 = static_cast<int>(bottom);
  if (x1 - x0 >= columns || y1 - y0 >= columns)
    return of_cells(x0, y0, std::min(x1 + 1, width - 1), std::min(y1 + 1, height - 1));
  constexpr float rounding = 0.05F;  // of single precision in codes, several times
  const CodeBounds codes = bounds_between(texels.data(), width, left, top, right, bottom);
  return {scale / code_range * (codes.least_inverse_depth - rounding),
          codes.largest_trust > 0 ? (codes.largest_trust + rounding) / code_range : 0.0F};
}

// The level is the finest at which the rectangle lies in three by three cells.
SourceSight::Bounds SourceSight::of_cells(int x0, int y0, int x1, int y1) const {
  const auto longest = static_cast<unsigned>(std::max({x1 - x0, y1 - y0, 3}));
  const auto log2_side = static_cast<unsigned>(std::bit_width((longest - 1) / 2));  // ≥ 1
  const Level& level = levels[log2_side - 1];
  Cell all{0xFF, 0};
  for (int y = y0 >> log2_side; y <= y1 >> log2_side; ++y)
    for (int x = x0 >> log2_side; x <= x1 >> log2_side; ++x)
      all = bounding(all, cells[static_cast<std::size_t>(level.first + y * level.width + x)]);
  return {scale / 255 * static_cast<float>(all.least_inverse_depth), static_cast<float>(all.largest_trust) / 255};
}

}  // namespace mf
