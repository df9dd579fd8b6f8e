// SPDX-License-Identifier: Apache-2.0
// The whole path, from a simulated recording to a lit picture, with the programs that users run. Truth is the
// simulator's: poses, camera, and a path-traced picture of scene and object together.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
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

// A small simulated recording, processed: made once for the tests that look at different ends of it.
struct Processed {
  test::TemporaryFolder folder;
  std::string capture = folder / "capture";
  std::string session = folder / "session";
  std::string out = folder / "out";
  std::string truth = capture + "/truth";
  CommandOutcome process;

  Processed() {
    for (const std::vector<std::string>& command :
         {std::vector<std::string>{simulator, "capture", "-o", capture, "--frames", "50", "--size", "384", "--samples",
                                   "4", "--truth-samples", "16"},
          {mirrorfield, "import", capture, "-o", session},
          {mirrorfield, "process", session, "-o", out, "--directions", "800", "--size", "48", "--json"}})
      process = run_command(command);
  }
  // Of the commands that light the knot, seen by view 0.
  [[nodiscard]] std::vector<std::string> lit(const std::string& command, const std::string& light,
                                             std::vector<std::string> more) const {
    std::vector<std::string> all{mirrorfield,           command,  light, truth + "/knot.obj", "--cameras",
                                 truth + "/views.json", "--view", "0"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
};
const Processed& processed() {
  static const Processed made;
  return made;
}

TEST(Process, FromASimulatedRecordingToALitPicture) {
  const auto& [folder, capture, session, out, truth, process] = processed();
  ASSERT_EQ(process.exit_code, 0) << process.err;

  const json summary = json::parse(process.out);
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

  ASSERT_EQ(
      run_command(processed().lit("composite", out + "/field.lf.exr",
                                  {"--plate", truth + "/plate0.exr", "--albedo", "0.7", "-o", out + "/composite.exr"}))
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

// Root mean square of the difference over that of the expected picture, alpha aside.
double relative_rms(const ImageF& picture, const ImageF& expected) {
  double difference = 0, all = 0;
  for (std::size_t i = 0; i < expected.data.size(); ++i) {
    if (i % static_cast<std::size_t>(expected.channels) == 3) continue;
    difference += std::pow(static_cast<double>(picture.data[i] - expected.data[i]), 2);
    all += std::pow(static_cast<double>(expected.data[i]), 2);
  }
  return std::sqrt(difference / all);
}

// Straight from the capture: the picture is that made through the light field's file.
TEST(JustInTime, APreviewIsTheOneThroughTheFile) {
  const Processed& p = processed();
  ASSERT_EQ(p.process.exit_code, 0) << p.process.err;
  const std::string field = p.out + "/default.lf.exr";
  ASSERT_EQ(run_command({mirrorfield, "resample", p.session, "-o", field}).exit_code, 0);
  for (const std::string command : {"render", "composite"}) {
    const auto picture = [&](const std::string& light) {
      std::string file = p.out + "/preview.exr";
      std::vector<std::string> options{"--directions", "200", "--json", "-o", file};
      if (command == "composite") options.insert(options.end(), {"--plate", p.truth + "/plate0.exr"});
      const CommandOutcome outcome = run_command(p.lit(command, light, options));
      EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
      const json summary = json::parse(outcome.out);
      EXPECT_TRUE(summary.at("seconds_by_stage").contains(light == p.session ? "resampling" : "merging"));
      EXPECT_GE(summary.at("lights").get<int>(), 200);
      return read_exr(file);
    };
    const double difference = relative_rms(picture(p.session), picture(field));
    RecordProperty(command + "_difference", std::to_string(difference));
    EXPECT_LT(difference, 0.01) << command;
  }
}

TEST(JustInTime, SaysInOneLineWhatIsWrongWithASession) {
  const Processed& p = processed();
  ASSERT_EQ(p.process.exit_code, 0) << p.process.err;
  const auto refuses = [&](const std::string& light, std::vector<std::string> options, const std::string& word) {
    const std::string file = p.out + "/none.exr";
    options.insert(options.end(), {"-o", file});
    const CommandOutcome outcome = run_command(p.lit("render", light, options));
    EXPECT_EQ(outcome.exit_code, 1) << word;
    EXPECT_EQ(outcome.error_lines(), 1) << outcome.err;
    EXPECT_NE(outcome.err.find(word), std::string::npos) << outcome.err;
    EXPECT_FALSE(fs::exists(file)) << word;
  };
  refuses(p.truth, {}, "session.db");
  refuses(p.session, {"--directions", "0"}, "--directions");
  refuses(p.session, {"--proxy", "cube"}, "--proxy");
  refuses(p.session, {"--height", "nan"}, "--height");
  refuses(p.session, {"--height", "50"}, "the mirror was waved");
  refuses(p.out + "/field.lf.exr", {"--proxy", "plane"}, "--proxy");
  const std::string uncalibrated = p.folder / "uncalibrated";
  ASSERT_EQ(run_command({mirrorfield, "import", p.capture, "-o", uncalibrated}).exit_code, 0);
  fs::copy(p.session + "/response.json", uncalibrated);
  refuses(uncalibrated, {}, "calibrate");
}

// Neither a black picture nor an unchanged plate, and no probe of what nobody saw.
TEST(Pictures, ThatWouldShowNothingAreRefused) {
  const Processed& p = processed();
  ASSERT_EQ(p.process.exit_code, 0) << p.process.err;
  const std::string field = p.out + "/field.lf.exr";
  const std::string picture = p.out + "/nothing.exr";
  const auto refuses = [&](std::vector<std::string> command, const std::string& word) {
    command.insert(command.begin(), mirrorfield);
    command.insert(command.end(), {"-o", picture});
    const CommandOutcome outcome = run_command(command);
    EXPECT_EQ(outcome.exit_code, 1) << word;
    EXPECT_EQ(outcome.error_lines(), 1) << outcome.err;
    EXPECT_NE(outcome.err.find(word), std::string::npos) << outcome.err;
    EXPECT_FALSE(fs::exists(picture)) << word;
  };
  const auto tetrahedron = [&](const char* name, double x, double z) {
    std::string file = p.folder / name;
    std::ofstream(file) << fmt::format("v {0} 0 {1}\nv {2} 0 {1}\nv {0} 0.02 {1}\nv {0} 0 {3}\n", x, z, x + 0.02,
                                       z + 0.02)
                        << "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    return file;
  };
  const std::string aside = tetrahedron("aside.obj", 20, 0.1), below = tetrahedron("below.obj", 0, -0.1);
  const std::string views = p.truth + "/views.json", plate = p.truth + "/plate0.exr";
  const std::vector<std::string> quick{"--cameras", views, "--directions", "50"};
  for (const auto& [object, word] : {std::pair{aside, "shows nothing of"}, {below, "lies wholly below"}}) {
    std::vector<std::string> command{"render", field, object};
    command.insert(command.end(), quick.begin(), quick.end());
    refuses(command, word);
    command.front() = "composite";
    command.insert(command.end(), {"--plate", plate});
    refuses(command, word);
  }
  refuses({"probe", field, "--at", "0", "0", "100"}, "100 m from the light field's plane");
  refuses({"probe", field, "--at", "0", "0", "-5"}, "no view saw what arrives there");
  refuses({"probe", p.session, "--at", "0", "0", "0.1"}, "mirrorfield resample");
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
