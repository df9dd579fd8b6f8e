// SPDX-License-Identifier: Apache-2.0
#include "hw-sim/printed_tags.h"

namespace mf::sim {

void PrintedTags::add(const std::string& family, int id, const Eigen::Vector2d& centre_m, double size_m) {
  Tag tag{tag_pattern(family, id), {}, 0};
  const double cell = size_m / tag.pattern.border_cells;  // a tag's size is that of the square which detectors report
  const double half_grid = 0.5 * cell * tag.pattern.cells;
  tag.upper_left_m = (centre_m + Eigen::Vector2d(-half_grid, half_grid)).cast<float>();
  tag.cells_per_m = static_cast<float>(1 / cell);
  tags_.push_back(std::move(tag));
}

std::optional<bool> PrintedTags::is_white(const Eigen::Vector2f& p_m) const {
  for (const Tag& tag : tags_) {
    const float column = (p_m.x() - tag.upper_left_m.x()) * tag.cells_per_m;
    const float row = (tag.upper_left_m.y() - p_m.y()) * tag.cells_per_m;
    const float cells = static_cast<float>(tag.pattern.cells);
    if (column < 0 || row < 0 || column >= cells || row >= cells) continue;
    return tag.pattern.at(static_cast<int>(column), static_cast<int>(row)) != TagPattern::Cell::black;
  }
  return std::nullopt;
}

}  // namespace mf::sim
