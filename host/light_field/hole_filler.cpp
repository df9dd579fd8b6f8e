// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/hole_filler.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "common/luminance.h"
#include "host/light_field/light_tiles.h"

namespace mf {

namespace {

constexpr float brightest_guess = 4;  // times the median luminance of what is known

Eigen::Map<Eigen::Vector4f> pixel(ImageF& image, int x, int y) {
  return Eigen::Map<Eigen::Vector4f>(&image.at(x, y));
}
Eigen::Map<const Eigen::Vector4f> pixel(const ImageF& image, int x, int y) {
  return Eigen::Map<const Eigen::Vector4f>(&image.at(x, y));
}

// Half the size; colours not multiplied by the weight, which saturates at 1 (a coarse pixel is known when one part is).
ImageF pulled(const ImageF& fine) {
  ImageF coarse((fine.width + 1) / 2, (fine.height + 1) / 2, 4);
  for (int y = 0; y < coarse.height; ++y)
    for (int x = 0; x < coarse.width; ++x) {
      Eigen::Vector4f sum = Eigen::Vector4f::Zero();
      for (int i = 0; i < 4; ++i) {
        const int u = std::min(2 * x + i % 2, fine.width - 1), v = std::min(2 * y + i / 2, fine.height - 1);
        const Eigen::Vector4f p = pixel(fine, u, v);
        const float w = std::min(p.w(), 1.0F);
        sum += w * Eigen::Vector4f(p.x(), p.y(), p.z(), 1);
      }
      if (sum.w() > 0) pixel(coarse, x, y) << sum.head<3>() / sum.w(), std::min(sum.w(), 1.0F);
    }
  return coarse;
}

// Bilinear in the coarser picture, at a finer pixel's centre.
Eigen::Vector3f pushed(const ImageF& coarse, int fine_x, int fine_y, bool wraps) {
  const float x = (static_cast<float>(fine_x) + 0.5F) / 2 - 0.5F, y = (static_cast<float>(fine_y) + 0.5F) / 2 - 0.5F;
  const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
  const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
  const auto at = [&](int u, int v) -> Eigen::Vector3f {
    const int column = wraps ? (u + coarse.width) % coarse.width : std::clamp(u, 0, coarse.width - 1);
    return pixel(coarse, column, std::clamp(v, 0, coarse.height - 1)).head<3>();
  };
  return (at(x0, y0) * (1 - fx) + at(x0 + 1, y0) * fx) * (1 - fy) +
         (at(x0, y0 + 1) * (1 - fx) + at(x0 + 1, y0 + 1) * fx) * fy;
}

// What is far brighter than usual counts as just brighter: a lamp must not flow into a hole.
void cap_lamps(ImageF& rgbw) {
  std::vector<float> known;
  for (int y = 0; y < rgbw.height; ++y)
    for (int x = 0; x < rgbw.width; ++x)
      if (rgbw.at(x, y, 3) > 0) known.push_back(luminance_of(pixel(rgbw, x, y).head<3>()));
  if (known.empty()) return;
  const auto middle = known.begin() + static_cast<std::ptrdiff_t>(known.size() / 2);
  std::nth_element(known.begin(), middle, known.end());
  const float most = brightest_guess * *middle;
  for (int y = 0; y < rgbw.height; ++y)
    for (int x = 0; x < rgbw.width; ++x) {
      const float luminance = luminance_of(pixel(rgbw, x, y).head<3>());
      if (luminance > most) pixel(rgbw, x, y).head<3>() *= most / luminance;
    }
}

}  // namespace

void pull_push(ImageF& rgbw, bool wraps, float guess_weight) {
  std::vector<ImageF> levels{rgbw};
  cap_lamps(levels.front());
  while (levels.back().width > 1 || levels.back().height > 1) levels.push_back(pulled(levels.back()));
  if (levels.back().at(0, 0, 3) <= 0) return;  // nothing is known at all
  for (std::size_t i = levels.size() - 1; i-- > 0;) {
    ImageF& fine = levels[i];
    for (int y = 0; y < fine.height; ++y)
      for (int x = 0; x < fine.width; ++x) {
        // A coarse pixel of which only a part is known is mixed with its own surroundings.
        const float known = i == 0 && fine.at(x, y, 3) > 0 ? 1.0F : std::min(fine.at(x, y, 3), 1.0F);
        if (known >= 1) continue;
        pixel(fine, x, y).head<3>() =
            known * pixel(fine, x, y).head<3>() + (1 - known) * pushed(levels[i + 1], x, y, wraps);
      }
  }
  for (int y = 0; y < rgbw.height; ++y)
    for (int x = 0; x < rgbw.width; ++x)
      if (rgbw.at(x, y, 3) <= 0) pixel(rgbw, x, y) << pixel(levels.front(), x, y).head<3>(), guess_weight;
}

HoleFiller::HoleFiller(const LightField& field) : field_(field) {
  if (field.surroundings.panorama.empty()) return;
  closed_ = field.surroundings;
  pull_push(closed_.panorama, true, 1);
}

Eigen::Vector3f HoleFiller::guess(const std::vector<CellSample>& parts, const Eigen::Vector3f& p) const {
  Eigen::Vector4f sum = Eigen::Vector4f::Zero();
  for (const CellSample& part : parts) {
    const Eigen::Vector3f& d = part.direction;
    const float inverse = closed_.inverse_distance_along(p, d);
    const Eigen::Vector4f seen = closed_.panorama_at((d + inverse * (p - closed_.centre_in_world)).normalized());
    sum += part.solid_angle_sr * seen.w() * Eigen::Vector4f(seen.x(), seen.y(), seen.z(), 1);
  }
  return sum.w() > 0 ? Eigen::Vector3f(sum.head<3>() / sum.w()) : Eigen::Vector3f::Zero();
}

std::size_t HoleFiller::fill(std::size_t direction, const PlaneRectangle& plane, int n, Eigen::Vector4f* tile,
                             int spacing) const {
  const auto texels = static_cast<std::ptrdiff_t>(n) * n;
  const auto is_hole = [](const Eigen::Vector4f& texel) { return texel.w() <= 0; };
  const auto holes = static_cast<std::size_t>(std::count_if(tile, tile + texels, is_hole));
  if (holes == 0) return 0;
  if (closed_.panorama.empty()) {
    ImageF image(n, n, 4);
    std::copy(tile->data(), tile->data() + image.data.size(), image.data.begin());
    pull_push(image, false, 0);
    std::copy(image.data.begin(), image.data.end(), tile->data());
    return holes;
  }
  const std::vector<CellSample> parts = split_cell(
      field_.directions, direction, 1, field_.plane.world_from_plane.rotation.toRotationMatrix().cast<float>());
  const auto guess_at = [&](double x, double y) {
    return guess(parts, (plane.world_from_plane * Eigen::Vector3d(x, y, 0)).cast<float>());
  };
  PlaneTile guesses{plane.min_m.cast<float>(), plane.max_m.cast<float>(), 0, 0, {}};
  if (spacing > 1) {
    guesses.width = guesses.height = (n + spacing - 1) / spacing;
    for (int y = 0; y < guesses.height; ++y)
      for (int x = 0; x < guesses.width; ++x) {
        const Eigen::Vector2d p = guesses.position(x, y).cast<double>();
        guesses.texels.push_back(guess_at(p.x(), p.y()).homogeneous());
      }
  }
  const Eigen::Vector2d step = plane.size_m() / n;
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < n; ++x) {
      Eigen::Vector4f& texel = tile[y * n + x];
      if (!is_hole(texel)) continue;
      const Eigen::Vector2d p(plane.min_m.x() + (x + 0.5) * step.x(), plane.max_m.y() - (y + 0.5) * step.y());
      texel.head<3>() =
          spacing > 1 ? Eigen::Vector3f(sample(guesses.image(), p.cast<float>()).head<3>()) : guess_at(p.x(), p.y());
    }
  return holes;
}

}  // namespace mf
