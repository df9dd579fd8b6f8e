// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

namespace mf {

// Rectangles of any sizes in square layers, and layers in pages: each page is one array texture.
struct AtlasLimits {
  int side = 2048;         // texels of a layer, at least: the longest rectangle may ask for more
  int largest_side = 0;    // what a texture can have
  int largest_layers = 0;  // what a texture can have
  int page_texels = 1;     // wanted of a page at most: more when the pages do not suffice, or a layer alone has more
  int pages = 8;           // at most
};

struct AtlasPlace {
  int page = 0;
  int layer = 0;
  int x = 0;
  int y = 0;
};

struct Atlas {
  int side = 0;                    // texels of every layer
  std::vector<int> layers;         // of each page
  std::vector<AtlasPlace> places;  // of each rectangle
};

// Sizes are {width, height} ≥ 1. Rectangles lie on shelves, the highest first, each on the first shelf that has room
// for it. Nothing when they are larger or more than the limits allow.
[[nodiscard]] std::optional<Atlas> pack_atlas(std::span<const std::array<int, 2>> sizes, const AtlasLimits&);

}  // namespace mf
