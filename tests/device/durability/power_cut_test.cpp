// SPDX-License-Identifier: Apache-2.0
// A power cut is a file system's image copied while it is written, and the copy mounted: what only the page cache had
// is not in it.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <random>

#include "common/error.h"
#include "common/session.h"
#include "tests/device/durability/recorder_process.h"
#include "tests/support/full_counts.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_folder.h"

namespace mf {
namespace {

namespace fs = std::filesystem;

bool run(const std::vector<std::string>& command) {
  const test::CommandOutcome outcome = test::run_command(command);
  if (outcome.exit_code != 0) fmt::print(stderr, "{}: {}{}\n", command[0], outcome.out, outcome.err);
  return outcome.exit_code == 0;
}

// A file system in an image file, mounted as long as this lives.
class Mount {
 public:
  Mount(const fs::path& image, const fs::path& at, const std::string& options) : at_(at) {
    fs::create_directories(at);
    mounted_ = run({"mount", "-o", "loop" + options, image.string(), at.string()});
  }
  Mount(const Mount&) = delete;
  Mount& operator=(const Mount&) = delete;
  ~Mount() {
    if (mounted_) run({"umount", at_.string()});
  }
  [[nodiscard]] bool mounted() const { return mounted_; }

 private:
  fs::path at_;
  bool mounted_ = false;
};

struct Cuts {
  int cuts = 0, lossy = 0;
  std::int64_t acknowledged = 0, recovered = 0;
};

class PowerCut : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (::getuid() != 0) GTEST_SKIP() << "needs root, to mount";
    if (!fs::exists("/dev/loop-control")) GTEST_SKIP() << "needs loop devices";
    if (!test::has_program(std::string("mkfs.") + GetParam())) GTEST_SKIP() << "needs mkfs." << GetParam();
    // 320 MB: xfs takes no less; both files are sparse.
    if (!run({"truncate", "-s", "320M", image().string()}) || !make_file_system())
      GTEST_SKIP() << "no file system made";
    disk_.emplace(image(), folder_ / "disk", "");
    if (!disk_->mounted()) GTEST_SKIP() << "cannot mount: needs the right to, and a free loop device";
  }
  void TearDown() override { disk_.reset(); }

  [[nodiscard]] fs::path image() const { return folder_ / "disk.img"; }
  [[nodiscard]] bool make_file_system() const {
    if (std::string(GetParam()) == "xfs") return run({"mkfs.xfs", "-q", image().string()});
    return run({"mkfs.ext4", "-q", "-F", image().string()});
  }
  // What a reader finds after the cut; `acknowledged` at the time of it.
  void cut(test::RecorderProcess& recorder, Cuts& cuts, bool must_keep);
  [[nodiscard]] Cuts cut_again_and_again(int times, const fs::path& preload);

  test::TemporaryFolder folder_;
  std::optional<Mount> disk_;
};

void PowerCut::cut(test::RecorderProcess& recorder, Cuts& cuts, bool must_keep) {
  const test::RecorderWord word = recorder.last_word();
  const fs::path copy = folder_ / "copy.img";
  ASSERT_TRUE(run({"cp", "--sparse=always", image().string(), copy.string()}));
  // nouuid: to xfs, the copy is the file system that is mounted already.
  const Mount after(copy, folder_ / "after", std::string(GetParam()) == "xfs" ? ",nouuid" : "");
  ASSERT_TRUE(after.mounted()) << "the file system itself does not survive";
  std::int64_t recovered = 0;
  if (must_keep) {
    recovered = test::expect_recovered(folder_ / "after/session", word).frames;
  } else {
    try {
      const SessionReader reader(folder_ / "after/session");
      for (const SessionFrame& frame : reader.frames()) {
        (void)reader.read_frame(frame);
        ++recovered;
      }
    } catch (const InputError&) {  // no session, or one whose first frames are gone already
    }
  }
  ++cuts.cuts;
  cuts.acknowledged += word.durable;
  cuts.recovered += recovered;
  if (recovered < word.durable) ++cuts.lossy;
}

Cuts PowerCut::cut_again_and_again(int times, const fs::path& preload) {
  std::mt19937 random(4);
  Cuts cuts;
  while (cuts.cuts < times && !HasFatalFailure()) {
    fs::remove_all(folder_ / "disk/session");
    test::RecorderProcess recorder(folder_ / "disk/session", preload);
    for (int i = 0; i < 500 && recorder.last_word().durable == 0; ++i) ::usleep(10'000);
    EXPECT_GT(recorder.last_word().durable, 0);
    for (int i = 0; i < 5 && cuts.cuts < times && !HasFatalFailure(); ++i) {
      ::usleep(std::uniform_int_distribution<unsigned>(20'000U, 300'000U)(random));
      cut(recorder, cuts, preload.empty());
    }
  }
  return cuts;
}

TEST_P(PowerCut, NothingThatWasAcknowledgedIsLost) {
  const Cuts cuts = cut_again_and_again(test::repetitions(3, 25), {});
  EXPECT_EQ(cuts.lossy, 0);
  EXPECT_GT(cuts.acknowledged, cuts.cuts);
  fmt::print("{}: {} power cuts, {} frames acknowledged, {} recovered, {} cuts with losses\n", GetParam(), cuts.cuts,
             cuts.acknowledged, cuts.recovered, cuts.lossy);
}

TEST_P(PowerCut, WithoutSyncItLoses) {
  const Cuts cuts = cut_again_and_again(2, MF_NO_SYNC_LIBRARY);
  EXPECT_GT(cuts.lossy, 0) << "the power cut shows nothing";
  fmt::print("{} without sync: {} power cuts, {} frames acknowledged, {} recovered, {} cuts with losses\n", GetParam(),
             cuts.cuts, cuts.acknowledged, cuts.recovered, cuts.lossy);
}

INSTANTIATE_TEST_SUITE_P(Durability, PowerCut, testing::Values("ext4", "xfs"),
                         [](const auto& tested) { return std::string(tested.param); });

}  // namespace
}  // namespace mf
