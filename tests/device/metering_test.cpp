// SPDX-License-Identifier: Apache-2.0
#include "device/metering.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/device/scene_camera.h"
#include "tests/support/expect_input_error.h"

namespace mf {
namespace {

using test::SceneCamera;

enum class Has { linear, multi_slope, linlog };

constexpr double black_level = 64;
const PixelFormat mono12{PixelLayout::mono, 12};

void give(test::PickyFeatures& f, Has has) {
  if (has == Has::multi_slope) {
    const std::string selector = "MultiSlopeKneePointSelector";
    f.choices["MultiSlopeMode"] = {"Off", {"Off", "Manual"}};
    f.numbers["MultiSlopeKneePointCount"] = {.value = 1, .low = 1, .high = 3, .whole = true};
    f.numbers[selector] = {.value = 1, .low = 1, .high = 3, .whole = true};
    for (const char* feature : {"MultiSlopeExposureLimit", "MultiSlopeSaturationThreshold"})
      f.numbers[feature] = {.value = 100, .low = 0, .high = 100, .selector = selector};
  } else if (has == Has::linlog) {
    f.choices["LinLog_Mode"] = {"Off", {"Off", "UserDefined"}};
    for (const char* v : {"LinLog_Value1", "LinLog_Value2"}) f.numbers[v] = {.high = 200, .whole = true};
    for (const char* t : {"LinLog_Time1", "LinLog_Time2"}) f.numbers[t] = {.value = 1000, .high = 1000, .whole = true};
  }
}

// A room: walls from dark to bright, two tags printed on paper of this light, and a lamp `contrast` times the paper on
// half a percent of the picture.
constexpr int tag_px = 24;
constexpr std::array<std::array<int, 2>, 2> tags_at{{{12, 60}, {80, 60}}};
ImageF room(double paper, double contrast) {
  ImageF light(128, 96, 1);
  for (int y = 0; y < 96; ++y)
    for (int x = 0; x < 128; ++x) light.at(x, y) = static_cast<float>(paper * (0.05 + 0.7 * x / 128));
  for (const auto& [left, top] : tags_at)
    for (int y = 0; y < tag_px; ++y)
      for (int x = 0; x < tag_px; ++x)
        light.at(left + x, top + y) = static_cast<float>(paper * ((x / 4 + y / 4) % 2 == 0 ? 1 : 0.06));
  for (int y = 8; y < 16; ++y)
    for (int x = 60; x < 68; ++x) light.at(x, y) = static_cast<float>(paper * contrast);
  return light;
}

std::vector<TagDetection> the_tags(const ImageU16& /*codes*/, const ResponseCurve& /*curve*/) {
  std::vector<TagDetection> tags;
  for (const auto& [left, top] : tags_at) {
    TagDetection tag;
    tag.corners_px = {Eigen::Vector2d(left, top + tag_px), Eigen::Vector2d(left + tag_px, top + tag_px),
                      Eigen::Vector2d(left + tag_px, top), Eigen::Vector2d(left, top)};
    tags.push_back(tag);
  }
  return tags;
}

struct Outcome {
  MeteringResult result;
  double clipped_share = 0;  // of a frame afterwards, by the forward model
  double tag_contrast = 0;
};

Outcome outcome_of(Has has, double paper, double contrast, bool with_tags, const MeteringOptions& options,
                   const SceneCamera::Limits& limits = {}) {
  SceneCamera camera(room(paper, contrast), mono12, black_level, limits);
  give(camera.picky(), has);
  Outcome outcome;
  outcome.result = meter(camera, options, with_tags ? FindTags(the_tags) : FindTags{});
  const SensorResponse response = camera.response_now();
  const double t = outcome.result.exposure_s;
  const auto charge = [&](double light) { return charge_of(response, light * t); };
  outcome.clipped_share = charge(paper * contrast) >= 1 ? 64.0 / (128 * 96) : 0;
  outcome.tag_contrast = charge(paper) - charge(0.06 * paper);
  return outcome;
}

MeteringOptions options_for_test() {
  MeteringOptions o;
  o.least_exposure_s = 2e-6;
  o.black_level = black_level;
  o.most_seconds = 20;  // of this machine's; the camera's own time is counted in frames
  return o;
}

// Six decades of light on the paper, from 0.1 to 10⁵ linear pixels a second, each with lamps of up to 10⁴ times that.
TEST(Metering, SixDecadesOfLight) {
  const MeteringOptions o = options_for_test();
  for (const Has has : {Has::linear, Has::multi_slope, Has::linlog}) {
    int settings = 0, readable = 0, survived = 0, most_frames = 0;
    for (double decade = -1; decade <= 5; decade += 1)
      for (const double contrast : {3.0, 1e4})
        for (const bool with_tags : {true, false}) {
          const double paper = std::pow(10, decade);
          const Outcome outcome = outcome_of(has, paper, contrast, with_tags, o);
          const std::string where = std::to_string(static_cast<int>(has)) + " paper " + std::to_string(paper) +
                                    " contrast " + std::to_string(contrast) + (with_tags ? " tags" : "");
          EXPECT_TRUE(outcome.result.settled) << where;
          EXPECT_LE(outcome.result.frames, 74) << where;  // 2 s at 37 frames a second
          most_frames = std::max(most_frames, outcome.result.frames);
          ++settings;
          const bool bright = outcome.tag_contrast >= o.tag_contrast;
          const bool kept = outcome.clipped_share <= o.clipped_share;
          readable += bright ? 1 : 0;
          survived += kept ? 1 : 0;
          // At the longest exposure that motion allows this much light is needed.
          if (paper * 0.94 * o.most_exposure_s > 1.3 * o.tag_contrast) {
            EXPECT_TRUE(bright) << where;
          }
          if (has != Has::linear) {
            EXPECT_TRUE(kept) << where;
          } else if (contrast < 10) {
            EXPECT_TRUE(kept) << where;  // a linear sensor holds what its tags allow
          } else if (!kept) {
            // And gave all that it could: without tags their print's contrast is taken as 8.
            const double most = (with_tags ? 1.5 : 8) * o.tag_contrast;
            EXPECT_TRUE(outcome.tag_contrast < most || outcome.result.exposure_s <= 1.01 * o.least_exposure_s) << where;
            EXPECT_FALSE(outcome.result.remarks.empty()) << where;
          }
        }
    std::printf("%s: %d settings, tags readable in %d, brightest kept in %d, at most %d frames\n",
                has == Has::linear        ? "linear"
                : has == Has::multi_slope ? "multi-slope"
                                          : "LinLog",
                settings, readable, survived, most_frames);
  }
}

TEST(Metering, ALinearSensorIsExposedToItsEndAndNotBeyond) {
  const Outcome outcome = outcome_of(Has::linear, 100, 3, true, options_for_test());
  EXPECT_NEAR(300 * outcome.result.exposure_s, 0.85, 0.08);
  EXPECT_EQ(outcome.clipped_share, 0);
  EXPECT_TRUE(outcome.result.remarks.empty()) << outcome.result.remarks.front();
}

TEST(Metering, ACompressingSensorStaysLinearWhereThatIsEnough) {
  const Outcome outcome = outcome_of(Has::multi_slope, 100, 1.2, true, options_for_test());
  EXPECT_TRUE(std::holds_alternative<LinearSensor>(outcome.result.response.in_force));
}

TEST(Metering, MotionBlurAndTheFramesPeriodBoundTheExposure) {
  MeteringOptions o = options_for_test();
  o.most_exposure_s = 0.004;
  Outcome dark = outcome_of(Has::linear, 1, 3, true, o);
  EXPECT_DOUBLE_EQ(dark.result.exposure_s, 0.004);
  EXPECT_TRUE(dark.result.settled);
  ASSERT_FALSE(dark.result.remarks.empty());
  EXPECT_TRUE(test::contains(dark.result.remarks.back(), "contrast"));
  o.most_exposure_s = 1;
  dark = outcome_of(Has::linear, 1, 3, true, o);
  EXPECT_NEAR(dark.result.exposure_s, 0.95 / 37, 1e-9);
}

TEST(Metering, ACamerasOwnLimitsAreRespected) {
  // No exposure below 1 ms: what is clipped then is said.
  const Outcome bright = outcome_of(Has::linear, 1e4, 3, true, options_for_test(), {.least_s = 1e-3});
  EXPECT_DOUBLE_EQ(bright.result.exposure_s, 1e-3);
  EXPECT_TRUE(bright.result.settled);
  ASSERT_FALSE(bright.result.remarks.empty());
  EXPECT_TRUE(test::contains(bright.result.remarks.back(), "brighter than the camera can record"));
  // Whole percents only: the knee comes no later than at 99 %.
  SceneCamera camera(room(100, 1e4), mono12, black_level, {});
  give(camera.picky(), Has::multi_slope);
  camera.picky().numbers["MultiSlopeExposureLimit"].high = 99;
  camera.picky().numbers["MultiSlopeExposureLimit"].clips = true;
  camera.picky().numbers["MultiSlopeExposureLimit"].whole = true;
  const MeteringResult result = meter(camera, options_for_test(), the_tags);
  EXPECT_TRUE(result.settled);
  EXPECT_LT(charge_of(camera.response_now(), 1e6 * result.exposure_s), 1);
}

TEST(Metering, SettingsThatArriveLateDoNotMislead) {
  for (const int latency : {0, 3}) {
    MeteringOptions o = options_for_test();
    o.settle_frames = 4;
    const Outcome outcome = outcome_of(Has::linear, 5000, 3, true, o, {.latency_frames = latency});
    EXPECT_NEAR(15000 * outcome.result.exposure_s, 0.85, 0.08);
  }
}

TEST(Metering, TimeThatIsOverIsSaid) {
  MeteringOptions o = options_for_test();
  o.most_seconds = 1e-9;
  const Outcome outcome = outcome_of(Has::linear, 100, 3, false, o);
  EXPECT_FALSE(outcome.result.settled);
  EXPECT_TRUE(test::contains(outcome.result.remarks.back(), "did not settle"));
}

TEST(Metering, BadOptionsAreRefused) {
  SceneCamera camera(room(1, 1), mono12, black_level, {});
  MeteringOptions o;
  o.tag_white = 0.9;
  EXPECT_TRUE(test::contains(test::input_error_of([&] { (void)meter(camera, o); }), "tag_white"));
}

}  // namespace
}  // namespace mf
