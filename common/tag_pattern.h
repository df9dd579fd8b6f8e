// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace mf {

// What is printed on a tag: a square grid of cells, first row at the top as the tag is read.
struct TagPattern {
  enum class Cell : std::uint8_t { black, white, unspecified };  // unspecified: the family leaves the cell open

  int cells = 0;         // edge of the grid, the border that the family asks for included
  int border_cells = 0;  // edge, in cells, of the square whose corners a detector reports; it is centred in the grid
  std::vector<Cell> values;

  [[nodiscard]] Cell at(int column, int row) const {
    return values[static_cast<std::size_t>(row) * static_cast<std::size_t>(cells) + static_cast<std::size_t>(column)];
  }
};

// Throws InputError (field "family" or "id") for a family that is not known or has no such tag.
[[nodiscard]] TagPattern tag_pattern(const std::string& family, int id);

}  // namespace mf
