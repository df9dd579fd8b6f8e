// SPDX-License-Identifier: Apache-2.0
#include "device/rig.h"

#include <gtest/gtest.h>
#include <sys/mount.h>

#include <fstream>

#include "common/error.h"
#include "tests/device/scripted_camera.h"
#include "tests/support/temporary_folder.h"

namespace mf {
namespace {

using std::chrono::milliseconds;
using test::ScriptedCamera;
namespace fs = std::filesystem;

// A rig with a scripted camera of five-millisecond frames, and what it told.
class TestRig {
 public:
  explicit TestRig(const fs::path& recordings, int frames = 1'000'000) {
    script.frames = frames;
    run = std::make_shared<test::ScriptRun>(script);
    options.recordings = recordings;
    options.header = test::header_with_target();
    options.reopen_each = milliseconds(20);
    options.tell_each = milliseconds(50);
    options.least_free_bytes = 0;
  }
  Rig& operator*() {
    if (!rig) rig.emplace([run = run] { return std::make_unique<ScriptedCamera>(run); }, options, links());
    return *rig;
  }
  Rig* operator->() { return &**this; }
  RigLinks links() {
    return {{}, [this](const RigStatus& s) {
              if (told.empty() || told.back() != s.state) told.push_back(s.state);
            }};
  }
  // Steps until the condition holds; false after ten seconds.
  template <typename Condition>
  bool run_until(const Condition& condition) {
    const auto start = std::chrono::steady_clock::now();
    while (std::chrono::steady_clock::now() - start < std::chrono::seconds(10)) {
      (**this).step();
      if (condition()) return true;
    }
    return false;
  }

  test::Script script;
  std::shared_ptr<test::ScriptRun> run;
  RigOptions options;
  std::vector<RigState> told;
  std::optional<Rig> rig;
};

TEST(Rig, StartsAndStopsRecordingsOneAfterTheOther) {
  const test::TemporaryFolder folder;
  TestRig rig(folder.path());
  std::vector<std::string> sessions;
  for (int i = 0; i < 2; ++i) {
    ASSERT_TRUE(rig.run_until([&] { return rig->status().frame_rate_hz > 0; }));  // it runs while it is idle, too
    const auto pressed = std::chrono::steady_clock::now();
    rig->obey(RigCommand::start);
    rig->obey(RigCommand::start);  // a second press is none
    ASSERT_TRUE(rig.run_until([&] { return rig->status().state == RigState::recording; }));
    RecordProperty("ms_to_first_durable_frame",
                   std::to_string((std::chrono::steady_clock::now() - pressed) / milliseconds(1)));
    EXPECT_GT(rig->status().durable_frames, 0);
    ASSERT_TRUE(rig.run_until([&] { return rig->status().durable_frames >= 50; }));
    rig->obey(RigCommand::stop);
    EXPECT_EQ(rig->status().state, RigState::done);
    EXPECT_EQ(rig->status().problem, "");
    sessions.push_back(rig->status().session);
  }
  EXPECT_NE(sessions[0], sessions[1]);
  for (const std::string& session : sessions) {
    const SessionReader reader(session);
    EXPECT_GE(reader.frames().size(), 50U);
    EXPECT_TRUE(reader.gaps().empty());
    EXPECT_FALSE(fs::exists(fs::path(session) / "session.db-wal")) << "the session was not closed";
  }
  const std::vector<RigState> expected{RigState::idle, RigState::recording, RigState::done, RigState::recording};
  EXPECT_EQ(std::vector(rig.told.begin(), rig.told.begin() + 4), expected);
}

TEST(Rig, ACameraThatDiesWhileRecordingIsAProblemUntilItIsBack) {
  const test::TemporaryFolder folder;
  TestRig rig(folder.path());
  rig.run->script.dies_after = 60;
  rig.run->script.dead_for = milliseconds(300);
  rig->obey(RigCommand::start);
  ASSERT_TRUE(rig.run_until([&] { return rig->status().problem.find("camera") != std::string::npos; }));
  ASSERT_TRUE(rig.run_until([&] { return rig->status().problem.empty() && rig->status().durable_frames > 80; }));
  rig->obey(RigCommand::stop);
  EXPECT_EQ(SessionReader(rig->status().session).gaps().size(), 1U);
}

TEST(Rig, ADiskThatLosesASessionGetsAnotherOne) {
  const test::TemporaryFolder folder;
  TestRig rig(folder.path());
  rig->obey(RigCommand::start);
  ASSERT_TRUE(rig.run_until([&] { return rig->status().durable_frames >= 20; }));
  const fs::path first = rig->status().session;
  fs::rename(first / "frames", first / "away");  // every name in it is refused from now on
  ASSERT_TRUE(rig.run_until([&] { return rig->status().session != first.string(); }));
  EXPECT_NE(rig->status().problem.find("goes on"), std::string::npos) << rig->status().problem;
  const std::int64_t before = rig->status().durable_frames;  // of both sessions together
  ASSERT_TRUE(rig.run_until([&] { return rig->status().durable_frames >= before + 20; }));
  rig->obey(RigCommand::stop);
  EXPECT_EQ(rig->status().session, first.string() + "-2");
  EXPECT_NE(rig->status().problem, "") << "the alarm stays";
  fs::rename(first / "away", first / "frames");
  for (const fs::path& session : {first, fs::path(rig->status().session)}) {
    const SessionReader reader(session);
    EXPECT_GE(reader.frames().size(), 20U);
    for (const SessionFrame& frame : reader.frames()) (void)reader.read_frame(frame);
  }
}

// A small file system of its own; nothing where that is not allowed.
class SmallDisk {
 public:
  SmallDisk(fs::path where, const char* size) : where_(std::move(where)) {
    fs::create_directory(where_);
    mounted_ = ::mount("tmpfs", where_.c_str(), "tmpfs", 0, size) == 0;
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;
  ~SmallDisk() {
    if (mounted_) ::umount2(where_.c_str(), MNT_DETACH);
  }
  [[nodiscard]] bool mounted() const { return mounted_; }

 private:
  fs::path where_;
  bool mounted_ = false;
};

TEST(Rig, AFullDiskEndsTheRecordingAndKeepsAllOfIt) {
  const test::TemporaryFolder folder;
  const SmallDisk disk(folder / "disk", "size=2m");
  if (!disk.mounted()) GTEST_SKIP() << "mounting a small disk needs root";
  TestRig rig(folder / "disk");
  rig->obey(RigCommand::start);
  ASSERT_TRUE(rig.run_until([&] { return rig->status().state == RigState::error; }));
  EXPECT_NE(rig->status().problem.find("No space left"), std::string::npos) << rig->status().problem;
  const std::int64_t acknowledged = rig->status().durable_frames;
  EXPECT_GT(acknowledged, 20);
  const SessionReader reader(rig->status().session);
  EXPECT_GE(static_cast<std::int64_t>(reader.frames().size()), acknowledged);
  for (const SessionFrame& frame : reader.frames())
    EXPECT_EQ(std::get<ImageU16>(reader.read_frame(frame).pixels).data,
              test::scripted_codes(frame.arrival->device_frame).data);
}

TEST(Rig, WithoutSpaceNothingIsBegun) {
  const test::TemporaryFolder folder;
  TestRig rig(folder.path());
  rig.options.least_free_bytes = std::int64_t{1} << 60;
  rig->obey(RigCommand::start);
  EXPECT_EQ(rig->status().state, RigState::error);
  EXPECT_NE(rig->status().problem.find("free some space"), std::string::npos);
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

}  // namespace
}  // namespace mf
