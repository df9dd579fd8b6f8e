// SPDX-License-Identifier: Apache-2.0
// The whole path, from a simulated recording to a lit picture, with the programs that users run. Truth is the
// simulator's: poses, camera, and a path-traced picture of scene and object together.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/file_bytes.h"
#include "common/json_file.h"
#include "host/io/exr.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_folder.h"

namespace mf {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::CommandOutcome;
using test::run_command;

const char* const mirrorfield = MF_BINARY_DIR "/mirrorfield";
const char* const simulator = MF_BINARY_DIR "/mirrorfield-sim";

// Means of 4 × 4 pixels: the truth is path traced with few samples, and its noise is not our error.
ImageF blocks_of(const ImageF& picture) {
  constexpr int side = 4;
  ImageF blocks(picture.width / side, picture.height / side, picture.channels);
  for (int y = 0; y < blocks.height; ++y)
    for (int x = 0; x < blocks.width; ++x)
      for (int c = 0; c < picture.channels; ++c) {
        float sum = 0;
        for (int i = 0; i < side * side; ++i) sum += picture.at(side * x + i % side, side * y + i / side, c);
        blocks.at(x, y, c) = sum / (side * side);
      }
  return blocks;
}

// RMS of the difference over the blocks where the object changes the picture by a tenth or more.
double rms_where_changed(const ImageF& picture, const ImageF& truth, const ImageF& plate) {
  double sum = 0;
  double count = 0;
  for (std::size_t i = 0; i < truth.data.size(); ++i) {
    if (std::abs(truth.data[i] - plate.data[i]) < 0.1F * std::max(plate.data[i], 0.05F)) continue;
    sum += std::pow(static_cast<double>(picture.data[i] - truth.data[i]), 2);
    ++count;
  }
  return std::sqrt(sum / count);
}

TEST(Process, FromASimulatedRecordingToALitPicture) {
  const test::TemporaryFolder folder;
  const std::string capture = folder / "capture";
  const std::string session = folder / "session";
  const std::string out = folder / "out";
  const std::string truth = capture + "/truth";
  ASSERT_EQ(run_command({simulator, "capture", "-o", capture, "--frames", "50", "--size", "384", "--samples", "4",
                         "--truth-samples", "16"})
                .exit_code,
            0);
  ASSERT_EQ(run_command({mirrorfield, "import", capture, "-o", session}).exit_code, 0);
  const CommandOutcome processed =
      run_command({mirrorfield, "process", session, "-o", out, "--directions", "800", "--size", "48", "--json"});
  ASSERT_EQ(processed.exit_code, 0) << processed.err;

  const json summary = json::parse(processed.out);
  EXPECT_EQ(summary.at("frames"), 50);
  EXPECT_GE(summary.at("used").get<int>(), 40);
  EXPECT_LT(summary.at("rms_px").get<double>(), 0.35);
  EXPECT_TRUE(summary.at("absolute"));
  const double focal = read_json_file(session + "/calibration.json").at("K")[0][0].get<double>();
  const double true_focal = read_json_file(truth + "/calibration.json").at("K")[0][0].get<double>();
  EXPECT_NEAR(focal / true_focal, 1, 0.003);

  const std::string page = read_file_bytes(out + "/report.html");
  EXPECT_NE(page.find("Mirrorfield report: session"), std::string::npos);
  EXPECT_NE(page.find("</html>"), std::string::npos);
  EXPECT_EQ(read_exr(out + "/probe.exr").channels, 3);

  ASSERT_EQ(run_command({mirrorfield, "composite", out + "/field.lf.exr", truth + "/knot.obj", "--plate",
                         truth + "/plate0.exr", "--cameras", truth + "/views.json", "--view", "0", "--albedo", "0.7",
                         "-o", out + "/composite.exr"})
                .exit_code,
            0);
  const ImageF plate = blocks_of(read_exr(truth + "/plate0.exr"));
  const ImageF expected = blocks_of(read_exr(truth + "/knot0.exr"));
  const double ours = rms_where_changed(blocks_of(read_exr(out + "/composite.exr")), expected, plate);
  const double without = rms_where_changed(plate, expected, plate);
  RecordProperty("composite_rms", std::to_string(ours));
  RecordProperty("plate_rms", std::to_string(without));
  EXPECT_LT(ours, 0.35 * without) << "composite " << ours << ", bare plate " << without;
}

TEST(Process, SaysInOneLineWhatIsMissing) {
  const test::TemporaryFolder folder;
  const CommandOutcome outcome = run_command({mirrorfield, "process", folder / "nowhere", "-o", folder / "out"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.error_lines(), 1) << outcome.err;
  EXPECT_NE(outcome.err.find("nowhere"), std::string::npos);
  EXPECT_FALSE(fs::exists(folder / "out"));
}

TEST(Process, RefusesOptionsBeforeItWorks) {
  const test::TemporaryFolder folder;
  const CommandOutcome outcome =
      run_command({mirrorfield, "process", folder / "nowhere", "-o", folder / "out", "--size", "1"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.error_lines(), 1) << outcome.err;
  EXPECT_NE(outcome.err.find("size"), std::string::npos) << outcome.err;
  EXPECT_FALSE(fs::exists(folder / "out"));
}

}  // namespace
}  // namespace mf
