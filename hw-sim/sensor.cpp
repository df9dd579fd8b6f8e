// SPDX-License-Identifier: Apache-2.0
#include "hw-sim/sensor.h"

#include <algorithm>
#include <cmath>

#include "hw-sim/parallel.h"
#include "hw-sim/sampler.h"

namespace mf::sim {

ImageU16 Sensor::expose(const ImageF& radiance, double exposure_s, const Region& region, std::uint64_t seed) const {
  const double last_code = format.level_count() - 1;
  const auto black = static_cast<std::uint16_t>(std::lround(response.black_level));
  ImageU16 codes(radiance.width, radiance.height, 1, black);
  parallel_for(region.y0, region.y1, [&](int y) {
    Random random(mix(seed, static_cast<std::uint64_t>(y)));
    for (int x = region.x0; x < region.x1; ++x) {
      const int colour = colour_at(format.layout, x, y);
      const double exposure = static_cast<double>(radiance.at(x, y, colour)) * exposure_s;
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

}  // namespace mf::sim
