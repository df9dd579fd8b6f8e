// SPDX-License-Identifier: Apache-2.0
#include "host/viewer/layout.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

namespace mf {
namespace {

TEST(Layout, PicturesKeepTheirAspectAndDoNotOverlap) {
  for (const auto& [width, height] : {std::pair{1280, 800}, {640, 400}, {2560, 700}, {700, 1600}}) {
    const LightFieldLayout l = light_field_layout(width, height, 1.5);
    const std::array<std::pair<Box, double>, 4> boxes{
        {{l.plane, 1.5}, {l.hemisphere, 1}, {l.distances, 1}, {l.panorama, 2}}};
    for (const auto& [box, aspect] : boxes) {
      EXPECT_NEAR(box.width, box.height * aspect, 2);
      EXPECT_GE(box.x, panel_width_px);
      EXPECT_GE(box.y, caption_height_px);
      EXPECT_LE(box.x + box.width, width);
      EXPECT_LE(box.y + box.height, height);
    }
    for (std::size_t a = 0; a < boxes.size(); ++a)
      for (std::size_t b = 0; b < a; ++b) {
        const Box &p = boxes[a].first, &q = boxes[b].first;
        const bool apart =
            p.x + p.width <= q.x || q.x + q.width <= p.x || p.y + p.height <= q.y || q.y + q.height <= p.y;
        EXPECT_TRUE(apart) << width << " × " << height << ": " << a << " and " << b;
      }
  }
}

TEST(Layout, PositionsAreFractionsOfTheBox) {
  const Box box{100, 50, 200, 80};
  EXPECT_TRUE(box.position_of({150, 90}).isApprox(Eigen::Vector2d(0.25, 0.5)));
  EXPECT_TRUE(box.pixel_of({0.25, 0.5}).isApprox(Eigen::Vector2d(150, 90)));
  EXPECT_TRUE(box.holds({100, 50}));
  EXPECT_FALSE(box.holds({300, 60}));
}

}  // namespace
}  // namespace mf
