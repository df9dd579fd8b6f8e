// SPDX-License-Identifier: Apache-2.0
#include "host/photometry/reference_scale.h"

#include <gtest/gtest.h>

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
  // Only the disc counts: centres (7.5…12.5, y) within 3 px of (10, 5).
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
      if (std::hypot(x + 0.5 - 10, y + 0.5 - 5) <= 3) {
        sum += static_cast<double>(picture.at(x, y, 0));
        ++count;
      }
  EXPECT_NEAR(sum / count, 7, 1e-5);
}

// A noisy mosaic on an even slope: the disc's own 28 pixels say it to 4 %, with what is around it to two.
TEST(ReferenceScale, ReadsPastTheNoiseOfASmallDisc) {
  std::mt19937 random(4);
  std::normal_distribution<double> noise(0, 0.12);
  const PixelFormat bayer{PixelLayout::bayer_rg, 12, false};
  const ResponseCurve curve = linear_response(12, 64, 4031, 3);
  double squares = 0;
  constexpr int rounds = 60;
  for (int round = 0; round < rounds; ++round) {
    Frame frame;
    frame.info.exposure_s = 1;
    ImageU16 codes(80, 80, 1);
    for (int y = 0; y < 80; ++y)
      for (int x = 0; x < 80; ++x)
        codes.at(x, y) = static_cast<std::uint16_t>(64.5 + (600 + 4 * (x + 0.5 - 40)) * (1 + noise(random)));
    frame.pixels = codes;
    const SessionHeader::Reference meter{"scene.png", 40, 40, 3, {1, 1, 1}};
    const std::vector<double> scale = reference_scale(meter, frame, bayer, curve, "S");
    const double truth = 1.0 / 600;
    for (const double s : scale) squares += std::pow(s / truth - 1, 2);
  }
  EXPECT_LT(std::sqrt(squares / (3 * rounds)), 0.026);
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
