// SPDX-License-Identifier: Apache-2.0
// The whole rig without hardware: simulated camera and button, the real daemon, faults on a timeline.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <vector>

#include "common/json_file.h"
#include "common/session.h"
#include "hw-sim/scenario_run.h"
#include "hw-sim/v4l2_camera.h"
#include "tests/support/expect_input_error.h"
#include "tests/support/temporary_folder.h"

namespace mf::sim {
namespace {

namespace fs = std::filesystem;

class ScenarioTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!has_umockdev()) GTEST_SKIP() << "needs umockdev's preload library";
  }
  Scenario read(const std::string& text) {
    std::ofstream(folder_ / "scenario.toml") << text;
    return read_scenario(folder_ / "scenario.toml");
  }
  ScenarioResult play(const Scenario& scenario) {
    return run_scenario(scenario, {folder_ / "run", MF_BINARY_DIR "/mirrorfieldd"}, {},
                        [this](const std::string& what) { said_ += what + "\n"; });
  }
  test::TemporaryFolder folder_;
  std::string said_;
};

constexpr const char* small =
    "[take]\nframes = 60\nsamples = 1\nscene_samples = 4\n"
    "[camera]\naddress = '127.0.7.2'\nsize_px = 384\nframe_rate_hz = 20\n";

TEST_F(ScenarioTest, AButtonMakesARecordingThatIsCalibratedAndKnowsItsResponse) {
  const ScenarioResult result = play(read(small));
  EXPECT_EQ(result.daemon_exit_code, 0);
  EXPECT_EQ(result.last.state, RigState::done) << said_;
  EXPECT_EQ(result.last.problem, "");
  RecordProperty("ms_from_press_to_first_durable_frame", static_cast<int>(1000 * result.first_durable_s));
  const SessionReader session(result.session);
  EXPECT_EQ(session.frames(FrameRole::scene).size(), 1U) << "the mirror was out of view";
  EXPECT_GE(session.frames(FrameRole::mirror).size(), 60U);
  EXPECT_TRUE(session.gaps().empty());
  EXPECT_FALSE(session.tags().empty());
  EXPECT_TRUE(session.document("clock").has_value());
  // The response is the metered one, from what was read back of the camera: several slopes, as the lamp was shown.
  const nlohmann::json response = session.document("device").value()["response"];
  EXPECT_EQ(response["scheme"], "SFNC MultiSlope");
  EXPECT_FALSE(read_response_curve(result.session / "response.json").channels.empty());
  // All that was played after the press was recorded, in its order.
  const nlohmann::json played = read_json_file(folder_ / "run/truth/played.json");
  std::set<int> shown;
  for (const nlohmann::json& frame : played)
    if (frame["take_frame"] >= 0) shown.insert(frame["take_frame"].get<int>());
  EXPECT_EQ(shown.size(), 60U);
}

TEST_F(ScenarioTest, WhatGoesWrongIsRecordedAsWhatItIs) {
  const ScenarioResult result =
      play(read(std::string(small) +
                "[[fault]]\nkind = 'skipped'\nat_s = 0.3\namount = 3\n[[fault]]\nkind = 'knock'\nat_s = 0.5\n"
                "[[fault]]\nkind = 'camera_death'\nat_s = 0.8\nseconds = 0.6\n"
                "[[fault]]\nkind = 'replug'\nat_s = 1.9\nseconds = 0.2\n"
                "[[fault]]\nkind = 'io_error'\nat_s = 2.5\nseconds = 0.3\namount = 1\n"));
  EXPECT_EQ(result.last.state, RigState::done) << said_;
  // The refused call is whichever comes first: a frame's own file is written anew beside it; after any other (the
  // index, a folder's sync) the recording goes on in a second session.
  const bool went_on = result.session.string().ends_with("-2");
  EXPECT_NE(result.last.problem.find(went_on ? "the recording goes on in" : "the disk refused"), std::string::npos)
      << result.last.problem;
  std::vector<std::filesystem::path> sessions{result.session};
  if (went_on) sessions.insert(sessions.begin(), result.session.string().substr(0, result.session.string().size() - 2));
  std::int64_t missing = 0, written_anew = 0;
  std::set<std::string> reasons;
  for (const std::filesystem::path& path : sessions) {
    const SessionReader session(path);
    for (const FrameGap& gap : session.gaps()) {
      missing += gap.missing;
      reasons.insert(gap.reason);
    }
    for (const SessionFrame& frame : session.frames()) {
      if (frame.file.find('-') != std::string::npos) ++written_anew;
      EXPECT_NO_THROW((void)session.read_frame(frame));
    }
  }
  EXPECT_TRUE(missing == 3 || (went_on && missing > 3)) << missing;
  EXPECT_TRUE(reasons.contains("the camera was lost")) << said_;
  EXPECT_EQ(written_anew, went_on ? 0 : 1);
}

TEST_F(ScenarioTest, AFullDiskIsToldAtOnceAndKeepsWhatWasAcknowledged) {
  const ScenarioResult result =
      play(read(std::string(small) + "[[fault]]\nkind = 'full_disk'\nat_s = 1\nseconds = 100\n"));
  EXPECT_EQ(result.last.state, RigState::error) << said_;
  EXPECT_NE(result.last.problem.find("No space left"), std::string::npos) << result.last.problem;
  const SessionReader session(result.session);
  EXPECT_GE(static_cast<std::int64_t>(session.frames().size()), result.last.durable_frames);
  for (const SessionFrame& frame : session.frames()) EXPECT_NO_THROW((void)session.read_frame(frame));
}

TEST(ScenarioFile, FaultsNameFileTableAndKey) {
  const test::TemporaryFolder folder;
  const auto error_of = [&](const std::string& text) {
    std::ofstream(folder / "s.toml") << text;
    return test::input_error_of([&] { (void)read_scenario(folder / "s.toml"); });
  };
  EXPECT_NE(error_of("[camera]\nsize_px = 511\n").find("camera.size_px"), std::string::npos);
  EXPECT_NE(error_of("[camera]\npixel_format = 'RGB8'\n").find("camera.pixel_format"), std::string::npos);
  EXPECT_NE(error_of("[[fault]]\nkind = 'rain'\n").find("must be one of"), std::string::npos);
  EXPECT_NE(error_of("[fault]\nkind = 'knock'\n").find("[[fault]]"), std::string::npos);
  EXPECT_NE(error_of("[taek]\n").find("taek"), std::string::npos);
  EXPECT_NE(error_of("[take\n").find("line 1"), std::string::npos);
}

}  // namespace
}  // namespace mf::sim
