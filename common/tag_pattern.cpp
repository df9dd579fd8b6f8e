// SPDX-License-Identifier: Apache-2.0
#include "common/tag_pattern.h"

#include <apriltag/apriltag.h>
#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagCircle21h7.h>
#include <apriltag/tagStandard41h12.h>
#include <apriltag/tagStandard52h13.h>
#include <fmt/format.h>

#include "common/error.h"
#include "common/tag_family.h"

namespace mf {

namespace {

struct KnownFamily {
  const char* name;
  apriltag_family_t* (*create)();
  void (*destroy)(apriltag_family_t*);
};

constexpr KnownFamily known_families[] = {
    {"tag36h11", tag36h11_create, tag36h11_destroy},
    {"tag25h9", tag25h9_create, tag25h9_destroy},
    {"tag16h5", tag16h5_create, tag16h5_destroy},
    {"tagCircle21h7", tagCircle21h7_create, tagCircle21h7_destroy},
    {"tagStandard41h12", tagStandard41h12_create, tagStandard41h12_destroy},
    {"tagStandard52h13", tagStandard52h13_create, tagStandard52h13_destroy},
};

// The ring of cells just inside the centred square of `edge` cells.
void fill_ring(TagPattern& pattern, int edge, TagPattern::Cell value) {
  const int first = (pattern.cells - edge) / 2;
  const int last = first + edge - 1;
  if (first < 0) return;
  const auto set = [&](int column, int row) {
    pattern.values[static_cast<std::size_t>(row * pattern.cells + column)] = value;
  };
  for (int i = first; i <= last; ++i) {
    set(i, first);
    set(i, last);
    set(first, i);
    set(last, i);
  }
}

}  // namespace

TagFamily make_tag_family(const std::string& name) {
  for (const KnownFamily& known : known_families)
    if (name == known.name) return {known.create(), TagFamilyDeleter{known.destroy}};
  throw InputError("tag family", "family",
                   fmt::format("'{}' is not known: use tag36h11, tag25h9, tag16h5, tagCircle21h7, tagStandard41h12 or "
                               "tagStandard52h13",
                               name));
}

TagPattern tag_pattern(const std::string& family_name, int id) {
  const TagFamily family = make_tag_family(family_name);
  if (id < 0 || static_cast<std::uint32_t>(id) >= family->ncodes)
    throw InputError("tag family", "id",
                     fmt::format("{} has the tags 0 to {}, no {}", family_name, family->ncodes - 1, id));
  TagPattern pattern;
  pattern.cells = family->total_width;
  pattern.border_cells = family->width_at_border;
  pattern.values.assign(static_cast<std::size_t>(pattern.cells * pattern.cells), TagPattern::Cell::unspecified);
  // Classic families: a black ring inside the border, a white one outside; the standard ones the other way round.
  const bool reversed = family->reversed_border;
  fill_ring(pattern, pattern.border_cells + 2, reversed ? TagPattern::Cell::black : TagPattern::Cell::white);
  fill_ring(pattern, pattern.border_cells, reversed ? TagPattern::Cell::white : TagPattern::Cell::black);
  const int first = (pattern.cells - pattern.border_cells) / 2;
  const std::uint64_t code = family->codes[id];
  for (std::uint32_t bit = 0; bit < family->nbits; ++bit) {
    const int column = static_cast<int>(family->bit_x[bit]) + first;
    const int row = static_cast<int>(family->bit_y[bit]) + first;
    const bool white = ((code >> (family->nbits - 1 - bit)) & 1U) != 0;
    pattern.values[static_cast<std::size_t>(row * pattern.cells + column)] =
        white ? TagPattern::Cell::white : TagPattern::Cell::black;
  }
  return pattern;
}

}  // namespace mf
