// SPDX-License-Identifier: Apache-2.0
#include "device/status_socket.h"

#include <grp.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>

#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <random>
#include <thread>

#include "device/rig_status_json.h"
#include "tests/device/line_client.h"
#include "tests/device/status_examples.h"
#include "tests/support/expect_input_error.h"
#include "tests/support/temporary_folder.h"

namespace mf {
namespace {

using std::chrono::milliseconds;
using test::contains;
using test::LineClient;

// Until it is true, for ten seconds at most.
bool becomes(const std::function<bool()>& condition) {
  for (int i = 0; i < 1000 && !condition(); ++i) std::this_thread::sleep_for(milliseconds(10));
  return condition();
}

RigStatus with_frames(std::int64_t frames) {
  RigStatus s;
  s.durable_frames = frames;
  return s;
}

std::int64_t frames_of(const std::string& line) {
  return rig_status_from_json(nlohmann::json::parse(line), "line").durable_frames;
}

class StatusSocketTest : public testing::Test {
 protected:
  StatusSocketOptions options() const {
    StatusSocketOptions o;
    o.path = path_;
    o.least_interval = milliseconds(0);
    return o;
  }
  std::string error_of(const StatusSocketOptions& o) {
    return test::input_error_of([&] { const StatusSocket socket(o); });
  }
  test::TemporaryFolder folder_;
  std::filesystem::path path_ = folder_ / "status.sock";
};

TEST_F(StatusSocketTest, EveryClientGetsTheLatestStatusAndThenTheNext) {
  StatusSocket socket(options());
  socket.publish(with_frames(1));
  std::vector<LineClient> clients;
  for (int i = 0; i < 5; ++i) clients.emplace_back(path_);
  for (LineClient& client : clients) EXPECT_EQ(frames_of(client.line().value_or("{}")), 1);
  socket.publish(with_frames(2));
  for (LineClient& client : clients) EXPECT_EQ(frames_of(client.line().value_or("{}")), 2);
  EXPECT_EQ(socket.clients(), 5);
  clients.pop_back();
  EXPECT_TRUE(becomes([&] { return socket.clients() == 4; }));
}

TEST_F(StatusSocketTest, AWholeStatusCrossesWithASmallPicture) {
  StatusSocket socket(options());
  RigStatus s = test::recording_status();
  s.session = "/media/\xff\xfe";  // a path need not be UTF-8
  s.preview->grey = ImageU8(1024, 768, 1, 77);
  s.preview->frame_px_per_preview = 1;
  socket.publish(s);
  const RigStatus got = rig_status_from_json(nlohmann::json::parse(*LineClient(path_).line()), "line");
  EXPECT_EQ(got.preview->grey.width, 256);
  EXPECT_EQ(got.preview->frame_px_per_preview, 4);
  EXPECT_EQ(got.preview->grey.at(200, 100), 77);
  EXPECT_EQ(got.coverage->patches.size(), s.coverage->patches.size());
  EXPECT_TRUE(got.session.starts_with("/media/"));
}

TEST_F(StatusSocketTest, ASlowClientMissesSomeAndHoldsUpNobody) {
  StatusSocketOptions o = options();
  o.longest_blockage = std::chrono::minutes(5);  // a busy machine must not make it look dead
  StatusSocket socket(o);
  const RigStatus picture = test::recording_status();
  LineClient slow(path_), quick(path_);
  ASSERT_TRUE(becomes([&] { return socket.clients() == 2; }));
  constexpr int published = 200;
  std::chrono::nanoseconds longest{0};
  for (int i = 1; i <= published; ++i) {
    RigStatus s = picture;
    s.durable_frames = i;
    const auto before = std::chrono::steady_clock::now();
    socket.publish(std::move(s));
    longest = std::max<std::chrono::nanoseconds>(longest, std::chrono::steady_clock::now() - before);
    while (frames_of(quick.line().value_or("{}")) < i) {
    }
  }
  RecordProperty("longest_publish_us", static_cast<int>(longest.count() / 1000));
  // 200 lines of 80 kB were never stored: the slow one gets what fitted the kernel's buffer, and then the latest.
  int lines = 0;
  std::int64_t last = 0;
  while (last < published) {
    const std::optional<std::string> line = slow.line();
    ASSERT_TRUE(line);
    EXPECT_GT(frames_of(*line), last);
    last = frames_of(*line);
    ++lines;
  }
  EXPECT_LT(lines, published / 2);
}

TEST_F(StatusSocketTest, AClientThatTakesNothingIsDropped) {
  StatusSocketOptions o = options();
  o.longest_blockage = milliseconds(200);
  StatusSocket socket(o);
  const LineClient stuck(path_);
  ASSERT_TRUE(becomes([&] { return socket.clients() == 1; }));
  EXPECT_TRUE(becomes([&] {
    socket.publish(test::recording_status());
    return socket.clients() == 0;
  }));
}

TEST_F(StatusSocketTest, OneClientTooManyIsTurnedAway) {
  StatusSocketOptions o = options();
  o.most_clients = 2;
  StatusSocket socket(o);
  socket.publish(with_frames(1));
  LineClient first(path_), second(path_);
  EXPECT_TRUE(first.line() && second.line());
  LineClient third(path_);
  EXPECT_FALSE(third.line());
  EXPECT_TRUE(third.ended());
}

TEST_F(StatusSocketTest, AStartIsHandedOnOnce) {
  StatusSocketOptions o = options();
  o.accept_start = true;
  StatusSocket socket(o);
  LineClient client(path_);
  EXPECT_FALSE(socket.take_start_request());
  client.send(R"({"command": "start", "token": "open sesame"})"
              "\n");
  EXPECT_TRUE(contains(client.answer(), R"("accepted":true)"));
  client.send("{\"command\": \"start\", \"token\": \"again\"}\n");
  EXPECT_TRUE(contains(client.answer(), "another request waits"));
  const std::optional<StartRequest> start = socket.take_start_request();
  ASSERT_TRUE(start);
  EXPECT_EQ(start->token, "open sesame");
  EXPECT_EQ(start->user, ::geteuid());
  EXPECT_EQ(start->process, ::getpid());
  EXPECT_FALSE(socket.take_start_request());
}

TEST_F(StatusSocketTest, AStartIsRefusedWhenOffOrRecording) {
  const std::string start = "{\"command\": \"start\", \"token\": \"t\"}\n";
  {
    StatusSocket off(options());
    LineClient client(path_);
    client.send(start);
    EXPECT_TRUE(contains(client.answer(), "remote start is off"));
    EXPECT_FALSE(off.take_start_request());
  }
  StatusSocketOptions o = options();
  o.accept_start = true;
  StatusSocket socket(o);
  socket.publish(test::recording_status());
  LineClient client(path_);
  client.send(start);
  EXPECT_TRUE(contains(client.answer(), "recording already"));
  EXPECT_FALSE(socket.take_start_request());
}

// As another user of the machine, in a process of its own: what the socket answers to a start.
std::string answer_to_user(const std::filesystem::path& path, uid_t user, gid_t extra_group) {
  std::array<int, 2> ends{};
  EXPECT_EQ(::pipe(ends.data()), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    if (::setgroups(1, &extra_group) != 0 || ::setgid(user) != 0 || ::setuid(user) != 0) ::_exit(1);
    LineClient client(path);
    client.send("{\"command\": \"start\", \"token\": \"t\"}\n");
    const std::string answer = client.answer();
    ::_exit(::write(ends[1], answer.data(), answer.size()) < 0 ? 1 : 0);
  }
  ::close(ends[1]);
  std::array<char, 1024> text{};
  const ssize_t got = ::read(ends[0], text.data(), text.size());
  ::close(ends[0]);
  ::waitpid(child, nullptr, 0);
  return {text.data(), static_cast<std::size_t>(std::max<ssize_t>(got, 0))};
}

TEST_F(StatusSocketTest, OnlyRootTheOwnUserAndTheGroupMayAskForAStart) {
  if (::geteuid() != 0) GTEST_SKIP() << "needs root, to become other users";
  const group* games = ::getgrnam("games");
  if (games == nullptr) GTEST_SKIP() << "there is no group games";
  const gid_t trusted = games->gr_gid;
  constexpr uid_t stranger = 65534;
  StatusSocketOptions o = options();
  o.accept_start = true;
  o.group = "games";
  StatusSocket socket(o);
  struct stat made {};
  ASSERT_EQ(::stat(path_.c_str(), &made), 0);
  EXPECT_EQ(made.st_mode & 07777U, 0660U);
  EXPECT_EQ(made.st_gid, trusted);
  // Even where the file's own mode would let everybody in:
  ::chmod(path_.c_str(), 0666);
  ::chmod(folder_.path().c_str(), 0755);
  EXPECT_TRUE(contains(answer_to_user(path_, stranger, stranger), "may not ask"));
  EXPECT_FALSE(socket.take_start_request());
  EXPECT_TRUE(contains(answer_to_user(path_, stranger, trusted), R"("accepted":true)"));
  ASSERT_TRUE(socket.take_start_request());
  // The file's mode by itself: another user does not even connect.
  ::chmod(path_.c_str(), 0660);
  EXPECT_EQ(answer_to_user(path_, stranger, stranger), "");
}

TEST_F(StatusSocketTest, HostileLinesAreAnsweredAndTooLongOnesEndTheConnection) {
  StatusSocketOptions o = options();
  o.accept_start = true;
  StatusSocket socket(o);
  socket.publish(with_frames(1));
  for (const std::string& line :
       {std::string("{}"), std::string("[]"), std::string("3"), std::string(""), std::string("{\"command\":\"stop\"}"),
        std::string("{\"command\":\"start\"}"), std::string("{\"command\":\"start\",\"token\":7}"),
        std::string("\0\xff\x80{", 4), std::string(2000, '['), std::string("{\"command\":[\"start\"]}")}) {
    LineClient client(path_);
    client.send(line + "\n");
    EXPECT_TRUE(contains(client.answer(), R"("accepted":false)")) << line;
    EXPECT_FALSE(socket.take_start_request());
  }
  LineClient talker(path_);
  talker.send(std::string(5000, 'x'));
  while (talker.line()) {
  }
  EXPECT_TRUE(talker.ended());
  // Thousands of commands, and none of the answers read.
  {
    LineClient flood(path_);
    const std::string lines(60'000, '\n');
    for (int i = 0; i < 20; ++i) flood.send(lines);
  }
  LineClient after(path_);
  EXPECT_EQ(frames_of(after.line().value_or("{}")), 1);
}

TEST_F(StatusSocketTest, ADaemonThatComesBackReplacesTheStaleSocket) {
  // As a killed daemon leaves it: bound, and nobody behind it.
  {
    const OwnedFd dead(::socket(AF_UNIX, SOCK_STREAM, 0));
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path_.string().copy(address.sun_path, sizeof(address.sun_path) - 1);
    ASSERT_EQ(::bind(dead.get(), reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
  }
  EXPECT_FALSE(LineClient(path_).connected());
  for (int life = 1; life <= 3; ++life) {
    StatusSocket socket(options());
    socket.publish(with_frames(life));
    EXPECT_EQ(frames_of(LineClient(path_).line().value_or("{}")), life);
  }
  EXPECT_FALSE(std::filesystem::exists(path_));
}

TEST_F(StatusSocketTest, WhatCannotBeServedIsNamed) {
  const StatusSocket first(options());
  EXPECT_TRUE(contains(error_of(options()), "is served by another mirrorfieldd"));
  EXPECT_TRUE(LineClient(path_).connected()) << "the first one was disturbed";
  StatusSocketOptions o = options();
  o.path = folder_ / "none" / "status.sock";
  EXPECT_TRUE(contains(error_of(o), "make the folder"));
  o.path = folder_ / std::string(200, 'x');
  EXPECT_TRUE(contains(error_of(o), "a socket's path"));
  o = options();
  o.path = folder_ / "file";
  std::ofstream(o.path) << "precious";
  EXPECT_TRUE(contains(error_of(o), "no socket"));
  EXPECT_TRUE(std::filesystem::exists(o.path));
  o = options();
  o.path = folder_ / "other.sock";
  o.group = "no_such_group_here";
  EXPECT_TRUE(contains(error_of(o), "no_such_group_here"));
}

}  // namespace
}  // namespace mf
