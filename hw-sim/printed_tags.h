// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "common/tag_pattern.h"

namespace mf::sim {

// Tags printed on a plane: x right and y up as the tags are read, metres.
class PrintedTags {
 public:
  // Throws InputError for a family or an id that does not exist.
  void add(const std::string& family, int id, const Eigen::Vector2d& centre_m, double size_m);

  // Whether the ink at a point is white; nothing where no tag (nor its white margin) is printed.
  [[nodiscard]] std::optional<bool> is_white(const Eigen::Vector2f& p_m) const;

 private:
  struct Tag {
    TagPattern pattern;
    Eigen::Vector2f upper_left_m;  // of the whole grid, margin included
    float cells_per_m;
  };
  std::vector<Tag> tags_;
};

}  // namespace mf::sim
