// SPDX-License-Identifier: Apache-2.0
// The stage on a session: which way it takes, and what it writes.
#include "host/photometry/photometry.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "tests/host/photometry/simulated_sweep.h"

namespace mf {
namespace {

class PhotometryStage : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("mf_photometry_" + std::to_string(getpid()));
    std::filesystem::remove_all(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  SessionReader session(const std::string& format, const std::vector<Frame>& frames) {
    SessionHeader header;
    header.format = *parse_pixel_format(format);
    header.width = header.height = 64;
    header.black_level_hint = 60;
    header.target.family = "tag36h11";
    header.target.opening_m = {0.2, 0.2};
    header.target.tags = {{0, 0.03, {0.15, 0.15}}};
    header.reference = SessionHeader::Reference{
        "scene", 32, 32, 4, std::vector<double>(static_cast<std::size_t>(header.format.colour_channels()), 2.5)};
    SessionWriter writer(folder_, header, {});
    for (const Frame& frame : frames) writer.append(frame);
    writer.finish();
    return SessionReader(folder_);
  }
  std::filesystem::path folder_;
};

Frame scene_of(FramePixels pixels) {
  return {{"scene", FrameRole::scene, 0.02, 0, 0}, std::move(pixels)};
}

TEST_F(PhotometryStage, EstimatesAndTakesTheScaleFromTheMeter) {
  SimulatedSweep sweep;
  sweep.truth = linlog_response(12, 64, 0.0003, 1, 1);
  sweep.format = *parse_pixel_format("Mono12");
  sweep.brightest = 0.003;
  sweep.lamp = 0.2;
  sweep.shot_noise = 0.00016;
  sweep.size = 64;
  std::vector<Frame> frames = sweep.frames().frames;
  frames.push_back(scene_of(ImageU16(64, 64, 1, 300)));
  PhotometryOptions options;
  options.response.pixels = 1500;
  const PhotometryResult result = photometry(session("Mono12", frames), options);
  EXPECT_TRUE(result.curve.absolute);
  const ImageF picture = linearize(frames.back(), sweep.format, result.curve);
  EXPECT_NEAR(picture.at(5, 5), 2.5, 1e-5);
  ASSERT_EQ(result.channels.size(), 1U);
  EXPECT_EQ(result.sweep_frames.size(), sweep.densities.size());

  const nlohmann::json json = response_json(result, options);
  EXPECT_EQ(json.at("options").at("pixels"), 1500);
  EXPECT_EQ(response_curve_from_json(json, "response.json").channels[0].exposure, result.curve.channels[0].exposure);
  const nlohmann::json summary = photometry_summary(result);
  EXPECT_NEAR(summary.at("black_level").get<double>(), 64, 0.2);
  EXPECT_EQ(summary.at("frames").size(), sweep.densities.size());
  EXPECT_NE(photometry_text(result).find("black level 6"), std::string::npos);
}

TEST_F(PhotometryStage, WithoutASweepSaysWhatToDo) {
  const SessionReader bare = session("Mono12", {scene_of(ImageU16(64, 64, 1, 300))});
  try {
    (void)photometry(bare, {});
    ADD_FAILURE() << "made a curve from nothing";
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("--linear"), std::string::npos) << e.what();
  }
  PhotometryOptions linear;
  linear.linear = true;
  const PhotometryResult result = photometry(bare, linear);
  EXPECT_DOUBLE_EQ(result.curve.black_level, 60);
  EXPECT_NEAR(result.curve.exposure_of(0, 260) / result.curve.exposure_of(0, 160), 2, 1e-9);
  EXPECT_TRUE(result.channels.empty());
}

TEST_F(PhotometryStage, LinearFramesNeedNoCurve) {
  const Frame scene = scene_of(ImageF(64, 64, 3, 0.7F));
  const PhotometryResult result = photometry(session("RGBFloat", {scene}), {});
  EXPECT_TRUE(std::isinf(result.curve.saturation_code));
  const ResponseCurve back = response_curve_from_json(response_json(result, {}), "response.json");
  EXPECT_NEAR(linearize(scene, *parse_pixel_format("RGBFloat"), back).at(3, 3, 1), 2.5, 1e-5);
}

}  // namespace
}  // namespace mf
