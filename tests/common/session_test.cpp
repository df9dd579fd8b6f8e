// SPDX-License-Identifier: Apache-2.0
#include "common/session.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sqlite3.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>

#include "common/file_bytes.h"
#include "tests/support/expect_input_error.h"
#include "tests/support/pictures.h"
#include "tests/support/temporary_folder.h"

namespace mf {
namespace {

namespace fs = std::filesystem;
using test::contains;
using test::input_error_of;

constexpr int width = 36, height = 28;

SessionHeader header_of(const PixelFormat& format) {
  SessionHeader header;
  header.format = format;
  header.width = width;
  header.height = height;
  header.black_level_hint = 64;
  header.mirror_reflectance = 0.92;
  header.target = {"tag36h11", {0.34, 0.26}, {{0, 0.034, {-0.195, 0.155}}, {7, 0.034, {0.195, -0.155}}}};
  header.world = WorldTarget{"tag25h9",
                             {{100, 0.08, {-0.28, -0.2, 0.001}}, {101, 0.06, {0.28, 0.2, 0}}},
                             Checkerboard{{8, 6}, {0, 0, 0.0005}, {0.4, 0.3}}};
  header.reference = SessionHeader::Reference{"scene.png", 20.5, 10.5, 3, {0.75, 0.5, 0.25}};
  return header;
}

Frame frame_of(const PixelFormat& format, int i, FrameRole role = FrameRole::mirror) {
  const FrameInfo info{fmt::format("{:05}.png", i), role, 0.01 * (i + 1), 0.3 * i, i / 37.0};
  return {info, test::random_pixels(format, width, height, static_cast<unsigned>(i))};
}

void write_session(const fs::path& folder, const PixelFormat& format, int frames,
                   SessionWriter::Durability durability = SessionWriter::Durability::each) {
  SessionWriter writer(folder, header_of(format), {durability});
  for (int i = 0; i < frames; ++i) EXPECT_EQ(writer.append(frame_of(format, i)), i);
  writer.finish();
}

void run_sql(const fs::path& folder, const char* sql) {
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open((folder / "session.db").c_str(), &database), SQLITE_OK);
  EXPECT_EQ(sqlite3_exec(database, sql, nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(database);
  sqlite3_close(database);
}

class EveryFormat : public testing::TestWithParam<const char*> {};

TEST_P(EveryFormat, RoundTripsBitForBit) {
  const test::TemporaryFolder folder;
  const PixelFormat format = parse_pixel_format(GetParam()).value();
  for (const auto durability : {SessionWriter::Durability::each, SessionWriter::Durability::batches}) {
    const fs::path session = folder / (durability == SessionWriter::Durability::each ? "a" : "b");
    write_session(session, format, 3, durability);
    const SessionReader reader(session);
    EXPECT_EQ(reader.header().format, format);
    ASSERT_EQ(reader.frames().size(), 3U);
    for (int i = 0; i < 3; ++i) {
      const Frame expected = frame_of(format, i);
      const Frame read = reader.read_frame(reader.frames().at(static_cast<std::size_t>(i)));
      EXPECT_TRUE(test::same_pixels(read.pixels, expected.pixels));
      EXPECT_EQ(read.info.name, expected.info.name);
      EXPECT_EQ(read.info.exposure_s, expected.info.exposure_s);
      EXPECT_EQ(read.info.nd_density, expected.info.nd_density);
      EXPECT_EQ(read.info.time_s, expected.info.time_s);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Session, EveryFormat,
                         testing::Values("Mono8", "Mono10", "Mono16", "BayerRG12", "BayerGR12", "BayerGB14", "BayerBG8",
                                         "RGB8", "RGB16", "MonoFloat", "RGBFloat"));

TEST(Session, HeaderRoundTrips) {
  const test::TemporaryFolder folder;
  write_session(folder / "s", {}, 0);
  const SessionReader reader(folder / "s");
  const SessionHeader& header = reader.header();
  EXPECT_EQ(header.width, width);
  EXPECT_EQ(header.height, height);
  EXPECT_EQ(header.black_level_hint, 64);
  EXPECT_EQ(header.mirror_reflectance, 0.92);
  EXPECT_EQ(header.target.family, "tag36h11");
  ASSERT_NE(header.target.find(7), nullptr);
  EXPECT_EQ(header.target.find(7)->centre_m, Eigen::Vector2d(0.195, -0.155));
  EXPECT_EQ(header.target.find(7)->size_m, 0.034);
  ASSERT_TRUE(header.world);
  EXPECT_EQ(header.world->find(101)->centre_in_world, Eigen::Vector3d(0.28, 0.2, 0));
  EXPECT_EQ(header.world->find(101)->size_m, 0.06);
  ASSERT_TRUE(header.world->checkerboard);
  EXPECT_EQ(header.world->checkerboard->squares, (std::array<int, 2>{8, 6}));
  ASSERT_TRUE(header.reference);
  EXPECT_EQ(header.reference->frame, "scene.png");
  EXPECT_EQ(header.reference->radiance, (std::vector<double>{0.75, 0.5, 0.25}));
}

TEST(Session, FramesAreChosenByRole) {
  const test::TemporaryFolder folder;
  {
    SessionWriter writer(folder / "s", header_of({}), {});
    writer.append(frame_of({}, 0));
    writer.append(frame_of({}, 0, FrameRole::sweep));  // the same name in another role
    writer.append(frame_of({}, 1));
    writer.finish();
  }
  const SessionReader reader(folder / "s");
  EXPECT_EQ(reader.frames(FrameRole::mirror).size(), 2U);
  EXPECT_EQ(reader.frames(FrameRole::sweep).at(0).id, 1);
  EXPECT_TRUE(reader.frames(FrameRole::scene).empty());
}

TEST(Session, AFinishedSessionIsItsFramesAndOneIndexFile) {
  const test::TemporaryFolder folder;
  write_session(folder / "s", {}, 2);
  std::vector<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(folder / "s"))
    names.push_back(entry.path().lexically_relative(folder / "s").string());
  std::sort(names.begin(), names.end());
  EXPECT_EQ(names, (std::vector<std::string>{"frames", "frames/000000.tif", "frames/000001.tif", "session.db"}));
}

TEST(Session, TheIndexKeepsSizeAndCrcOfEachFile) {
  const test::TemporaryFolder folder;
  write_session(folder / "s", {}, 1);
  const SessionReader reader(folder / "s");
  const std::string bytes = read_file_bytes(folder / "s/frames/000000.tif");
  EXPECT_EQ(reader.frames().at(0).bytes, static_cast<std::int64_t>(bytes.size()));
  EXPECT_EQ(reader.frames().at(0).crc32, crc32(bytes));
}

TEST(Session, ManyThreadsReadAtOnce) {
  const test::TemporaryFolder folder;
  write_session(folder / "s", {}, 8);
  const SessionReader reader(folder / "s");
  std::vector<std::thread> threads;
  threads.reserve(4);
  std::atomic<int> right = 0;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&] {
      for (int i = 0; i < 8; ++i) {
        const Frame read = reader.read_frame(reader.frames().at(static_cast<std::size_t>(i)));
        if (test::same_pixels(read.pixels, frame_of({}, i).pixels)) ++right;
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(right, 32);
}

// A process of its own appends frames and is killed without finish(): every frame that append() told of is there.
TEST(Session, AKilledWriterLosesNothingThatItHadTold) {
  const test::TemporaryFolder folder;
  const fs::path session = folder / "s";
  std::array<int, 2> told{};
  ASSERT_EQ(::pipe(told.data()), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    SessionWriter writer(session, header_of({}), {});
    for (int i = 0; i < 100; ++i) {
      writer.append(frame_of({}, i));
      const auto count = static_cast<char>(i + 1);
      if (::write(told[1], &count, 1) != 1) ::_exit(1);
    }
    ::pause();  // the writer must never get as far as its destructor
  }
  ::close(told[1]);
  char count = 0;
  while (count < 5 && ::read(told[0], &count, 1) == 1) {
  }
  {
    const SessionReader beside_the_writer(session);
    EXPECT_GE(beside_the_writer.frames().size(), 5U);
  }
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  while (::read(told[0], &count, 1) == 1) {  // what it still told before it died
  }
  ::close(told[0]);
  ASSERT_GE(count, 5);
  const SessionReader reader(session);
  ASSERT_GE(reader.frames().size(), static_cast<std::size_t>(count));
  for (std::size_t i = 0; i < reader.frames().size(); ++i)
    EXPECT_TRUE(
        test::same_pixels(reader.read_frame(reader.frames()[i]).pixels, frame_of({}, static_cast<int>(i)).pixels));
}

TEST(Session, InBatchesNoFrameIsListedBeforeItsCommit) {
  const test::TemporaryFolder folder;
  SessionWriter writer(folder / "s", header_of({}), {SessionWriter::Durability::batches});
  writer.append(frame_of({}, 0));
  EXPECT_TRUE(SessionReader(folder / "s").frames().empty());
  EXPECT_EQ(writer.commit(), 1);
  EXPECT_EQ(SessionReader(folder / "s").frames().size(), 1U);
  writer.append(frame_of({}, 1));
  writer.finish();
  EXPECT_EQ(SessionReader(folder / "s").frames().size(), 2U);
}

TEST(Session, ArrivalsGapsAndDocumentsComeBack) {
  const test::TemporaryFolder folder;
  SessionWriter writer(folder / "s", header_of({}), {SessionWriter::Durability::batches});
  EncodedFrame first = writer.encode(frame_of({}, 0), TiffCompression::none);
  first.arrival = FrameArrival{7, 70, 700, 7000};
  writer.append(first);
  writer.append(FrameGap{1, 3, 800, "packets were lost"});
  writer.append(frame_of({}, 1));
  writer.write_document("device", {{"model", "a"}});
  writer.write_document("device", {{"model", "b"}});
  writer.finish();
  const SessionReader reader(folder / "s");
  ASSERT_EQ(reader.frames().size(), 2U);
  ASSERT_TRUE(reader.frames()[0].arrival.has_value());
  EXPECT_EQ(reader.frames()[0].arrival->device_frame, 7);
  EXPECT_EQ(reader.frames()[0].arrival->device_ns, 70);
  EXPECT_EQ(reader.frames()[0].arrival->monotonic_ns, 700);
  EXPECT_EQ(reader.frames()[0].arrival->realtime_ns, 7000);
  EXPECT_FALSE(reader.frames()[1].arrival.has_value());
  EXPECT_TRUE(test::same_pixels(reader.read_frame(reader.frames()[0]).pixels, frame_of({}, 0).pixels));
  ASSERT_EQ(reader.gaps().size(), 1U);
  EXPECT_EQ(reader.gaps()[0].next_id, 1);
  EXPECT_EQ(reader.gaps()[0].missing, 3);
  EXPECT_EQ(reader.gaps()[0].reason, "packets were lost");
  EXPECT_EQ(reader.document("device").value()["model"], "b");
  EXPECT_FALSE(reader.document("none").has_value());
}

TEST(Session, WhatWasSeenWhileRecordingComesBack) {
  const test::TemporaryFolder folder;
  SessionWriter writer(folder / "s", header_of({}), {SessionWriter::Durability::batches});
  FrameTags seen;
  seen.frame = writer.append(frame_of({}, 0));
  TagDetection tag;
  tag.id = 17;
  tag.corners_px = {{{1.5, 2.25}, {30.5, 2.5}, {30, 31}, {1, 30}}};
  seen.tags = {tag};
  seen.cam_from_mirror = Rigid3{Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5), {0.1, -0.2, 1.5}};
  writer.append(seen);
  writer.append(frame_of({}, 1));
  writer.finish();
  const std::vector<FrameTags> tags = SessionReader(folder / "s").tags();
  ASSERT_EQ(tags.size(), 1U);
  EXPECT_EQ(tags[0].frame, 0);
  ASSERT_EQ(tags[0].tags.size(), 1U);
  EXPECT_EQ(tags[0].tags[0].id, 17);
  EXPECT_EQ(tags[0].tags[0].corners_px, tag.corners_px);
  ASSERT_TRUE(tags[0].cam_from_mirror.has_value());
  EXPECT_EQ(tags[0].cam_from_mirror->translation, seen.cam_from_mirror->translation);
  EXPECT_EQ(tags[0].cam_from_mirror->rotation.coeffs(), seen.cam_from_mirror->rotation.coeffs());
}

TEST(Session, AFileThatTheDiskRefusesIsWrittenUnderAnotherName) {
  const test::TemporaryFolder folder;
  SessionWriter writer(folder / "s", header_of({}), {SessionWriter::Durability::batches});
  fs::create_directory(folder / "s/frames/000001.tif.partial");  // opening that for writing fails
  for (int i = 0; i < 3; ++i) writer.append(frame_of({}, i));
  EXPECT_EQ(writer.written_anew(), 1);
  writer.finish();
  const SessionReader reader(folder / "s");
  ASSERT_EQ(reader.frames().size(), 3U);
  EXPECT_EQ(reader.frames()[1].file, "frames/000001-1.tif");
  for (int i = 0; i < 3; ++i)
    EXPECT_TRUE(test::same_pixels(reader.read_frame(reader.frames()[static_cast<std::size_t>(i)]).pixels,
                                  frame_of({}, i).pixels));
}

TEST(Session, AnExistingFolderIsRefusedAndKept) {
  const test::TemporaryFolder folder;
  write_session(folder / "s", {}, 1);
  const std::string error = input_error_of([&] { SessionWriter(folder / "s", header_of({}), {}); });
  EXPECT_TRUE(contains(error, "exists already"));
  EXPECT_EQ(SessionReader(folder / "s").frames().size(), 1U);
  EXPECT_TRUE(contains(input_error_of([&] { SessionWriter(folder / "none/s", header_of({}), {}); }), "none/s"));
}

TEST(Session, MissingTruncatedAndDamagedFramesNameTheFile) {
  const test::TemporaryFolder folder;
  const fs::path session = folder / "s";
  write_session(session, {}, 3);
  fs::remove(session / "frames/000000.tif");
  fs::resize_file(session / "frames/000001.tif", 300);
  {
    std::fstream file(session / "frames/000002.tif", std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(200);
    file.put('\x5a').put('\xa5');
  }
  const SessionReader reader(session);
  const auto error = [&](std::size_t i) {
    return input_error_of([&] { (void)reader.read_frame(reader.frames().at(i)); });
  };
  EXPECT_TRUE(contains(error(0), "frames/000000.tif: cannot be read"));
  EXPECT_TRUE(contains(error(1), "frames/000001.tif: is truncated"));
  EXPECT_TRUE(contains(error(2), "frames/000002.tif: is damaged"));
}

TEST(Session, AFrameOfAnotherSizeNamesTheFile) {
  const test::TemporaryFolder folder;
  write_session(folder / "s", {}, 1);
  run_sql(folder / "s", "DROP TABLE document_checks");  // as a session from before there were any
  run_sql(folder / "s", R"(UPDATE meta SET json = replace(json, '"width":36', '"width":40') WHERE key = 'camera')");
  const SessionReader reader(folder / "s");
  const std::string error = input_error_of([&] { (void)reader.read_frame(reader.frames().at(0)); });
  EXPECT_TRUE(contains(error, "frames/000000.tif: has 36 x 28 pixels, the session 40 x 28"));
}

TEST(Session, AChangedRowIsRefusedAndTheOthersAreRead) {
  const test::TemporaryFolder folder;
  write_session(folder / "s", {}, 3);
  run_sql(folder / "s", "UPDATE frames SET exposure_s = 2 * exposure_s WHERE id = 1");
  const SessionReader reader(folder / "s");
  ASSERT_EQ(reader.frames().size(), 3U);
  EXPECT_NO_THROW((void)reader.read_frame(reader.frames()[0]));
  EXPECT_NO_THROW((void)reader.read_frame(reader.frames()[2]));
  EXPECT_TRUE(contains(input_error_of([&] { (void)reader.read_frame(reader.frames()[1]); }),
                       "session.db: frames[1]: is damaged"));
}

TEST(Session, AChangedDocumentIsRefused) {
  const test::TemporaryFolder folder;
  write_session(folder / "s", {}, 1);
  run_sql(folder / "s", "UPDATE meta SET json = replace(json, '0.34', '0.35') WHERE key = 'target'");
  EXPECT_TRUE(contains(input_error_of([&] { SessionReader reader(folder / "s"); }), "session.db: target: is damaged"));
}

TEST(Session, FramesThatTheIndexDoesNotTellOfAreCounted) {
  const test::TemporaryFolder folder;
  SessionWriter writer(folder / "s", header_of({}), {SessionWriter::Durability::batches});
  writer.append(frame_of({}, 0));
  writer.commit();
  EXPECT_EQ(SessionReader(folder / "s").frames_without_row(), 0);
  writer.append(frame_of({}, 1));
  EXPECT_EQ(SessionReader(folder / "s").frames_without_row(), 1);
}

// SQLite drops what follows damage in a log, as if it had not been committed.
TEST(Session, CommitsThatADamagedLogDroppedAreToldOf) {
  const test::TemporaryFolder folder;
  SessionWriter writer(folder / "s", header_of({}), {SessionWriter::Durability::batches});
  for (int i = 0; i < 3; ++i) {
    writer.append(frame_of({}, i));
    writer.commit();
  }
  fs::copy(folder / "s", folder / "cut", fs::copy_options::recursive);
  EXPECT_TRUE(SessionReader(folder / "cut").damage().empty());
  fs::resize_file(folder / "cut/session.db-wal", fs::file_size(folder / "s/session.db-wal") - 1);
  fs::remove(folder / "cut/session.db-shm");
  const SessionReader cut(folder / "cut");
  EXPECT_EQ(cut.frames().size(), 2U);
  ASSERT_EQ(cut.damage().size(), 1U);
  EXPECT_TRUE(contains(cut.damage()[0], "session.db-wal: is damaged: its last 1 commits are lost, and 1 files"));
  std::ofstream(folder / "s/session.db-commits") << "4 00000000\n";
  const SessionReader miscounted(folder / "s");
  ASSERT_EQ(miscounted.damage().size(), 1U);
  EXPECT_TRUE(contains(miscounted.damage()[0], "session.db-commits: is damaged"));
  std::ofstream(folder / "s/session.db-commits", std::ios::trunc).close();  // as a power cut may leave it
  EXPECT_TRUE(SessionReader(folder / "s").damage().empty());
}

TEST(Session, LostRowsAreToldOf) {
  const test::TemporaryFolder folder;
  write_session(folder / "s", {}, 3);
  run_sql(folder / "s", "DELETE FROM frames WHERE id = 1; UPDATE frames SET bytes = 7 WHERE id = 2");
  const std::vector<std::string> damage = SessionReader(folder / "s").damage();
  ASSERT_EQ(damage.size(), 1U);
  EXPECT_TRUE(contains(damage[0], "session.db: 1 rows of its frames are damaged and 1 are lost"));
}

TEST(Session, WhatIsNoSessionIsToldApart) {
  const test::TemporaryFolder folder;
  const auto error = [](const fs::path& path) { return input_error_of([&] { SessionReader reader(path); }); };
  EXPECT_TRUE(contains(error(folder / "none"), "is no session"));
  fs::create_directory(folder / "text");
  std::ofstream(folder / "text/session.db") << std::string(5000, 'x');
  EXPECT_TRUE(contains(error(folder / "text"), "session.db: cannot be used as the session's index"));
  fs::create_directory(folder / "other");
  run_sql(folder / "other", "CREATE TABLE t (x)");
  EXPECT_TRUE(contains(error(folder / "other"), "is no index of a session"));
  write_session(folder / "newer", {}, 1);
  run_sql(folder / "newer", "PRAGMA user_version = 9");
  EXPECT_TRUE(contains(error(folder / "newer"), "user_version: is 9"));
  write_session(folder / "cut", {}, 1);
  fs::resize_file(folder / "cut/session.db", 5000);
  EXPECT_TRUE(contains(error(folder / "cut"), "session.db"));
}

TEST(Session, OneNameTwiceInARoleIsRefusedAndTheSessionStaysWhole) {
  const test::TemporaryFolder folder;
  {
    SessionWriter writer(folder / "s", header_of({}), {});
    writer.append(frame_of({}, 0));
    EXPECT_THROW(writer.append(frame_of({}, 0)), InputError);
    EXPECT_EQ(writer.append(frame_of({}, 1)), 1);
    writer.finish();
  }
  const SessionReader reader(folder / "s");
  ASSERT_EQ(reader.frames().size(), 2U);
  for (const SessionFrame& frame : reader.frames()) EXPECT_NO_THROW((void)reader.read_frame(frame));
}

// Read-only folders are for users; root may write anywhere, so it becomes nobody in a child process.
TEST(Session, AFinishedSessionOpensInAReadOnlyFolder) {
  if (::getuid() != 0) GTEST_SKIP() << "needs root to become another user";
  const test::TemporaryFolder folder;
  write_session(folder / "s", {}, 1);
  fs::permissions(folder.path(), fs::perms{0755});
  const pid_t child = ::fork();
  if (child == 0) {
    constexpr uid_t nobody = 65534;
    if (::setgid(nobody) != 0 || ::setuid(nobody) != 0) ::_exit(2);
    try {
      const SessionReader reader(folder / "s");
      (void)reader.read_frame(reader.frames().at(0));
    } catch (const std::exception& e) {
      fmt::print(stderr, "{}\n", e.what());
      ::_exit(1);
    }
    ::_exit(0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << WEXITSTATUS(status);
}

}  // namespace
}  // namespace mf
