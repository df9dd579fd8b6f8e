// SPDX-License-Identifier: Apache-2.0
#include "host/photometry/response_estimate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "tests/host/photometry/simulated_sweep.h"

namespace mf {
namespace {

// Like the cameras this is for: linear over a tenth of its codes, logarithmic above, and a scene that reaches 80 % of
// the codes with a lamp alone.
SimulatedSweep linlog() {
  SimulatedSweep sweep;
  sweep.truth = linlog_response(12, 64, 0.0003, 1, 1);
  sweep.format = *parse_pixel_format("Mono12");
  sweep.brightest = 0.003;
  sweep.lamp = 0.2;
  sweep.shot_noise = 0.00016;  // 1 % at the knee
  return sweep;
}

ResponseOptions quick() {
  ResponseOptions options;
  options.pixels = 1500;
  return options;
}

TEST(EstimateResponse, RecoversALinLogSensorFromBlackToBeyondTheBrightestReading) {
  const SimulatedSweep sweep = linlog();
  const ResponseEstimate estimate = estimate_response(sweep.frames(), quick());
  EXPECT_NEAR(estimate.curve.black_level, 64, 0.1);
  EXPECT_EQ(estimate.curve.saturation_code, 4095);
  const ResponseChannel& channel = estimate.curve.channels[0];
  EXPECT_TRUE(std::is_sorted(channel.exposure.begin(), channel.exposure.end()));
  const CurveError error = curve_error(channel, sweep.truth.channels[0], 72, 4080);
  EXPECT_LT(error.rms, 0.02);
  EXPECT_LT(error.most, 0.06);
  const CurveError seen = curve_error(channel, sweep.truth.channels[0], 100, 1000);
  EXPECT_LT(seen.most, 0.01);
  EXPECT_TRUE(channel.observed[100]);
  EXPECT_FALSE(channel.observed[4000]);
  // The uncertainty knows where nothing was seen.
  EXPECT_LT(channel.relative_sigma[500], 0.01);
  EXPECT_GT(channel.relative_sigma[4090], 3 * channel.relative_sigma[500]);
}

TEST(EstimateResponse, RecoversALinearSensorThatSaturates) {
  SimulatedSweep sweep;
  sweep.truth = linear_response(10, 30, 1, 1);
  sweep.format = *parse_pixel_format("Mono10");
  sweep.lamp = 5;
  sweep.read_noise = 0.8;
  sweep.densities = {0, 0.5, 1, 1.5, 2};
  const ResponseEstimate estimate = estimate_response(sweep.frames(), quick());
  EXPECT_NEAR(estimate.curve.black_level, 30, 0.1);
  EXPECT_NEAR(estimate.curve.saturation_code, 1023, 3);
  EXPECT_LT(curve_error(estimate.curve.channels[0], sweep.truth.channels[0], 38, 1015).most, 0.02);
}

TEST(EstimateResponse, RecoversAPowerLawInEightBits) {
  SimulatedSweep sweep;
  sweep.truth = linear_response(8, 4, 1, 3);
  for (ResponseChannel& channel : sweep.truth.channels)
    for (std::size_t m = 0; m < 256; ++m)  // slope at black finite, then a gamma of 2.2: the toe is linear
      channel.exposure[m] =
          std::pow(std::max(0.0, static_cast<double>(m) - 4 + 8) / 259, 2.2) - std::pow(8 / 259.0, 2.2);
  for (ResponseChannel& channel : sweep.truth.channels)
    for (std::size_t m = 0; m <= 4; ++m) channel.exposure[m] = 0;
  sweep.format = *parse_pixel_format("RGB8");
  sweep.read_noise = 0.4;
  sweep.size = 72;
  sweep.densities = {0, 0.3, 0.6, 0.9, 1.2, 1.5};
  const ResponseEstimate estimate = estimate_response(sweep.frames(), quick());
  ASSERT_EQ(estimate.curve.channels.size(), 3U);
  for (int c = 0; c < 3; ++c) {
    const auto k = static_cast<std::size_t>(c);
    EXPECT_LT(curve_error(estimate.curve.channels[k], sweep.truth.channels[k], 12, 250).rms, 0.03);
  }
}

TEST(EstimateResponse, NeedsNoHintAndSurvivesAWrongOne) {
  ExposureSweep frames = linlog().frames();
  for (const double hint : {0.0, 50.0, 90.0}) {
    frames.black_level_hint = hint;
    EXPECT_NEAR(estimate_response(frames, quick()).curve.black_level, 64, 0.15) << hint;
  }
}

TEST(EstimateResponse, ChannelsShareTheBlackLevelAndTheScale) {
  SimulatedSweep sweep = linlog();
  sweep.truth = linlog_response(12, 64, 0.0003, 1, 3);
  sweep.format = *parse_pixel_format("BayerRG12");
  const ResponseEstimate estimate = estimate_response(sweep.frames(), quick());
  ASSERT_EQ(estimate.curve.channels.size(), 3U);
  for (int m = 100; m < 3000; m += 100)  // one sensor: one curve, without a colour cast
    EXPECT_NEAR(estimate.curve.channels[2].exposure[static_cast<std::size_t>(m)] /
                    estimate.curve.channels[1].exposure[static_cast<std::size_t>(m)],
                1, 0.02);
}

TEST(EstimateResponse, TheUncertaintyIsThatOfTheError) {
  // Over sweeps that differ in noise alone, errors scatter as relative_sigma says; where nothing was seen, code 4000,
  // it may be larger: the prior allows for stranger sensors than this one.
  constexpr unsigned runs = 8;
  const std::vector<std::size_t> codes{74, 100, 300, 700, 1500, 3000, 4000};
  std::vector<double> square(codes.size(), 0), expected(codes.size(), 0);
  for (unsigned seed = 1; seed <= runs; ++seed) {
    SimulatedSweep sweep = linlog();
    sweep.size = 64;
    sweep.seed = seed;
    const ResponseChannel channel = estimate_response(sweep.frames(), quick()).curve.channels[0];
    // exposure is 1 at the code where the estimate is anchored; its uncertainty is relative to that code
    const auto unit = static_cast<std::size_t>(std::lower_bound(channel.exposure.begin(), channel.exposure.end(), 1.0) -
                                               channel.exposure.begin());
    for (std::size_t k = 0; k < codes.size(); ++k) {
      const std::vector<double>& truth = sweep.truth.channels[0].exposure;
      square[k] += std::pow(std::log(channel.exposure[codes[k]] / (truth[codes[k]] / truth[unit])), 2) / runs;
      expected[k] += std::pow(channel.relative_sigma[codes[k]], 2) / runs;
    }
  }
  for (std::size_t k = 0; k < codes.size(); ++k) {
    EXPECT_LT(std::sqrt(square[k] / expected[k]), 2) << codes[k];
    if (codes[k] < 3500) {
      EXPECT_GT(std::sqrt(square[k] / expected[k]), 0.4) << codes[k];
    }
  }
}

TEST(EstimateResponse, SelfConsistencyIsTheNoiseAndNothingElse) {
  const ResponseEstimate estimate = estimate_response(linlog().frames(), quick());
  const SelfConsistency& c = estimate.channels[0].consistency;
  EXPECT_GT(c.readings, 1000U);
  EXPECT_LT(c.rms, 0.02);
  EXPECT_NEAR(c.rms / c.noise, 1, 0.15);
  EXPECT_LT(c.systematic, 0.002);
}

TEST(EstimateResponse, AWrongFilterShowsInItsFrame) {
  ExposureSweep frames = linlog().frames();
  frames.frames[3].info.nd_density += 0.02;  // it let 4.7 % more light through than its label says
  const ResponseEstimate estimate = estimate_response(frames, quick());
  const std::vector<double>& mean = estimate.channels[0].consistency.frame_mean;
  EXPECT_EQ(std::max_element(mean.begin(), mean.end()) - mean.begin(), 3);
  EXPECT_GT(mean[3], 0.01);  // the curve takes up a part
}

std::string refusal(const ExposureSweep& sweep) {
  try {
    (void)estimate_response(sweep, quick());
  } catch (const InputError& e) {
    return e.what();
  }
  return {};
}

TEST(EstimateResponse, BadSweepsAreOneClearLine) {
  SimulatedSweep dark = linlog();
  dark.brightest = dark.lamp = 1e-9;
  EXPECT_NE(refusal(dark.frames()).find("brighter"), std::string::npos) << refusal(dark.frames());
  SimulatedSweep dim = linlog();  // the codes rise, by a little more than the noise
  dim.brightest = dim.lamp = 5e-6;
  EXPECT_NE(refusal(dim.frames()).find("longer"), std::string::npos) << refusal(dim.frames());
  SimulatedSweep bright = linlog();
  bright.brightest = bright.lamp = 1e9;
  EXPECT_NE(refusal(bright.frames()).find("brighter"), std::string::npos) << refusal(bright.frames());
  bright.brightest = bright.lamp = 2e3;  // all but the darkest frame
  bright.decades = 0.01;
  EXPECT_NE(refusal(bright.frames()).find("shorter"), std::string::npos) << refusal(bright.frames());
  ExposureSweep reversed = linlog().frames();
  for (Frame& frame : reversed.frames) frame.info.nd_density = 3.3 - frame.info.nd_density;
  EXPECT_NE(refusal(reversed).find("nd_density"), std::string::npos) << refusal(reversed);
}

TEST(ResponseOptions, SaysWhatIsWrong) {
  ResponseOptions options;
  EXPECT_FALSE(options.validate().has_value());
  options.knot_step = 0;
  EXPECT_NE(options.validate().value().find("knot_step"), std::string::npos);
}

}  // namespace
}  // namespace mf
