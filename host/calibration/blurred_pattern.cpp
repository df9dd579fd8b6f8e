// SPDX-License-Identifier: Apache-2.0
#include "host/calibration/blurred_pattern.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace mf {

namespace {

constexpr double reach = 3.5;  // standard deviations; Φ beyond is 0 or 1 within 2e-4

// Φ and φ from a table: this is the innermost loop of the alignment.
class NormalTable {
 public:
  NormalTable() {
    for (std::size_t i = 0; i < cumulative_.size(); ++i) {
      const double z = -reach + static_cast<double>(i) / per_unit;
      cumulative_[i] = 0.5 * std::erfc(-z / std::numbers::sqrt2);
      density_[i] = std::exp(-0.5 * z * z) / std::sqrt(2 * std::numbers::pi);
    }
  }
  // z within ± reach.
  void look_up(double z, double& cumulative, double& density) const {
    const double at = (z + reach) * per_unit;
    const auto i = std::min(static_cast<std::size_t>(at), cumulative_.size() - 2);
    const double f = at - static_cast<double>(i);
    cumulative = cumulative_[i] + f * (cumulative_[i + 1] - cumulative_[i]);
    density = density_[i] + f * (density_[i + 1] - density_[i]);
  }

 private:
  static constexpr double per_unit = 128;  // linear interpolation errs by 2e-6
  std::array<double, static_cast<std::size_t>(2 * reach * per_unit) + 1> cumulative_{};
  std::array<double, static_cast<std::size_t>(2 * reach * per_unit) + 1> density_{};
};

const NormalTable table;  // constant after start-up

// The weights of the cells around x on one axis, and their derivatives by x and by ln σ.
struct AxisWeights {
  static constexpr int most = 16;
  int first = 0;
  int count = 0;
  std::array<double, most> weight{}, slope{}, widening{};
};

// Nothing when the blur spans more cells than any tag that can be read.
bool axis_weights(double x, double sigma, int cells, AxisWeights& out) {
  out.first = std::clamp(static_cast<int>(std::floor(x - reach * sigma)), 0, cells - 1);
  const int last = std::clamp(static_cast<int>(std::floor(x + reach * sigma)), out.first, cells - 1);
  out.count = last - out.first + 1;
  if (out.count > AxisWeights::most) return false;
  double lower = 1, lower_density = 0, lower_z = 0;  // at the cell's lower edge; the first cell reaches to −∞
  for (int i = 0; i < out.count; ++i) {
    double upper = 0, upper_density = 0, upper_z = 0;  // the last cell reaches to +∞
    if (i + 1 < out.count) {
      upper_z = std::clamp((x - (out.first + i + 1)) / sigma, -reach, reach);
      table.look_up(upper_z, upper, upper_density);
    }
    const auto k = static_cast<std::size_t>(i);
    out.weight[k] = lower - upper;
    out.slope[k] = (lower_density - upper_density) / sigma;
    out.widening[k] = upper_z * upper_density - lower_z * lower_density;
    lower = upper, lower_density = upper_density, lower_z = upper_z;
  }
  return true;
}

}  // namespace

BlurredPattern::BlurredPattern(const TagPattern& pattern)
    : cells_(pattern.cells), border_(pattern.border_cells), values_(pattern.values.size()) {
  std::transform(pattern.values.begin(), pattern.values.end(), values_.begin(), [](TagPattern::Cell cell) {
    return cell == TagPattern::Cell::unspecified ? -1.0 : (cell == TagPattern::Cell::white ? 1.0 : 0.0);
  });
}

std::optional<BlurredPattern::Value> BlurredPattern::at(const Eigen::Vector2d& uv, const Eigen::Vector2d& blur) const {
  const Eigen::Vector2d x = cell_at(uv);
  const double cells_per_unit = 0.5 * border_;
  AxisWeights column, row;
  if (!axis_weights(x.x(), blur.x() * cells_per_unit, cells_, column) ||
      !axis_weights(x.y(), blur.y() * cells_per_unit, cells_, row))
    return std::nullopt;
  Value out;
  double per_column = 0, per_row = 0;
  for (int j = 0; j < row.count; ++j) {
    double weight = 0, slope = 0, widening = 0;
    for (int i = 0; i < column.count; ++i) {
      const double value = cell(column.first + i, row.first + j);
      if (value < 0) return std::nullopt;
      const auto k = static_cast<std::size_t>(i);
      weight += value * column.weight[k];
      slope += value * column.slope[k];
      widening += value * column.widening[k];
    }
    const auto k = static_cast<std::size_t>(j);
    out.value += row.weight[k] * weight;
    per_column += row.weight[k] * slope;
    per_row += row.slope[k] * weight;
    out.per_log_blur += row.weight[k] * widening + row.widening[k] * weight;
  }
  out.gradient = {per_column * cells_per_unit, -per_row * cells_per_unit};  // rows run against v
  return out;
}

CellVote::CellVote(const BlurredPattern& pattern)
    : pattern_(pattern),
      sums_(static_cast<std::size_t>(pattern.cells() * pattern.cells())),
      counts_(static_cast<std::size_t>(pattern.cells() * pattern.cells())) {}

void CellVote::add(const Eigen::Vector2d& uv, double normalized) {
  const Eigen::Vector2d x = pattern_.cell_at(uv);
  const Eigen::Vector2d within = (x - x.array().floor().matrix()).array() - 0.5;
  constexpr double middle = 0.4;  // half width: next to an edge the blur decides, not the cell
  if (within.cwiseAbs().maxCoeff() > middle || x.minCoeff() < 0 || x.maxCoeff() >= pattern_.cells()) return;
  const int k = static_cast<int>(x.y()) * pattern_.cells() + static_cast<int>(x.x());
  sums_[static_cast<std::size_t>(k)] += std::clamp(normalized, -1.0, 2.0);
  ++counts_[static_cast<std::size_t>(k)];
}

double CellVote::right_fraction() const {
  int specified = 0, seen = 0, right = 0;
  for (int k = 0; k < static_cast<int>(counts_.size()); ++k) {
    const double expected = pattern_.cell(k % pattern_.cells(), k / pattern_.cells());
    if (expected < 0) continue;
    ++specified;
    const int count = counts_[static_cast<std::size_t>(k)];
    if (count == 0) continue;
    ++seen;
    right += (sums_[static_cast<std::size_t>(k)] / count > 0.5) == (expected > 0.5) ? 1 : 0;
  }
  return 2 * seen < specified ? 0.0 : static_cast<double>(right) / seen;
}

}  // namespace mf
