// SPDX-License-Identifier: Apache-2.0
#include "host/report/field_pictures.h"

#include <algorithm>
#include <cmath>

namespace mf {

namespace {

// A direction's mean over the plane: colour (weighted by confidence) and confidence.
Eigen::Vector4f mean_of_tile(const LightField& field, std::size_t direction) {
  Eigen::Vector4f sum = Eigen::Vector4f::Zero();
  const Eigen::Vector4f* tile = field.tile(direction);
  for (std::size_t i = 0; i < field.texel_count(); ++i) {
    sum.head<3>() += tile[i].head<3>() * tile[i].w();
    sum.w() += tile[i].w();
  }
  if (sum.w() > 0) sum.head<3>() /= sum.w();
  sum.w() /= static_cast<float>(field.texel_count());
  return sum;
}

}  // namespace

HemisphereDisc draw_hemisphere(const LightField& field, int size_px) {
  std::vector<Eigen::Vector4f> means(field.directions.size());
  for (std::size_t d = 0; d < means.size(); ++d) means[d] = mean_of_tile(field, d);
  HemisphereDisc disc{ImageF(size_px, size_px, 3), ImageF(size_px, size_px, 1)};
  const DirectionLocator locator(field.directions);
  for (int y = 0; y < size_px; ++y)
    for (int x = 0; x < size_px; ++x) {
      const Eigen::Vector2f p = Eigen::Vector2f(2 * (static_cast<float>(x) + 0.5F) / static_cast<float>(size_px) - 1,
                                                1 - 2 * (static_cast<float>(y) + 0.5F) / static_cast<float>(size_px));
      const float r2 = p.squaredNorm();  // Lambert: 1 − cos θ of the polar angle θ
      if (r2 >= 1) continue;
      const Eigen::Vector2f horizontal = p * std::sqrt(2 - r2);
      const DirectionWeights at = locator.locate({horizontal.x(), horizontal.y(), 1 - r2});
      Eigen::Vector4f value = Eigen::Vector4f::Zero();
      for (std::size_t k = 0; k < 3; ++k) value += at.weight[k] * means[at.index[k]];
      std::copy(value.data(), value.data() + 3, &disc.radiance.at(x, y));
      disc.confidence.at(x, y) = value.w();
    }
  return disc;
}

double covered_share(const LightField& field) {
  double covered = 0;
  double all = 0;
  for (std::size_t d = 0; d < field.directions.size(); ++d) {
    const double weight = static_cast<double>(field.directions.directions[d].z() * field.directions.solid_angles_sr[d]);
    all += weight;
    covered += weight * static_cast<double>(mean_of_tile(field, d).w());
  }
  return all > 0 ? covered / all : 0;
}

}  // namespace mf
