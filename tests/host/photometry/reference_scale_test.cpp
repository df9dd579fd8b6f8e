// SPDX-License-Identifier: Apache-2.0
#include "host/photometry/reference_scale.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "common/error.h"

namespace mf {
namespace {

Frame scene(std::uint16_t code) {
  Frame frame;
  frame.info.exposure_s = 0.5;
  frame.pixels = ImageU16(20, 10, 3, code);
  return frame;
}
const PixelFormat rgb8 = *parse_pixel_format("RGB8");

TEST(ReferenceScale, MakesTheDiscReadWhatTheMeterRead) {
  ResponseCurve curve = linear_response(8, 5, 250, 3);
  Frame frame = scene(40);
  // Only the pixels that the disc touches count: from x = 7 on.
  ImageU16& codes = std::get<ImageU16>(frame.pixels);
  codes.at(6, 5, 0) = 200;
  codes.at(10, 5, 0) = 72;
  const SessionHeader::Reference meter{"scene.png", 10, 5, 3, {7, 14, 0.5}};
  curve.radiance_scale = {9, 9, 9};  // what an earlier reading left must not matter
  curve.radiance_scale = reference_scale(meter, frame, rgb8, curve, "S");
  EXPECT_NEAR(curve.radiance_scale[1], 14 * 0.5 / 35, 1e-6);
  const ImageF picture = linearize(frame, rgb8, curve);
  double sum = 0;
  int count = 0;
  for (int y = 0; y < 10; ++y)
    for (int x = 0; x < 20; ++x)
      if (std::hypot(std::clamp(10., x + 0., x + 1.) - 10, std::clamp(5., y + 0., y + 1.) - 5) < 3) {
        sum += static_cast<double>(picture.at(x, y, 0));
        ++count;
      }
  EXPECT_NEAR(sum / count, 7, 1e-5);
}

const PixelFormat bayer{PixelLayout::bayer_rg, 12, false};

// A mosaic of a spot in which every pixel has a brightness of its own and one hue, and a reading of it.
struct Spot {
  Frame frame;
  SessionHeader::Reference meter{"scene.png", 20.5, 20.5, 3, {0, 0, 0}};
};
Spot textured_spot(std::mt19937& random, const std::vector<double>& gains) {
  std::normal_distribution<double> texture(0, 0.14);
  const std::vector<double> radiance{0.8, 0.6, 0.4};
  Spot spot;
  spot.frame.info.exposure_s = 1;
  ImageU16 codes(40, 40, 1);
  double count = 0;
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 40; ++x) {
      const double brightness = 1 + texture(random);
      const auto c = static_cast<std::size_t>(colour_at(PixelLayout::bayer_rg, x, y));
      codes.at(x, y) = static_cast<std::uint16_t>(64.5 + 1000 * gains[c] * radiance[c] * brightness);
      if (std::hypot(std::clamp(20.5, x + 0., x + 1.) - 20.5, std::clamp(20.5, y + 0., y + 1.) - 20.5) >= 3) continue;
      ++count;
      for (std::size_t k = 0; k < 3; ++k) spot.meter.radiance[k] += radiance[k] * brightness;
    }
  for (double& r : spot.meter.radiance) r /= count;
  spot.frame.pixels = codes;
  return spot;
}

// By channel, of many spots: RMS of scale · gain · 1000 − 1.
double relative_error(const std::vector<double>& gains) {
  std::mt19937 random(4);
  const ResponseCurve curve = linear_response(12, 64, 4031, 3);
  constexpr int rounds = 60;
  double squares = 0;
  for (int round = 0; round < rounds; ++round) {
    const Spot spot = textured_spot(random, gains);
    const std::vector<double> scale = reference_scale(spot.meter, spot.frame, bayer, curve, "S");
    for (std::size_t c = 0; c < 3; ++c) squares += std::pow(scale[c] * gains[c] * 1000 - 1, 2);
  }
  return std::sqrt(squares / (3 * rounds));
}

// The meter saw the same texture. A channel's own 12 or 21 pixels say it to 3 %; the channels agreeing, to half of
// that.
TEST(ReferenceScale, SeesTheTextureThatTheMeterSaw) {
  EXPECT_LT(relative_error({1, 1, 1}), 0.018);
}

// Channels of different gain are left as they are: no better than their own pixels, no worse.
TEST(ReferenceScale, LeavesAColouredSensorItsColours) {
  EXPECT_LT(relative_error({0.6, 1, 1.3}), 0.035);
}

// A bright thing beside the disc is none of the meter's business.
TEST(ReferenceScale, StaysWithinAnEvenPatch) {
  Frame frame = scene(40);
  ImageU16& codes = std::get<ImageU16>(frame.pixels);
  for (int y = 0; y < 10; ++y)
    for (int x = 14; x < 20; ++x)
      for (int c = 0; c < 3; ++c) codes.at(x, y, c) = 200;
  const std::vector<double> scale =
      reference_scale({"scene.png", 10, 5, 3, {1, 1, 1}}, frame, rgb8, linear_response(8, 5, 250, 3), "S");
  EXPECT_NEAR(scale[1], 0.5 / 35, 1e-6);
}

void expect_refused(const SessionHeader::Reference& meter, std::uint16_t code, const std::string& word) {
  try {
    (void)reference_scale(meter, scene(code), rgb8, linear_response(8, 5, 250, 3), "S");
    ADD_FAILURE() << "accepted: " << word;
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find(word), std::string::npos) << e.what();
  }
}

TEST(ReferenceScale, RefusesDiscsThatTellNothing) {
  expect_refused({"scene.png", 1, 5, 3, {1, 1, 1}}, 40, "does not lie");
  expect_refused({"scene.png", 10, 5, 3, {1, 1}}, 40, "radiance");
  expect_refused({"scene.png", 10, 5, 3, {1, -1, 1}}, 40, "radiance");
  expect_refused({"scene.png", 10, 5, 3, {1, 1, 1}}, 255, "saturated");
  expect_refused({"scene.png", 10, 5, 3, {1, 1, 1}}, 4, "black");
}

}  // namespace
}  // namespace mf
