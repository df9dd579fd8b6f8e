// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/file_bytes.h"
#include "tests/bench/made_capture.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_folder.h"

namespace mf {
namespace {

class ResampleCommand : public ::testing::Test {
 protected:
  void SetUp() override { bench::make_capture(folder_ / "S", {40, 256}); }

  test::CommandOutcome resample(const std::string& file, const std::string& proxy,
                                const std::vector<std::string>& launcher = {}) {
    std::vector<std::string> arguments = launcher;
    for (const std::string& a :
         {std::string(MF_BINARY_DIR "/mirrorfield"), std::string("resample"), (folder_ / "S").string(),
          std::string("-o"), (folder_ / file).string(), std::string("--directions"), std::string("150"),
          std::string("--size"), std::string("24"), std::string("--proxy"), proxy, std::string("--json")})
      arguments.push_back(a);
    return test::run_command(arguments);
  }

  test::TemporaryFolder folder_;
};

TEST_F(ResampleCommand, TellsTheProxyTheSecondsAndTheMemory) {
  const test::CommandOutcome outcome = resample("a.lf.exr", "plane");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const nlohmann::json summary = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(summary.at("proxy"), "plane");
  EXPECT_EQ(summary.at("views"), 40);
  EXPECT_GT(summary.at("peak_memory_bytes").get<double>(), 5e6);
  double stages = 0;
  for (const char* stage : {"loading", "focusing", "blending", "packing", "writing"})
    stages += summary.at("seconds").at(stage).get<double>();
  EXPECT_GT(summary.at("seconds").at("total").get<double>(), 0.5 * stages);
}

// Nothing is written, and one line says what is wrong.
TEST_F(ResampleCommand, RefusesWhatWouldBeNoLightField) {
  const auto refuses = [&](std::vector<std::string> options, const std::string& word) {
    options.insert(options.begin(), {MF_BINARY_DIR "/mirrorfield", "resample", folder_ / "S"});
    const test::CommandOutcome outcome = test::run_command(options);
    EXPECT_EQ(outcome.exit_code, 1) << word;
    EXPECT_EQ(outcome.error_lines(), 1) << outcome.err;
    EXPECT_NE(outcome.err.find(word), std::string::npos) << outcome.err;
    for (const auto& entry : std::filesystem::directory_iterator(folder_.path()))
      EXPECT_EQ(entry.path().filename(), "S") << word;
  };
  const std::string file = folder_ / "f.lf.exr";
  refuses({"-o", folder_ / "f.png"}, "must end in .exr");
  refuses({"-o", folder_ / "none/f.lf.exr"}, "is no folder");
  refuses({"-o", file, "-k", "65"}, ": -k: ");
  refuses({"-o", file, "--height", "80000"}, "--height: 80000 m is no place");
  refuses({"-o", file, "--rectangle", "100", "100", "101", "101"}, "--rectangle: no mirror view");
  refuses({"-o", file, "--proxy", "sphere:0.01"}, "does not hold the plane's rectangle");
  const std::filesystem::path calibration = folder_ / "S/calibration.json";
  nlohmann::json json = nlohmann::json::parse(read_file_bytes(calibration));
  for (std::size_t i = 1; i < json.at("frames").size(); ++i) json["frames"][i]["used"] = false;
  std::ofstream(calibration) << json;
  refuses({"-o", file}, "has one used frame only");
}

// Ranks deal out the frames, the rows of the focusing and the directions: the file is that of one process, bit for bit.
TEST_F(ResampleCommand, TwoRanksMakeTheFileOfOne) {
  if (!test::has_program("mpirun")) GTEST_SKIP() << "mpirun is not installed";
  setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 0);
  setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 0);
  const std::vector<std::string> two{
      "mpirun", "-n", "2", "--oversubscribe", "--mca", "btl", "self,vader", "--mca", "btl_base_warn_component_unused",
      "0"};
  for (const char* proxy : {"plane", "auto"}) {
    const test::CommandOutcome one = resample("one.lf.exr", proxy);
    ASSERT_EQ(one.exit_code, 0) << one.err;
    const test::CommandOutcome both = resample("two.lf.exr", proxy, two);
    ASSERT_EQ(both.exit_code, 0) << both.err;
    EXPECT_EQ(nlohmann::json::parse(both.out).at("views"), 40) << "only rank 0 prints";
    EXPECT_TRUE(read_file_bytes(folder_ / "one.lf.exr") == read_file_bytes(folder_ / "two.lf.exr")) << proxy;
  }
}

TEST_F(ResampleCommand, BadInputUnderMpirunEndsAllRanks) {
  if (!test::has_program("mpirun")) GTEST_SKIP() << "mpirun is not installed";
  setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 0);
  setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 0);
  std::filesystem::remove(folder_ / "S" / "response.json");
  const test::CommandOutcome outcome = resample("a.lf.exr", "plane",
                                                {"mpirun", "-n", "2", "--oversubscribe", "--mca", "btl", "self,vader",
                                                 "--mca", "btl_base_warn_component_unused", "0"});
  EXPECT_NE(outcome.exit_code, 0);
  EXPECT_NE(outcome.err.find("response.json"), std::string::npos) << outcome.err;
  EXPECT_FALSE(std::filesystem::exists(folder_ / "a.lf.exr"));
}

}  // namespace
}  // namespace mf
