// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <fstream>

#include "host/calibration/calibrate.h"

namespace mf {
namespace {

const std::filesystem::path folder = std::filesystem::path(MF_SHARED_DATA) / "zhang" / "d" / "TextDataResource-data";

std::vector<double> numbers(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::vector<double> out;
  for (double v = 0; file >> v;) out.push_back(v);
  return out;
}

// Zhang's five views of 64 squares, four corners each, and the result he published (2000, table 1 on his page).
TEST(ZhangData, GivesThePublishedCamera) {
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is absent";
  const std::vector<double> model = numbers(folder / "Model.txt");
  ASSERT_EQ(model.size(), 512U);
  CalibrationInput input;
  input.source = "zhang";
  input.width = 640;
  input.height = 480;
  for (int view = 1; view <= 5; ++view) {
    const std::vector<double> pixels = numbers(folder / ("data" + std::to_string(view) + ".txt"));
    ASSERT_EQ(pixels.size(), model.size());
    TargetView seen;
    seen.name = std::to_string(view);
    for (std::size_t i = 0; i < model.size(); i += 8) {
      TagSighting square{static_cast<int>(i / 8), {}, {}, isotropic_information(0.3), true};
      for (std::size_t k = 0; k < 4; ++k) {
        // Inches. His y runs down with the picture's, ours up: the plane then faces the camera.
        square.corners_in_target[k] = {0.0254 * model[i + 2 * k], -0.0254 * model[i + 2 * k + 1], 0};
        square.corners_px[k] = {pixels[i + 2 * k], pixels[i + 2 * k + 1]};
      }
      seen.tags.push_back(square);
    }
    input.mirror.push_back(seen);
  }
  CalibrationOptions options;
  options.distortion = DistortionChoice::radial;
  const Calibration c = calibrate(input, options, {}).calibration;
  EXPECT_NEAR(c.camera.fx(), 832.5, 1);  // our sigma is 1.4: he fits a skew too, and without a robust loss
  EXPECT_NEAR(c.camera.fy(), 832.53, 1);
  EXPECT_NEAR(c.camera.cx(), 303.959, 0.8);
  EXPECT_NEAR(c.camera.cy(), 206.585, 0.8);
  EXPECT_NEAR(c.camera.parameters[4], -0.2286, 0.004);
  EXPECT_NEAR(c.camera.parameters[5], 0.1904, 0.02);
  EXPECT_LT(c.rms_px, 0.36);  // Zhang: 0.335
}

}  // namespace
}  // namespace mf
