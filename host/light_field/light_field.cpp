// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/light_field.h"

#include <algorithm>

namespace mf {

Eigen::Vector4f sample_tile(const LightField& field, std::size_t direction, const Eigen::Vector2f& p_in_plane) {
  const float n = static_cast<float>(field.resolution);
  const Eigen::Vector2f low = field.plane.min_m.cast<float>(), high = field.plane.max_m.cast<float>();
  const float x = std::clamp((p_in_plane.x() - low.x()) / (high.x() - low.x()) * n - 0.5F, 0.0F, n - 1);
  const float y = std::clamp((high.y() - p_in_plane.y()) / (high.y() - low.y()) * n - 0.5F, 0.0F, n - 1);
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const int x1 = std::min(x0 + 1, field.resolution - 1), y1 = std::min(y0 + 1, field.resolution - 1);
  const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
  const Eigen::Vector4f* tile = field.tile(direction);
  Eigen::Vector4f sum = Eigen::Vector4f::Zero();  // colour · say, say
  float confidence = 0;
  const auto add = [&](int tx, int ty, float weight) {
    const Eigen::Vector4f& texel = tile[ty * field.resolution + tx];
    const float say = say_of(texel);  // a texel that no view saw does not darken its neighbours
    sum += weight * say * Eigen::Vector4f(texel.x(), texel.y(), texel.z(), 1);
    confidence += weight * texel.w();
  };
  add(x0, y0, (1 - fx) * (1 - fy));
  add(x1, y0, fx * (1 - fy));
  add(x0, y1, (1 - fx) * fy);
  add(x1, y1, fx * fy);
  if (sum.w() <= 0) return Eigen::Vector4f::Zero();
  return {sum.x() / sum.w(), sum.y() / sum.w(), sum.z() / sum.w(), confidence};
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

}  // namespace mf
