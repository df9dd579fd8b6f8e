// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/session.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_folder.h"

namespace mf {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

const char* const program = MF_BINARY_DIR "/mirrorfield";

// The real capture, once, with its sizes as the data's README says.
TEST(ImportCommand, TheDeskRecordingIsImported) {
  const fs::path desk = fs::path(MF_SHARED_DATA) / "desk";
  if (!fs::exists(desk)) GTEST_SKIP() << "no " << desk;
  const test::TemporaryFolder folder;
  const auto outcome = test::run_command({program, "import", desk, "-o", folder / "S", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const json summary = json::parse(outcome.out);
  EXPECT_EQ(summary["mirror_frames"], 420);
  EXPECT_EQ(summary["sweep_frames"], 12);
  EXPECT_EQ(summary["scene_frames"], 1);
  const SessionReader reader(folder / "S");
  const SessionFrame& frame = reader.frames().at(217);
  EXPECT_EQ(frame.info.name, "00217.png");
  if (test::run_command({"/usr/bin/python3", "-c", "import cv2"}).exit_code != 0) return;
  const std::string compare =
      "import cv2, sys; a, b = (cv2.imread(f, -1) for f in sys.argv[1:])\n"
      "assert a.dtype == b.dtype == 'uint16' and a.shape == b.shape and (a == b).all()";
  const auto same = test::run_command({"/usr/bin/python3", "-c", compare, (folder / ("S/" + frame.file)).string(),
                                       (desk / "frames/00217.png").string()});
  EXPECT_EQ(same.exit_code, 0) << same.err;
}

}  // namespace
}  // namespace mf
