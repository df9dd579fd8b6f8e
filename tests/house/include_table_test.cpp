// SPDX-License-Identifier: Apache-2.0
#include "tests/house/include_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>

namespace mf::house {
namespace {

namespace fs = std::filesystem;

TEST(IncludeTable, RefusesWhatTheHouseForbids) {
  struct Sample {
    const char* file;
    const char* source;
  };
  const std::array<Sample, 9> bad{{
      {"common/image.cpp", "#include <opencv2/core.hpp>"},
      {"common/camera_model.h", "// pinhole\n  #  include <ceres/ceres.h>\n"},
      {"common/session.cpp", "#include \"host/io/exr.h\""},
      {"device/recorder.cpp", "#include \"hw-sim/scene.h\""},
      {"device/recorder.cpp", "#include \"host/io/exr.h\""},
      {"host/photometry/robertson.cpp", "#include \"host/calibration/calibration.h\""},
      {"host/light_field/resample.cpp", "#include \"host/calibration/bundle_adjustment.h\""},
      {"host/render/scene.cpp", "#include \"device/recorder.h\""},
      {"host/calibration/zhang.cpp", "#include <frobnicate/solver.h>"},
  }};
  for (const Sample& sample : bad) EXPECT_EQ(check_includes(sample.file, sample.source).size(), 1u) << sample.source;
  EXPECT_EQ(check_includes("attic/old.cpp", "").size(), 1u);
}

TEST(IncludeTable, AcceptsWhatTheHouseAllows) {
  EXPECT_TRUE(check_includes("common/session.cpp",
                             "#include <sqlite3.h>\n#include <vector>\n#include <unistd.h>\n"
                             "#include \"common/session.h\"\n// #include <opencv2/core.hpp>\n")
                  .empty());
  EXPECT_TRUE(check_includes("host/light_field/resample.cpp", "#include \"host/calibration/calibration.h\"\n").empty());
  EXPECT_TRUE(check_includes("tests/common/x_test.cpp", "#include <opencv2/core.hpp>\n").empty());
}

TEST(IncludeTable, NamesFileLineAndReason) {
  const auto faults = check_includes("common/image.cpp", "// a\n#include <opencv2/core.hpp>\n");
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0], "common/image.cpp:2: includes opencv2/core.hpp: common/ may not use OpenCV");
}

// The tree itself.
TEST(IncludeTable, HoldsInTheWholeTree) {
  const fs::path root = MF_SOURCE_DIR;
  std::vector<std::string> faults;
  int files = 0;
  for (const char* folder : {"common", "device", "host", "hw-sim", "tests"}) {
    if (!fs::exists(root / folder)) continue;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root / folder)) {
      const fs::path extension = entry.path().extension();
      if (!entry.is_regular_file() || (extension != ".h" && extension != ".cpp")) continue;
      std::ifstream in(entry.path());
      const std::string source{std::istreambuf_iterator<char>(in), {}};
      const auto found = check_includes(fs::relative(entry.path(), root), source);
      faults.insert(faults.end(), found.begin(), found.end());
      ++files;
    }
  }
  EXPECT_GT(files, 30) << "looked in the wrong place: " << root;
  for (const std::string& fault : faults) ADD_FAILURE() << fault;
}

}  // namespace
}  // namespace mf::house
