// SPDX-License-Identifier: Apache-2.0
#include "hw-sim/environment_map.h"

#include <ImfArray.h>
#include <ImfRgbaFile.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/check.h"
#include "common/error.h"

namespace mf::sim {

namespace {

constexpr float full_turn = 2 * std::numbers::pi_v<float>;

}  // namespace

EnvironmentMap::EnvironmentMap(ImageF panorama) : panorama_(std::move(panorama)) {
  check(panorama_.channels == 3 && panorama_.width == 2 * panorama_.height && panorama_.height > 0,
        "a panorama is 2 : 1");
  double sum = 0;
  sums_.reserve(static_cast<std::size_t>(panorama_.width) * static_cast<std::size_t>(panorama_.height));
  for (int y = 0; y < panorama_.height; ++y)
    for (int x = 0; x < panorama_.width; ++x) {
      // The floor keeps every direction possible, so that nothing is divided by zero.
      sum += (static_cast<double>(pixel(x, y).sum()) + 1e-9) * solid_angle(y);
      sums_.push_back(sum);
    }
}

Eigen::Array3f EnvironmentMap::pixel(int x, int y) const {
  const int column = (x % panorama_.width + panorama_.width) % panorama_.width;
  const float* p = &panorama_.at(column, std::clamp(y, 0, panorama_.height - 1));
  return {p[0], p[1], p[2]};
}

double EnvironmentMap::solid_angle(int y) const {
  const double step = std::numbers::pi / panorama_.height;
  return 2 * std::numbers::pi / panorama_.width * (std::cos(y * step) - std::cos((y + 1) * step));
}

Eigen::Vector3f EnvironmentMap::direction_at(float x, float y) const {
  const float polar = y / static_cast<float>(panorama_.height) * std::numbers::pi_v<float>;  // from +Z
  const float right = x / static_cast<float>(panorama_.width) * full_turn - full_turn / 2;   // from +Y to +X
  return {std::sin(polar) * std::sin(right), std::sin(polar) * std::cos(right), std::cos(polar)};
}

Eigen::Array3f EnvironmentMap::radiance(const Eigen::Vector3f& direction) const {
  const float polar = std::acos(std::clamp(direction.z(), -1.0F, 1.0F));
  const float right = std::atan2(direction.x(), direction.y());
  const float x = (right / full_turn + 0.5F) * static_cast<float>(panorama_.width) - 0.5F;
  const float y = polar / std::numbers::pi_v<float> * static_cast<float>(panorama_.height) - 0.5F;
  const auto x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
  const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
  return (1 - fy) * ((1 - fx) * pixel(x0, y0) + fx * pixel(x0 + 1, y0)) +
         fy * ((1 - fx) * pixel(x0, y0 + 1) + fx * pixel(x0 + 1, y0 + 1));
}

EnvironmentMap::Drawn EnvironmentMap::draw(const Eigen::Vector2f& u) const {
  const double wanted = static_cast<double>(u.x()) * sums_.back();
  const auto found = std::min(std::upper_bound(sums_.begin(), sums_.end(), wanted), sums_.end() - 1);
  const auto index = static_cast<int>(found - sums_.begin());
  const double before = index == 0 ? 0 : sums_[static_cast<std::size_t>(index) - 1];
  const double weight = *found - before;
  const int x = index % panorama_.width, y = index / panorama_.width;
  const float across = std::clamp(static_cast<float>((wanted - before) / weight), 0.0F, 1.0F);
  Drawn drawn;
  drawn.direction = direction_at(static_cast<float>(x) + across, static_cast<float>(y) + u.y());
  drawn.radiance = pixel(x, y);
  drawn.density = static_cast<float>(weight / sums_.back() / solid_angle(y));
  return drawn;
}

EnvironmentMap read_environment_map(const std::filesystem::path& file) {
  ImageF panorama;
  try {
    Imf::RgbaInputFile in(file.c_str());
    const Imath::Box2i box = in.dataWindow();
    const int width = box.max.x - box.min.x + 1, height = box.max.y - box.min.y + 1;
    Imf::Array2D<Imf::Rgba> pixels(height, width);
    in.setFrameBuffer(&pixels[0][0] - box.min.x - static_cast<std::ptrdiff_t>(box.min.y) * width, 1,
                      static_cast<std::size_t>(width));
    in.readPixels(box.min.y, box.max.y);
    panorama = ImageF(width, height, 3);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const Imf::Rgba& p = pixels[y][x];
        const std::array<float, 3> rgb{p.r, p.g, p.b};
        std::copy(rgb.begin(), rgb.end(), &panorama.at(x, y));
      }
  } catch (const std::exception& e) {
    throw InputError(file.string(), "", fmt::format("cannot be read ({}): give an OpenEXR panorama", e.what()));
  }
  if (panorama.width != 2 * panorama.height)
    throw InputError(
        file.string(), "",
        fmt::format("has {} x {} pixels: a panorama is twice as wide as high", panorama.width, panorama.height));
  if (!std::all_of(panorama.data.begin(), panorama.data.end(), [](float v) { return std::isfinite(v) && v >= 0; }))
    throw InputError(file.string(), "", "holds negative or infinite values: clip them");
  return EnvironmentMap(std::move(panorama));
}

}  // namespace mf::sim
