// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "common/tag_pattern.h"

namespace mf {

// A tag's pattern, black 0 and white 1, convolved with a Gaussian, and its derivatives: exact along straight edges, and
// separable (no correlation of the blur in u and v) at their crossings.
//
//   T(u, v) = Σ c_ij B_i(u) B_j(v),   B_i(u) = Φ((u − u_i)/σ_u) − Φ((u − u_{i+1})/σ_u)
//
// Tag coordinates: ± 1 at the corners of the border, u right, v up. Beyond the outermost cells their value goes on.
class BlurredPattern {
 public:
  struct Value {
    double value = 0;
    Eigen::Vector2d gradient;  // per u and v
    double per_log_blur = 0;   // derivative by ln σ
  };

  explicit BlurredPattern(const TagPattern& pattern);

  // `blur`: standard deviation along u and v, in tag coordinates. Nothing near cells that the family leaves open.
  [[nodiscard]] std::optional<Value> at(const Eigen::Vector2d& uv, const Eigen::Vector2d& blur) const;

  // Column (x) and row (y), fractional, of a place on the tag.
  [[nodiscard]] Eigen::Vector2d cell_at(const Eigen::Vector2d& uv) const {
    return {0.5 * (border_ * uv.x() + cells_), 0.5 * (cells_ - border_ * uv.y())};
  }
  [[nodiscard]] int cells() const { return cells_; }
  // 0, 1, or below 0 where the family leaves the cell open. Precondition: inside the grid.
  [[nodiscard]] double cell(int column, int row) const {
    return values_[static_cast<std::size_t>(row * cells_ + column)];
  }

 private:
  int cells_;
  int border_;
  std::vector<double> values_;
};

// Which cells a picture confirms: the mean of normalized values (0 black, 1 white) over each cell's middle.
class CellVote {
 public:
  explicit CellVote(const BlurredPattern& pattern);
  void add(const Eigen::Vector2d& uv, double normalized);
  // Of the cells that were seen; 0 when fewer than half of them were.
  [[nodiscard]] double right_fraction() const;

 private:
  const BlurredPattern& pattern_;
  std::vector<double> sums_;
  std::vector<int> counts_;
};

}  // namespace mf
