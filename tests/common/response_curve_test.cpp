// SPDX-License-Identifier: Apache-2.0
#include "common/response_curve.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "common/error.h"

namespace mf {
namespace {

Frame frame_of(ImageU16 codes, double exposure_s, double nd_density = 0) {
  Frame frame;
  frame.info.exposure_s = exposure_s;
  frame.info.nd_density = nd_density;
  frame.pixels = std::move(codes);
  return frame;
}

TEST(ResponseCurve, LinearModelIsTheLine) {
  const ResponseCurve curve = linear_response(12, 64, 4031, 1);
  EXPECT_DOUBLE_EQ(curve.exposure_of(0, 64), 0);
  EXPECT_NEAR(curve.exposure_of(0, 1064.5), 1000.5, 1e-9);
  EXPECT_NEAR(curve.code_of(0, 250.25), 314.25, 1e-9);
  EXPECT_DOUBLE_EQ(curve.exposure_of(0, 12), 0);
}

TEST(ResponseCurve, LinLogHasAContinuousSlopeAtTheKneeAndReachesFullScale) {
  const double knee = 0.02, full = 10;
  const ResponseCurve curve = linlog_response(12, 64, knee, full, 3);
  ASSERT_EQ(curve.channels.size(), 3U);
  EXPECT_NEAR(curve.code_of(2, full), 4095, 1e-6);
  const double at_knee = curve.code_of(0, knee);
  const double below = at_knee - curve.code_of(0, 0.99 * knee), above = curve.code_of(0, 1.01 * knee) - at_knee;
  EXPECT_NEAR(above / below, 1, 0.02);
  // Above the knee equal ratios of light are equal steps of code.
  EXPECT_NEAR(curve.code_of(0, 8) - curve.code_of(0, 4), curve.code_of(0, 1) - curve.code_of(0, 0.5), 0.02);
}

TEST(ResponseCurve, CodeAndExposureAreInverse) {
  for (const ResponseCurve& curve : {linear_response(12, 64.3, 1, 1), linlog_response(12, 63.7, 0.01, 5, 1)})
    for (double code = 63.75; code < 4095; code += 7.3) {
      if (code <= curve.black_level) continue;
      EXPECT_NEAR(curve.code_of(0, curve.exposure_of(0, code)), code, 1e-6);
    }
}

TEST(ResponseCurve, AFractionalBlackLevelKeepsTheToeALine) {
  const ResponseCurve curve = linear_response(12, 64.3, 4095 - 64.3, 1);
  EXPECT_NEAR(curve.code_of(0, 0.1), 64.4, 1e-9);  // not on the chord from code 64 to 65
  EXPECT_NEAR(curve.exposure_of(0, 64.5), 0.2, 1e-9);
  EXPECT_NEAR(curve.exposure_of(0, 64.2), 0, 0);
}

TEST(Linearize, DividesByExposureAndFilterAndScales) {
  ResponseCurve curve = linear_response(12, 64, 4031, 1);
  curve.radiance_scale = {2};
  ImageU16 codes(3, 1, 1);
  codes.data = {64, 164, 1064};
  const ImageF radiance = linearize(frame_of(codes, 0.01, 1), {PixelLayout::mono, 12, false}, curve);
  EXPECT_NEAR(radiance.at(0, 0), 0, 0);
  EXPECT_NEAR(radiance.at(1, 0), 2 * 100 / 0.001, 0.1);
  EXPECT_NEAR(radiance.at(2, 0), 2 * 1000 / 0.001, 1);
}

TEST(Linearize, BayerPixelsUseTheirOwnChannel) {
  ResponseCurve curve = linear_response(12, 0, 4095, 3);
  curve.radiance_scale = {1, 10, 100};
  for (const PixelLayout layout :
       {PixelLayout::bayer_rg, PixelLayout::bayer_gr, PixelLayout::bayer_gb, PixelLayout::bayer_bg}) {
    const ImageF radiance = linearize(frame_of(ImageU16(5, 4, 1, 7), 1), {layout, 12, false}, curve);
    for (int y = 0; y < 4; ++y)
      for (int x = 0; x < 5; ++x)
        EXPECT_FLOAT_EQ(radiance.at(x, y), static_cast<float>(7 * std::pow(10, colour_at(layout, x, y))));
  }
}

TEST(Linearize, RgbChannelsUseTheirOwnTable) {
  ResponseCurve curve = linear_response(8, 0, 255, 3);
  curve.radiance_scale = {1, 10, 100};
  const ImageF radiance = linearize(frame_of(ImageU16(4, 2, 3, 3), 1), {PixelLayout::rgb, 8, false}, curve);
  for (int x = 0; x < 4; ++x)
    for (int c = 0; c < 3; ++c) EXPECT_FLOAT_EQ(radiance.at(x, 1, c), static_cast<float>(3 * std::pow(10, c)));
}

TEST(Linearize, SaturatedPixelsKeepTheBound) {
  ResponseCurve curve = linear_response(12, 0, 4095, 1);
  curve.saturation_code = 4000;
  ImageU16 codes(3, 1, 1);
  codes.data = {3999, 4050, 65535};  // the last is beyond the table
  const ImageF radiance = linearize(frame_of(codes, 1), {PixelLayout::mono, 12, false}, curve);
  EXPECT_FLOAT_EQ(radiance.at(0, 0), 3999);
  EXPECT_FLOAT_EQ(radiance.at(1, 0), 4000);
  EXPECT_FLOAT_EQ(radiance.at(2, 0), 4000);
}

TEST(Linearize, LinearFloatFramesAreOnlyScaled) {
  ResponseCurve identity = linear_response(1, 0, 1, 3);
  identity.saturation_code = std::numeric_limits<double>::infinity();
  identity.radiance_scale = {1, 2, 4};
  Frame frame = frame_of({}, 0.5);
  frame.pixels = ImageF(2, 2, 3, 100.0F);
  const ImageF radiance = linearize(frame, {PixelLayout::rgb, 16, true}, identity);
  EXPECT_FLOAT_EQ(radiance.at(1, 1, 0), 200);
  EXPECT_FLOAT_EQ(radiance.at(1, 1, 2), 800);
}

TEST(Linearize, TakesTheVignettingOut) {
  ResponseCurve curve = linear_response(12, 0, 4095, 1);
  curve.vignetting = {{2, 2}, 2, {-0.5, 0, 0}};
  const ImageF radiance = linearize(frame_of(ImageU16(4, 4, 1, 1000), 1), {PixelLayout::mono, 12, false}, curve);
  EXPECT_FLOAT_EQ(radiance.at(0, 0), static_cast<float>(1000 / (1 - 0.5 * 4.5 / 4)));
}

TEST(ResponseJson, RoundTrip) {
  ResponseCurve curve = linlog_response(10, 30.25, 0.05, 3, 3);
  curve.channels[1].observed[700] = false;
  curve.channels[2].relative_sigma[12] = 0.125;
  curve.radiance_scale = {1.5, 2, 3};
  curve.absolute = true;
  curve.vignetting = {{100, 50}, 120, {-0.1, 0.02, 0}};
  const ResponseCurve back = response_curve_from_json(to_json(curve), "response.json");
  EXPECT_EQ(back.black_level, curve.black_level);
  EXPECT_EQ(back.channels[0].exposure, curve.channels[0].exposure);
  EXPECT_FALSE(back.channels[1].observed[700]);
  EXPECT_EQ(back.channels[2].relative_sigma[12], 0.125);
  EXPECT_EQ(back.radiance_scale, curve.radiance_scale);
  EXPECT_TRUE(back.absolute);
  EXPECT_EQ(back.vignetting.coefficients, curve.vignetting.coefficients);
  ResponseCurve endless = curve;
  endless.saturation_code = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(std::isinf(response_curve_from_json(to_json(endless), "response.json").saturation_code));
}

// Each fault is one line that names the file and the field.
void expect_refused(const nlohmann::json& json, const std::string& field) {
  try {
    (void)response_curve_from_json(json, "response.json");
    ADD_FAILURE() << "accepted a bad " << field;
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("response.json"), std::string::npos) << e.what();
    EXPECT_NE(std::string(e.what()).find(field), std::string::npos) << e.what();
  }
}

TEST(ResponseJson, RefusesWhatIsNoResponse) {
  const nlohmann::json good = to_json(linear_response(8, 4, 1, 1));
  nlohmann::json bad = good;
  bad["exposure"][0][9] = 99.0;  // falls again afterwards
  expect_refused(bad, "exposure[0]");
  bad = good;
  bad["observed"][0].erase(3);
  expect_refused(bad, "observed[0]");
  bad = good;
  bad["radiance_scale"] = {-1};
  expect_refused(bad, "radiance_scale");
  bad = good;
  bad["black_level"] = 300;
  expect_refused(bad, "black_level");
  bad = good;
  bad.erase("exposure");
  expect_refused(bad, "exposure");
}

}  // namespace
}  // namespace mf
