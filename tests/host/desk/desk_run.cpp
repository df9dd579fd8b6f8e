// SPDX-License-Identifier: Apache-2.0
#include "tests/host/desk/desk_run.h"

#include <map>

#include "tests/host/desk/desk_truth.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_folder.h"

namespace mf::test {

namespace {

struct Run {
  TemporaryFolder folder;
  std::filesystem::path session = folder / "S";
  std::filesystem::path light_field = folder / "F.lf.exr";
  std::map<std::string, nlohmann::json> summaries;
  std::string failure;

  Run() {
    const std::string s = session.string();
    step({"import", desk_folder().string(), "-o", s});
    step({"photometry", s});
    step({"calibrate", s});
    step({"resample", s, "-o", light_field.string(), "--height", "0", "--size", "128"});
  }
  void step(std::vector<std::string> arguments) {
    if (!failure.empty()) return;
    const std::string name = arguments.front();
    arguments.insert(arguments.begin(), MF_BINARY_DIR "/mirrorfield");
    arguments.emplace_back("--json");
    const CommandOutcome outcome = run_command(arguments);
    if (outcome.exit_code != 0) failure = name + " failed: " + outcome.err;
    summaries[name] = nlohmann::json::parse(outcome.out, nullptr, false);
  }
};

Run& the_run() {
  static Run run;
  return run;
}

}  // namespace

void DeskRun::SetUp() {
  if (!std::filesystem::exists(desk_folder())) GTEST_SKIP() << desk_folder() << " is absent";
  ASSERT_EQ(the_run().failure, "");
}

const std::filesystem::path& DeskRun::session() {
  return the_run().session;
}
const std::filesystem::path& DeskRun::light_field() {
  return the_run().light_field;
}
const nlohmann::json& DeskRun::summary(const std::string& command) {
  return the_run().summaries.at(command);
}

}  // namespace mf::test
