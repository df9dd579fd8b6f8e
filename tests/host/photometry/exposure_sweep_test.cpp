// SPDX-License-Identifier: Apache-2.0
#include "host/photometry/exposure_sweep.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "common/error.h"
#include "tests/host/photometry/simulated_sweep.h"

namespace mf {
namespace {

SimulatedSweep linlog() {
  SimulatedSweep sweep;
  sweep.truth = linlog_response(12, 64, 0.001, 1, 1);
  sweep.format = *parse_pixel_format("Mono12");
  return sweep;
}

void expect_refused(const ExposureSweep& sweep, const std::string& word) {
  try {
    sweep.require_usable();
    ADD_FAILURE() << "accepted: " << word;
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find(word), std::string::npos) << e.what();
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
  }
}

TEST(ExposureSweep, RefusesCodesThatDoNotRise) {
  const auto refusal = [](const ExposureSweep& sweep) -> std::string {
    try {
      require_rising_codes(sweep, darkest_reading(sweep));
    } catch (const InputError& e) {
      return e.what();
    }
    return {};
  };
  const ExposureSweep good = linlog().frames();
  EXPECT_EQ(refusal(good), "");
  ExposureSweep swapped = good;
  std::swap(swapped.frames[2].pixels, swapped.frames[5].pixels);
  EXPECT_NE(refusal(swapped).find("darker"), std::string::npos) << refusal(swapped);
  ExposureSweep copies = good;
  for (Frame& frame : copies.frames) frame.pixels = good.frames[0].pixels;
  EXPECT_NE(refusal(copies).find("do not get brighter"), std::string::npos) << refusal(copies);
}

TEST(ExposureSweep, RefusesWhatCannotTellAResponse) {
  const ExposureSweep good = linlog().frames();
  good.require_usable();
  ExposureSweep one = good;
  one.frames.resize(1);
  expect_refused(one, "has 1 frame");
  ExposureSweep zero = good;
  zero.frames[3].info.exposure_s = 0;
  expect_refused(zero, zero.frames[3].info.name);
  zero.frames[3].info.exposure_s = std::nan("");
  expect_refused(zero, "positive");
  ExposureSweep equal = good;
  for (Frame& frame : equal.frames) frame.info.nd_density = 1;
  expect_refused(equal, "same exposure");
  ExposureSweep sizes = good;
  sizes.frames[2].pixels = ImageU16(4, 4, 1);
  expect_refused(sizes, "another size");
}

TEST(SaturationCode, IsTheLastCodeWithoutAPlateau) {
  SimulatedSweep sweep = linlog();
  sweep.brightest = 0.01;
  sweep.lamp = 0.2;
  EXPECT_EQ(saturation_code(sweep.frames(), {64, 1, 64}), 4095);
}

TEST(SaturationCode, FindsThePlateauBelowTheLastCode) {
  SimulatedSweep sweep = linlog();
  sweep.lamp = 4;
  ExposureSweep frames = sweep.frames();
  for (Frame& frame : frames.frames)  // a converter that clips early, with noise after it
    for (std::uint16_t& code : std::get<ImageU16>(frame.pixels).data)
      if (code > 3800) code = static_cast<std::uint16_t>(3800 + code % 3);
  EXPECT_NEAR(saturation_code(frames, {64, 1, 64}), 3800, 2);
}

TEST(DarkestReading, IsUnbiasedByNoise) {
  SimulatedSweep sweep = linlog();
  sweep.densities.push_back(5);
  sweep.brightest = 0.001;
  const DarkReading dark = darkest_reading(sweep.frames());
  EXPECT_NEAR(dark.code, 64, 0.1);
  EXPECT_NEAR(dark.extrapolated, 64, 0.1);
  EXPECT_NEAR(dark.noise, 1.2, 0.4);
}

TEST(SpreadSamples, KeepsTheRareBrightPixels) {
  SimulatedSweep sweep = linlog();
  sweep.brightest = 0.003;
  const ExposureSweep frames = sweep.frames();
  const ChannelSamples all = channel_samples(frames, 0);
  EXPECT_EQ(all.pixel_count(), 96U * 96U);
  const ChannelSamples some = spread_samples(all, 1000, 80, 4095);
  EXPECT_LE(some.pixel_count(), 1000U);
  EXPECT_GT(some.pixel_count(), 900U);
  // The lamp is 0.4 % of the pixels, and alone above the knee in the darkest frame.
  const auto share = [](const ChannelSamples& samples) {
    std::size_t lamps = 0;
    for (std::size_t j = 0; j < samples.pixel_count(); ++j) lamps += samples.pixel(j)[11] > 200 ? 1 : 0;
    return static_cast<double>(lamps) / static_cast<double>(samples.pixel_count());
  };
  EXPECT_GT(share(all), 0);
  EXPECT_GT(share(some), 3 * share(all));
}

TEST(ChannelSamples, BayerChannelsAreDisjoint) {
  ExposureSweep sweep = linlog().frames();
  sweep.format = *parse_pixel_format("BayerGB12");
  EXPECT_EQ(channel_samples(sweep, 0).pixel_count(), 48U * 48U);
  EXPECT_EQ(channel_samples(sweep, 1).pixel_count(), 2 * 48U * 48U);
  const ImageU16& first = std::get<ImageU16>(sweep.frames[0].pixels);
  EXPECT_EQ(channel_samples(sweep, 0).pixel(0)[0], first.at(0, 1));  // GB: red starts the second row
}

}  // namespace
}  // namespace mf
