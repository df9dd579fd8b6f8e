// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/atlas.h"

#include <algorithm>
#include <cstddef>
#include <numeric>

namespace mf {

namespace {

struct Shelf {
  int layer = 0;
  int y = 0;
  int height = 0;
  int filled = 0;  // texels from its left end
};

// Layers are counted through; places have them as if there were one page.
class Shelves {
 public:
  explicit Shelves(int side) : side_(side) {}

  AtlasPlace put(int width, int height) {
    Shelf& shelf = shelf_for(width, height);
    const AtlasPlace place{0, shelf.layer, shelf.filled, shelf.y};
    shelf.filled += width;
    return place;
  }
  [[nodiscard]] int layers() const { return static_cast<int>(heights_.size()); }

 private:
  Shelf& shelf_for(int width, int height) {
    // Shelves that are full are passed over for good: rectangles become narrower with their height, as a rule.
    while (first_open_ < shelves_.size() && shelves_[first_open_].filled == side_) ++first_open_;
    for (std::size_t i = first_open_; i < shelves_.size(); ++i)
      if (height <= shelves_[i].height && shelves_[i].filled + width <= side_) return shelves_[i];
    const auto room = [&](int used) { return used + height <= side_; };
    const auto found = std::find_if(heights_.begin(), heights_.end(), room);
    const auto layer = static_cast<std::size_t>(found - heights_.begin());
    if (found == heights_.end()) heights_.push_back(0);
    shelves_.push_back({static_cast<int>(layer), heights_[layer], height, 0});
    heights_[layer] += height;
    return shelves_.back();
  }

  int side_;
  std::vector<int> heights_;  // of all shelves of a layer
  std::vector<Shelf> shelves_;
  std::size_t first_open_ = 0;
};

}  // namespace

std::optional<Atlas> pack_atlas(std::span<const std::array<int, 2>> sizes, const AtlasLimits& limits) {
  Atlas atlas;
  atlas.side = std::min(limits.side, limits.largest_side);
  for (const auto& [width, height] : sizes) atlas.side = std::max({atlas.side, width, height});
  if (atlas.side > limits.largest_side) return std::nullopt;
  std::vector<std::size_t> order(sizes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return sizes[a][1] > sizes[b][1]; });
  Shelves shelves(atlas.side);
  atlas.places.resize(sizes.size());
  for (const std::size_t i : order) atlas.places[i] = shelves.put(sizes[i][0], sizes[i][1]);
  const int layers = shelves.layers();
  const int fitting = std::clamp(limits.page_texels / atlas.side / atlas.side, 1, limits.largest_layers);
  const int a_page = std::max(fitting, (layers + limits.pages - 1) / limits.pages);
  if (a_page > limits.largest_layers) return std::nullopt;
  for (int first = 0; first < layers; first += a_page) atlas.layers.push_back(std::min(a_page, layers - first));
  for (AtlasPlace& place : atlas.places) {
    place.page = place.layer / a_page;
    place.layer %= a_page;
  }
  return atlas;
}

}  // namespace mf
