// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/atlas.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

namespace mf {
namespace {

AtlasLimits limits() {
  return {512, 4096, 2048, 4 * 512 * 512, 8};
}

// Every texel of every layer belongs to one rectangle at most.
void expect_apart(const Atlas& atlas, const std::vector<std::array<int, 2>>& sizes) {
  std::map<std::array<int, 2>, std::vector<char>> taken;
  const auto side = static_cast<std::size_t>(atlas.side);
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const AtlasPlace& at = atlas.places[i];
    ASSERT_LT(static_cast<std::size_t>(at.page), atlas.layers.size());
    ASSERT_LT(at.layer, atlas.layers[static_cast<std::size_t>(at.page)]);
    ASSERT_LE(at.x + sizes[i][0], atlas.side);
    ASSERT_LE(at.y + sizes[i][1], atlas.side);
    auto& layer = taken[{at.page, at.layer}];
    layer.resize(side * side);
    for (int y = at.y; y < at.y + sizes[i][1]; ++y)
      for (int x = at.x; x < at.x + sizes[i][0]; ++x)
        ASSERT_EQ(layer[static_cast<std::size_t>(y) * side + static_cast<std::size_t>(x)]++, 0) << "rectangle " << i;
  }
}

TEST(Atlas, RectanglesOfAllSizesLieApartAndClose) {
  std::mt19937 random(3);
  std::uniform_int_distribution<int> size(1, 200);
  std::vector<std::array<int, 2>> sizes;
  double texels = 0;
  for (int i = 0; i < 400; ++i) {
    sizes.push_back({size(random), size(random)});
    texels += sizes.back()[0] * sizes.back()[1];
  }
  const auto atlas = pack_atlas(sizes, limits());
  ASSERT_TRUE(atlas);
  expect_apart(*atlas, sizes);
  int layers = 0;
  for (const int of_page : atlas->layers) layers += of_page;
  EXPECT_GT(texels / (512.0 * 512 * layers), 0.8);
  EXPECT_GT(atlas->layers.size(), 1U);  // pages of four layers
}

TEST(Atlas, PagesGrowWhenTheyDoNotSuffice) {
  const std::vector<std::array<int, 2>> sizes(100, {512, 512});
  const auto atlas = pack_atlas(sizes, limits());
  ASSERT_TRUE(atlas);
  expect_apart(*atlas, sizes);
  EXPECT_EQ(atlas->layers, (std::vector<int>{13, 13, 13, 13, 13, 13, 13, 9}));
}

TEST(Atlas, ALargeRectangleHasLargeLayers) {
  const std::vector<std::array<int, 2>> sizes{{700, 30}, {4000, 8}, {10, 300}};
  const auto atlas = pack_atlas(sizes, limits());
  ASSERT_TRUE(atlas);
  EXPECT_EQ(atlas->side, 4000);
  expect_apart(*atlas, sizes);
}

TEST(Atlas, WhatDoesNotFitIsTold) {
  EXPECT_FALSE(pack_atlas(std::vector<std::array<int, 2>>{{4097, 1}}, limits()));
  AtlasLimits few = limits();
  few.largest_layers = 12;
  EXPECT_FALSE(pack_atlas(std::vector<std::array<int, 2>>(100, {512, 512}), few));
}

}  // namespace
}  // namespace mf
