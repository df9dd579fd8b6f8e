// SPDX-License-Identifier: Apache-2.0
// The desk capture (data/README.md): a 12-bit LinLog sensor that is not ours, and what it should have seen.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "common/demosaic.h"
#include "common/json_file.h"
#include "host/io/exr.h"
#include "host/io/image_file.h"
#include "host/photometry/reference_scale.h"
#include "host/photometry/response_estimate.h"

namespace mf {
namespace {

const std::filesystem::path desk = std::filesystem::path(MF_SHARED_DATA) / "desk";

ExposureSweep read_desk_sweep() {
  ExposureSweep sweep;
  sweep.source = desk.string();
  sweep.format = *parse_pixel_format("BayerRG12");
  sweep.black_level_hint = 64;
  for (const nlohmann::json& entry : read_json_file(desk / "sweep.json")) {
    Frame frame;
    frame.info = {entry.at("frame"), FrameRole::sweep, entry.at("exposure_s"), entry.at("nd_density"), 0};
    frame.pixels = read_image(desk / "sweep" / frame.info.name);
    sweep.frames.push_back(std::move(frame));
  }
  return sweep;
}

class DeskSweep : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    if (std::filesystem::exists(desk)) estimate_ = estimate_response(read_desk_sweep(), {});
  }
  void SetUp() override {
    if (estimate_.curve.channels.empty()) GTEST_SKIP() << "no desk capture beside the checkout";
  }
  static ResponseEstimate estimate_;
};
ResponseEstimate DeskSweep::estimate_;

TEST_F(DeskSweep, IsMonotoneAndEveryFilterTellsTheSameExposure) {
  EXPECT_NEAR(estimate_.curve.black_level, 64, 0.1);
  EXPECT_EQ(estimate_.curve.saturation_code, 4095);
  for (std::size_t c = 0; c < 3; ++c) {
    const ResponseChannel& channel = estimate_.curve.channels[c];
    EXPECT_TRUE(std::is_sorted(channel.exposure.begin(), channel.exposure.end()));
    const ChannelReport& report = estimate_.channels[c];
    const SelfConsistency& s = report.consistency;
    std::printf(
        "channel %zu: black %.3f +- %.3f, filters agree within %.2f %% RMS (noise alone %.2f %%, curve %.3f %%), %zu "
        "readings\n",
        c, report.black_level, report.black_sigma, 100 * s.rms, 100 * s.noise, 100 * s.systematic, s.readings);
    EXPECT_TRUE(report.converged);
    EXPECT_LT(s.rms, 0.02);
    EXPECT_NEAR(s.rms / s.noise, 1, 0.1);
    EXPECT_LT(s.systematic, 0.002);
    for (const double mean : s.frame_mean) EXPECT_LT(std::abs(mean), 0.005);
    EXPECT_GT(s.readings, 10000U);
  }
}

struct Spread {
  double median = 0, robust = 0;  // of log2 ratio, stops
};
Spread spread(std::vector<double> values) {
  const auto median = [](std::vector<double>& v) {
    std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
    return v[v.size() / 2];
  };
  Spread out;
  out.median = median(values);
  for (double& v : values) v = std::abs(v - out.median);
  out.robust = 1.4826 * median(values);
  return out;
}

// log2 of the ratio of block means, 16×16 pixels, of the pixels that saw colour c (all pixels: demosaiced). Noise evens
// out; a block's true mean goes along.
struct Block {
  double stops = 0, truth = 0;
};
std::vector<Block> compare(const ImageF& picture, const ImageF& truth, int c) {
  const bool mosaic = picture.channels == 1;
  std::vector<Block> blocks;
  for (int y = 16; y + 32 <= truth.height; y += 16)
    for (int x = 16; x + 32 <= truth.width; x += 16) {
      double seen = 0, expected = 0;
      for (int j = y; j < y + 16; ++j)
        for (int i = x; i < x + 16; ++i) {
          if (mosaic && colour_at(PixelLayout::bayer_rg, i, j) != c) continue;
          seen += static_cast<double>(picture.at(i, j, mosaic ? 0 : c));
          expected += static_cast<double>(truth.at(i, j, c));
        }
      blocks.push_back({std::log2(seen / expected), expected / (mosaic ? (c == 1 ? 128 : 64) : 256)});
    }
  return blocks;
}
Spread spread_where(const std::vector<Block>& blocks, double least, double most) {
  std::vector<double> stops;
  for (const Block& block : blocks)
    if (block.truth >= least && block.truth < most) stops.push_back(block.stops);
  return spread(stops);
}

TEST_F(DeskSweep, TheSceneComesOutInTheTruthsUnits) {
  const std::filesystem::path truth_file = desk / "truth/plate0.exr";
  if (!std::filesystem::exists(truth_file)) GTEST_SKIP() << "the truth is not here";
  const ImageF truth = read_exr(truth_file);
  const nlohmann::json json = read_json_file(desk / "reference.json");
  const SessionHeader::Reference reference{json.at("frame"), json.at("pixel")[0], json.at("pixel")[1],
                                           json.at("radius_px"), json.at("radiance_rgb")};
  Frame scene;
  scene.info.exposure_s = 0.01;
  scene.pixels = read_image(desk / "scene.png");
  const PixelFormat format = *parse_pixel_format("BayerRG12");
  ResponseCurve curve = estimate_.curve;
  curve.radiance_scale = reference_scale(reference, scene, format, curve, desk.string());
  const ImageF mosaic = linearize(scene, format, curve);
  const ImageF picture = demosaic(mosaic, format.layout);
  for (int c = 0; c < 3; ++c) {
    const std::vector<Block> sites = compare(mosaic, truth, c);
    const Spread all = spread_where(sites, 0, 1e9);
    const double dark = spread_where(sites, 0, 0.05).median, bright = spread_where(sites, 0.3, 1e9).median;
    const Spread demosaiced = spread_where(compare(picture, truth, c), 0, 1e9);
    std::printf(
        "channel %d: log2(scene / truth), stops: median %.4f, spread %.4f, dark %.4f, bright %.4f; demosaiced: median "
        "%.4f, spread %.4f\n",
        c, all.median, all.robust, dark, bright, demosaiced.median, demosaiced.robust);
    // One disc of 29 pixels, of which a mosaic has a quarter to a half, sets the scale.
    EXPECT_LT(std::abs(demosaiced.median), 0.07);
    EXPECT_LT(demosaiced.robust, 0.04);
    // The response alone: the same factor everywhere, from the darkest to the brightest, 1 : 50 in radiance.
    EXPECT_LT(all.robust, 0.01);
    EXPECT_LT(std::abs(dark - bright), 0.01);
  }
}

}  // namespace
}  // namespace mf
