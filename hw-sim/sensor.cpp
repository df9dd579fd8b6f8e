// SPDX-License-Identifier: Apache-2.0
#include "hw-sim/sensor.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "common/check.h"
#include "hw-sim/parallel.h"
#include "hw-sim/sampler.h"

namespace mf::sim {

namespace {

// Steps of the table: the upper bits of a float are its octave and the first bits of its mantissa.
constexpr int step_bits = 7;
constexpr int dropped_bits = 23 - step_bits;
constexpr float least_light = 0x1p-20F, most_light = 0x1p27F;  // brightest_light is below

std::uint32_t step_of(float light) {
  return std::bit_cast<std::uint32_t>(light) >> dropped_bits;
}
const std::uint32_t first_step = step_of(least_light);

double seen_by(const ImageF& radiance, const PixelLayout layout, int x, int y) {
  if (radiance.channels == 1) return static_cast<double>(radiance.at(x, y));
  if (layout != PixelLayout::mono) return static_cast<double>(radiance.at(x, y, colour_at(layout, x, y)));
  return (static_cast<double>(radiance.at(x, y, 0)) + static_cast<double>(radiance.at(x, y, 1)) +
          static_cast<double>(radiance.at(x, y, 2))) /
         3;
}

constexpr std::size_t noise_size = std::size_t{1} << 17;  // 512 KB: stays in the cache

}  // namespace

ImageU16 Sensor::expose(const ImageF& radiance, double exposure_s, const Region& region, std::uint64_t seed) const {
  const double last_code = format.level_count() - 1;
  const auto black = static_cast<std::uint16_t>(std::lround(response.black_level));
  ImageU16 codes(radiance.width, radiance.height, 1, black);
  parallel_for(region.y0, region.y1, [&](int y) {
    Random random(mix(seed, static_cast<std::uint64_t>(y)));
    for (int x = region.x0; x < region.x1; ++x) {
      const int colour = colour_at(format.layout, x, y);
      const double exposure =
          seen_by(radiance, format.layout, x, y) * response.vignetting.gain(x + 0.5, y + 0.5) * exposure_s;
      const double shot = std::sqrt(exposure / electrons_per_exposure) * static_cast<double>(random.normal());
      const double code = response.code_of(colour, std::max(0.0, exposure + shot)) +
                          read_noise_codes * static_cast<double>(random.normal());
      codes.at(x, y) = static_cast<std::uint16_t>(std::lround(std::clamp(code, 0.0, last_code)));
    }
  });
  return codes;
}

Sensor desk_sensor() {
  constexpr double exposure_s = 0.01;
  Sensor sensor;
  sensor.response = linlog_response(sensor.format.bits, 64, 1.5 * exposure_s, 800 * exposure_s, 3);
  return sensor;
}

FastSensor::FastSensor(const SensorTraits& traits, const SensorResponse& response, double gain_db)
    : noise_(noise_size),
      last_code_(static_cast<float>(traits.format.level_count() - 1)),
      light_per_exposure_(1 / traits.full_exposure) {
  check(fault_of(response).empty(), "a sensor's response has no fault");
  const double gain = std::pow(10, gain_db / 20);
  const double range = static_cast<double>(last_code_) - traits.black_level;
  const auto code_at = [&](double light) { return traits.black_level + gain * range * charge_of(response, light); };
  const auto sigma_at = [&](double light, double slope) {
    const double shot = slope * std::sqrt(light / traits.full_electrons);
    return std::hypot(shot, gain * traits.read_noise_codes);
  };
  const std::uint32_t end = step_of(most_light);
  steps_.reserve(end - first_step);
  for (std::uint32_t i = first_step; i < end; ++i) {
    const double start = i == first_step ? 0 : static_cast<double>(std::bit_cast<float>(i << dropped_bits));
    const double next = static_cast<double>(std::bit_cast<float>((i + 1) << dropped_bits));
    const double slope = (code_at(next) - code_at(start)) / (next - start);
    const double from = sigma_at(start, slope), to = sigma_at(next, slope);
    steps_.push_back({static_cast<float>(code_at(start)), static_cast<float>(slope), static_cast<float>(from),
                      static_cast<float>((to - from) / (next - start)), static_cast<float>(start)});
  }
  Random random(20'260'101);
  for (float& value : noise_) value = random.normal();
}

void FastSensor::expose(const ImageF& mosaic, double exposure_s, std::uint64_t seed,
                        std::span<std::uint16_t> codes) const {
  check(mosaic.channels == 1 && codes.size() == mosaic.data.size(), "a code for every pixel of a mosaic");
  const auto factor = static_cast<float>(exposure_s * light_per_exposure_);
  const std::uint32_t last = static_cast<std::uint32_t>(steps_.size()) - 1;
  const auto width = static_cast<std::size_t>(mosaic.width);
  check(width < noise_size, "a row is shorter than the noise's pattern");
  for (int y = 0; y < mosaic.height; ++y) {
    const float* light = mosaic.row(y).data();
    const float* noise = noise_.data() + mix(seed, static_cast<std::uint64_t>(y)) % (noise_size - width);
    std::uint16_t* code = codes.data() + static_cast<std::size_t>(y) * width;
    for (std::size_t x = 0; x < width; ++x) {
      const float e = std::max(light[x] * factor, 0.0F);
      const Step& step = steps_[std::min(std::max(step_of(e), first_step) - first_step, last)];
      const float above = e - step.start;
      const float noisy = step.code + step.code_slope * above + (step.sigma + step.sigma_slope * above) * noise[x];
      code[x] = static_cast<std::uint16_t>(std::min(std::max(noisy, 0.0F), last_code_) + 0.5F);
    }
  }
}

ImageF sensor_mosaic(const ImageF& radiance, const SensorTraits& traits) {
  ImageF mosaic(radiance.width, radiance.height, 1);
  for (int y = 0; y < radiance.height; ++y)
    for (int x = 0; x < radiance.width; ++x)
      mosaic.at(x, y) =
          static_cast<float>(seen_by(radiance, traits.format.layout, x, y) * traits.vignetting.gain(x + 0.5, y + 0.5));
  return mosaic;
}

}  // namespace mf::sim
