// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "host/light_field/hole_filler.h"
#include "host/light_field/probe.h"
#include "host/light_field/resample.h"
#include "tests/host/light_field/synthetic_views.h"

namespace mf {
namespace {

const PlaneRectangle square{{}, {-0.2, -0.2}, {0.2, 0.2}};

Eigen::Vector3f sky(const Eigen::Vector3f&, const Eigen::Vector3f& d) {
  return {1 + 0.5F * d.x(), 1 + 0.5F * d.y(), 0.5F + d.z() * d.z()};
}

// No view looks towards +x between two heights.
std::vector<FieldView> views_with_a_hole() {
  std::vector<FieldView> views;
  for (FieldView& view : testing::analytic_views(400, 0.25F, 48, sky)) {
    const Eigen::Vector3f axis = view.pixel_from_world.row(2).head<3>().normalized();
    if (axis.x() < 0.35F) views.push_back(std::move(view));
  }
  return views;
}

ResampleResult resampled(const std::vector<FieldView>& views, bool fill, const std::string& proxy,
                         const PlaneRectangle& rectangle = square) {
  ResampleOptions options;
  options.directions = 400;
  options.size = 8;
  options.proxy = proxy;
  options.fill = fill;
  return resample(views, rectangle, options, {});
}

TEST(PullPush, KeepsWhatIsKnownAndClosesTheRest) {
  ImageF image(33, 20, 4);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      if (x >= 10 && x < 22 && y >= 5 && y < 15) continue;
      const float v = 1 + 0.02F * static_cast<float>(x);
      for (int c = 0; c < 3; ++c) image.at(x, y, c) = v;
      image.at(x, y, 3) = 1;
    }
  const ImageF before = image;
  pull_push(image, false, 0.25F);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const bool hole = before.at(x, y, 3) <= 0;
      EXPECT_EQ(image.at(x, y, 3), hole ? 0.25F : 1.0F);
      if (hole)
        EXPECT_NEAR(image.at(x, y), 1 + 0.02F * static_cast<float>(x), 0.12) << x << ' ' << y;
      else
        EXPECT_EQ(image.at(x, y), before.at(x, y));
    }
}

TEST(PullPush, ALampDoesNotFlowIntoAHole) {
  ImageF image(32, 16, 4, 1);
  for (int y = 4; y < 12; ++y)
    for (int x = 8; x < 16; ++x) std::fill_n(&image.at(x, y), 4, 0.0F);
  for (int y = 4; y < 12; ++y) std::fill_n(&image.at(16, y), 3, 5000.0F);
  pull_push(image, true, 1);
  EXPECT_EQ(image.at(16, 6), 5000);  // what is known stays
  for (int y = 4; y < 12; ++y)
    for (int x = 8; x < 16; ++x) EXPECT_LE(image.at(x, y), 4.0F);
}

TEST(Holes, AreFilledFromAroundAndStayMarked) {
  const auto views = views_with_a_hole();
  const ResampleResult black = resampled(views, false, "sphere:inf"), filled = resampled(views, true, "sphere:inf");
  EXPECT_EQ(black.filled_share, 0);
  int holes = 0, good = 0;
  for (std::size_t i = 0; i < filled.field.directions.size(); ++i)
    for (std::size_t t = 0; t < filled.field.texel_count(); ++t) {
      const Eigen::Vector4f &a = black.field.tile(i)[t], &b = filled.field.tile(i)[t];
      EXPECT_EQ(a.w(), b.w());
      if (a.w() > 0) {
        EXPECT_EQ(a, b);
        continue;
      }
      EXPECT_EQ(a, Eigen::Vector4f::Zero());
      const Eigen::Vector3f expected = sky({}, filled.field.directions.directions[i]);
      ++holes;
      good += (b.head<3>() - expected).norm() < 0.3F * expected.norm() ? 1 : 0;
    }
  EXPECT_GT(holes, 500);
  EXPECT_GT(good, holes * 8 / 10);
  EXPECT_NEAR(filled.filled_share, static_cast<double>(holes) / static_cast<double>(filled.field.rgbc.size()), 1e-9);
}

TEST(Holes, ProbesShowTheGuessWithoutConfidence) {
  const ResampleResult filled = resampled(views_with_a_hole(), true, "sphere:inf");
  const Probe probe = make_probe(filled.field, {0, 0, 0.02}, LatLongConvention::threejs, 64);
  // +x is at the centre: 15° above the horizon.
  EXPECT_EQ(probe.confidence.at(32, 13), 0);
  EXPECT_GT(probe.radiance.at(32, 13, 0), 0.8F);
}

// Guesses are means, which vary slowly: one for every fourth texel does, and what is known stays.
TEST(Holes, GuessesMayBeInterpolated) {
  ResampleOptions options;
  options.directions = 400;
  options.proxy = "sphere:1.2";
  const auto views = views_with_a_hole();
  const LightField field = Resampling(views, square, options, Team(), Progress()).field();
  const HoleFiller filler(field);
  constexpr int n = 16;
  const Eigen::Vector4f known(5, 5, 5, 1);
  int far_off = 0;
  for (std::size_t i = 0; i < field.directions.size(); ++i) {
    std::vector<Eigen::Vector4f> every(n * n, Eigen::Vector4f::Zero());
    every[n + 3] = known;
    std::vector<Eigen::Vector4f> fourth = every;
    EXPECT_EQ(filler.fill(i, square, n, every.data()), every.size() - 1);
    EXPECT_EQ(filler.fill(i, square, n, fourth.data(), 4), every.size() - 1);
    EXPECT_EQ(fourth[n + 3], known);
    for (std::size_t t = 0; t < every.size(); ++t) {
      const float off = (fourth[t] - every[t]).norm() / every[t].norm();
      EXPECT_LT(off, 0.1F) << i << ' ' << t;
      far_off += off > 0.03F ? 1 : 0;
    }
  }
  EXPECT_LT(far_off, static_cast<int>(field.directions.size() * n * n / 100));
}

// The plane proxy knows no panorama: a tile is closed by itself.
TEST(Holes, ThePlaneClosesItsTiles) {
  const auto views = testing::analytic_views(2, 0.1F, 48, sky);
  const PlaneRectangle wide{{}, {-1, -1}, {1, 1}};  // each sees a part of it
  const ResampleResult black = resampled(views, false, "plane", wide), filled = resampled(views, true, "plane", wide);
  std::size_t holes = 0;
  for (std::size_t i = 0; i < filled.field.directions.size(); ++i) {
    bool any = false;
    for (std::size_t t = 0; t < filled.field.texel_count(); ++t) any = any || black.field.tile(i)[t].w() > 0;
    for (std::size_t t = 0; t < filled.field.texel_count(); ++t) {
      if (black.field.tile(i)[t].w() > 0) continue;
      holes += any ? 1 : 0;
      EXPECT_EQ(filled.field.tile(i)[t].head<3>().norm() > 0, any);
    }
  }
  EXPECT_GT(holes, 0U);
}

}  // namespace
}  // namespace mf
