// SPDX-License-Identifier: Apache-2.0
// mirrorfield-status itself over HTTP, fed by the daemon's own socket.
#include <gtest/gtest.h>
#include <sys/un.h>

#include <algorithm>
#include <fstream>
#include <list>
#include <nlohmann/json.hpp>
#include <thread>

#include "device/rig_status_json.h"
#include "device/status_socket.h"
#include "tests/device/status/http_client.h"
#include "tests/device/status/status_program.h"
#include "tests/device/status_examples.h"
#include "tests/support/expect_input_error.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_folder.h"

namespace mf {
namespace {

using std::chrono::milliseconds;
using test::contains;
using test::HttpClient;
using SteadyClock = std::chrono::steady_clock;

constexpr const char* right_token = "correct-horse-battery";

class PageServerTest : public testing::Test {
 protected:
  std::unique_ptr<StatusSocket> make_rig(bool accept_start = false) {
    StatusSocketOptions o;
    o.path = socket_;
    o.accept_start = accept_start;
    o.least_interval = milliseconds(0);
    return std::make_unique<StatusSocket>(o);
  }
  std::vector<std::string> with_token() {
    std::ofstream(folder_ / "token") << right_token << "\n";
    std::filesystem::permissions(folder_ / "token", std::filesystem::perms(0600));
    return {"--token-file", folder_ / "token"};
  }
  // The whole answer to a request without a body, or with one.
  static std::string ask(const test::StatusProgram& program, const std::string& first_line,
                         const std::string& headers = {}, const std::string& body = {}) {
    HttpClient client(program.port());
    const std::string host = headers.find("Host:") == std::string::npos ? "Host: " + program.host() + "\r\n" : "";
    client.send(first_line + " HTTP/1.1\r\n" + host + headers + "Connection: close\r\n\r\n" + body);
    return client.everything();
  }
  static std::string start(const test::StatusProgram& program, const std::string& body, std::string headers = {}) {
    if (headers.empty()) headers = "Origin: http://" + program.host() + "\r\nContent-Type: application/json\r\n";
    return ask(program, "POST /start", headers + "Content-Length: " + std::to_string(body.size()) + "\r\n", body);
  }
  static std::string status_line(const std::string& answer) { return answer.substr(0, answer.find("\r\n")); }
  static nlohmann::json status_of(const test::StatusProgram& program) {
    const std::string answer = ask(program, "GET /status.json");
    return nlohmann::json::parse(answer.substr(answer.find("\r\n\r\n") + 4));
  }
  template <typename Condition>
  static bool becomes(Condition&& condition) {
    for (int i = 0; i < 500; ++i) {
      if (condition()) return true;
      std::this_thread::sleep_for(milliseconds(20));
    }
    return false;
  }
  test::TemporaryFolder folder_;
  std::string socket_ = folder_ / "status.sock";
};

TEST_F(PageServerTest, RoutesAndTheirHeaders) {
  const test::StatusProgram program(socket_);
  const std::vector<std::pair<std::string, std::string>> answers{
      {"GET /", "200"},        {"HEAD /", "200"},      {"GET /status.json", "200"}, {"GET /favicon.ico", "204"},
      {"GET /nothing", "404"}, {"POST /", "405"},      {"DELETE /", "405"},         {"OPTIONS /start", "405"},
      {"GET /start", "405"},   {"POST /start", "403"}, {"DELETE /session", "404"},  {"HEAD /events", "405"}};
  for (const auto& [request, code] : answers) {
    const std::string answer = ask(program, request);
    EXPECT_TRUE(contains(status_line(answer), " " + code + " ")) << request;
    for (const char* header :
         {"Content-Security-Policy: default-src 'none';", "X-Content-Type-Options: nosniff", "X-Frame-Options: DENY",
          "Referrer-Policy: no-referrer", "Cache-Control: no-store", "Cross-Origin-Resource-Policy: same-origin"})
      EXPECT_TRUE(contains(answer, header)) << request;
    EXPECT_EQ(answer.find("Access-Control"), std::string::npos);
  }
  EXPECT_TRUE(contains(ask(program, "DELETE /"), "Allow: GET, HEAD"));
  const std::string page = ask(program, "GET /?query=ignored");
  EXPECT_TRUE(contains(page, "Content-Type: text/html"));
  for (const char* outside : {"src=", "http://", "https://", "@import", "url("})
    EXPECT_EQ(page.substr(page.find("\r\n\r\n")).find(outside), std::string::npos) << outside << ": not self-contained";
}

TEST_F(PageServerTest, AForeignHostSeesNothing) {
  const auto rig = make_rig();
  rig->publish(test::recording_status());
  const test::StatusProgram program(socket_);
  for (const char* path : {"/", "/status.json", "/events"}) {
    const std::string answer = ask(program, std::string("GET ") + path, "Host: evil.com\r\n");
    EXPECT_TRUE(contains(status_line(answer), " 403 ")) << path;
    EXPECT_EQ(answer.find("recording"), std::string::npos);
  }
}

TEST_F(PageServerTest, TheDaemonMayComeAndGo) {
  const test::StatusProgram program(socket_);
  nlohmann::json status = status_of(program);
  EXPECT_EQ(status["connected"], false);
  EXPECT_TRUE(contains(status["problem"], "mirrorfieldd does not run"));
  for (int life = 1; life <= 3; ++life) {
    auto rig = make_rig();
    RigStatus s = test::recording_status();
    s.durable_frames = life;
    rig->publish(s);
    ASSERT_TRUE(becomes([&] {
      status = status_of(program);
      return status["connected"] == true && status.contains("status") && status["status"]["durable_frames"] == life;
    })) << life;
    EXPECT_FALSE(status["status"]["preview"].contains("grey"));
    rig.reset();
    ASSERT_TRUE(becomes([&] { return status_of(program)["connected"] == false; }));
    EXPECT_EQ(status_of(program)["status"]["durable_frames"], life);  // what was known last
  }
}

// As the daemon's socket, but it says what it likes.
TEST_F(PageServerTest, ADaemonThatSpeaksNonsenseIsShownAsAProblem) {
  for (const std::string& nonsense :
       {std::string("what?\n"), std::string("{\"state\":\"asleep\"}\n"),
        std::string("{\"answer\":\"start\",\"accepted\":3}\n"), std::string("[]\n"), std::string(5'000'000, 'x')}) {
    ::unlink(socket_.c_str());
    const OwnedFd listening(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    socket_.copy(address.sun_path, sizeof(address.sun_path) - 1);
    ASSERT_EQ(::bind(listening.get(), reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
    ASSERT_EQ(::listen(listening.get(), 8), 0);
    const std::jthread liar([&](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        pollfd polled{listening.get(), POLLIN, 0};
        if (::poll(&polled, 1, 20) <= 0) continue;
        const OwnedFd client(::accept(listening.get(), nullptr, nullptr));
        for (std::size_t at = 0; at < nonsense.size();) {
          const ssize_t went = ::send(client.get(), nonsense.data() + at, nonsense.size() - at, MSG_NOSIGNAL);
          if (went <= 0) break;
          at += static_cast<std::size_t>(went);
        }
        std::this_thread::sleep_for(milliseconds(200));
      }
    });
    {
      const test::StatusProgram program(socket_);
      EXPECT_TRUE(becomes([&] {
        return contains(status_of(program)["problem"], "mirrorfieldd's status") ||
               contains(status_of(program)["problem"], "too long a line");
      })) << nonsense.substr(0, 40);
    }
  }
}

TEST_F(PageServerTest, AStartReachesTheRigAndItsAnswerThePage) {
  const auto rig = make_rig(true);
  rig->publish(RigStatus{});
  test::StatusProgram program(socket_, with_token());
  const std::string good = std::string("{\"token\":\"") + right_token + "\"}";
  const std::string here = "http://" + program.host();
  const std::string json = "Content-Type: application/json\r\n";
  EXPECT_TRUE(contains(status_line(start(program, "{\"token\":\"wrong-horse-battery\"}")), " 403 "));
  EXPECT_TRUE(contains(status_line(start(program, good, "Origin: http://evil.com\r\n" + json)), " 403 "));
  EXPECT_TRUE(contains(status_line(start(program, good, json)), " 403 "));
  EXPECT_TRUE(
      contains(status_line(start(program, good, "Origin: " + here + "\r\nContent-Type: text/plain\r\n")), " 415 "));
  EXPECT_TRUE(contains(status_line(start(program, std::string(600, ' '))), " 413 "));
  EXPECT_FALSE(rig->take_start_request());
  EXPECT_TRUE(contains(status_line(start(program, good)), " 202 "));
  std::optional<StartRequest> request;
  ASSERT_TRUE(becomes([&] { return (request = rig->take_start_request()).has_value(); }));
  EXPECT_EQ(request->token, right_token);
  EXPECT_EQ(request->process, program.process().pid());
  EXPECT_TRUE(becomes([&] { return status_of(program).value("/start_answer/accepted"_json_pointer, false); }));
  // The rig records now: it refuses, and the page learns why.
  rig->publish(test::recording_status());
  EXPECT_TRUE(contains(status_line(start(program, good)), " 202 "));
  EXPECT_TRUE(becomes([&] { return status_of(program)["start_answer"]["reason"] == "the rig is recording already"; }));
  // Guessing is slow.
  std::string last;
  for (int i = 0; i < 5; ++i) last = start(program, "{\"token\":\"wrong-horse-battery\"}");
  EXPECT_TRUE(contains(status_line(last), " 429 "));
  EXPECT_TRUE(contains(status_line(ask(program, "GET /")), " 200 "));
}

TEST_F(PageServerTest, WithoutARigOrTheSwitchNothingStarts) {
  const std::string good = std::string("{\"token\":\"") + right_token + "\"}";
  {
    const test::StatusProgram alone(socket_, with_token());
    EXPECT_TRUE(contains(status_line(start(alone, good)), " 503 "));
  }
  const auto rig = make_rig(true);
  const test::StatusProgram read_only(socket_);
  EXPECT_TRUE(contains(start(read_only, good), "Remote start is off"));
  EXPECT_FALSE(rig->take_start_request());
}

TEST_F(PageServerTest, HostileRequestsEndAlone) {
  const test::StatusProgram program(socket_, with_token());
  const std::string host = "Host: " + program.host() + "\r\n";
  const std::string chunked = "POST /start HTTP/1.1\r\n" + host + "Origin: http://" + program.host() +
                              "\r\nContent-Type: application/json\r\nTransfer-Encoding: chunked\r\n\r\n";
  std::string chunks;
  for (int i = 0; i < 30; ++i) chunks += "1000\r\n" + std::string(0x1000, ' ') + "\r\n";
  for (const std::string& bytes :
       {std::string("\r\n\r\n\r\n"), std::string("GET\r\n\r\n"), std::string("GET / HTTP/9.9\r\n\r\n"),
        std::string(40'000, 'A'), "GET / HTTP/1.1\r\n" + host + "X: " + std::string(40'000, 'b') + "\r\n\r\n",
        "GET /" + std::string(40'000, 'c') + " HTTP/1.1\r\n" + host + "\r\n", std::string("\0\0\0\0", 4) + "\r\n\r\n",
        "GET / HTTP/1.1\r\n" + std::string(500, '\n'), "POST /start HTTP/1.1\r\n" + host + "Content-Length: -5\r\n\r\n",
        chunked + "zz\r\n", chunked + chunks}) {
    HttpClient client(program.port());
    client.send(bytes);
    ::shutdown(client.fd(), SHUT_WR);
    const std::string answer = client.some(milliseconds(500));  // some are not answered, and end when they time out
    EXPECT_EQ(answer.find(" 200 "), std::string::npos) << bytes.substr(0, 60);
    EXPECT_EQ(answer.find(" 202 "), std::string::npos) << bytes.substr(0, 60);
  }
  // In chunks, and too long, but not endless: it is told so.
  HttpClient client(program.port());
  client.send(chunked + "400\r\n" + std::string(0x400, ' ') + "\r\n0\r\n\r\n");
  EXPECT_TRUE(contains(client.some(), " 413 "));
  EXPECT_TRUE(contains(status_line(ask(program, "GET /")), " 200 "));
}

// One of many browsers that listen.
struct Listener {
  explicit Listener(int port, const std::string& host) : client(port) {
    client.send("GET /events HTTP/1.1\r\nHost: " + host + "\r\n\r\n");
  }
  HttpClient client;
  std::string received;
  std::size_t looked_at = 0;
  int events = 0;
  bool has_all = false;
};

TEST_F(PageServerTest, FortyBrowsersListenAtOnce) {
  const auto rig = make_rig();
  test::StatusProgram program(socket_);
  RigStatus s = test::recording_status();
  rig->publish(s);
  constexpr int browsers = 40, statuses = 25;
  std::list<Listener> all;
  for (int i = 0; i < browsers; ++i) all.emplace_back(program.port(), program.host());
  HttpClient asleep(program.port());  // one more that never reads
  asleep.send("GET /events HTTP/1.1\r\nHost: " + program.host() + "\r\n\r\n");

  const double cpu_before = program.process().cpu_seconds();
  const auto begin = SteadyClock::now();
  std::vector<double> latencies_ms;
  for (int i = 1; i <= statuses; ++i) {
    s.durable_frames = 1'000'000 + i;
    const std::string wanted = "\"durable_frames\":" + std::to_string(s.durable_frames);
    const auto published = SteadyClock::now();
    rig->publish(s);
    for (Listener& l : all) l.has_all = false;
    for (int left = browsers; left > 0;) {
      std::vector<pollfd> polled;
      for (Listener& l : all) polled.push_back({l.client.fd(), POLLIN, 0});
      ASSERT_GT(::poll(polled.data(), polled.size(), 10'000), 0) << left << " browsers wait for status " << i;
      std::size_t k = 0;
      for (Listener& l : all) {
        if ((polled[k++].revents & POLLIN) == 0) continue;
        const std::string more = l.client.some(milliseconds(0));
        ASSERT_FALSE(more.empty());
        l.received = l.received.substr(l.received.size() > 100 ? l.received.size() - 100 : 0) + more;
        if (l.has_all || l.received.find(wanted) == std::string::npos) continue;
        l.has_all = true;
        --left;
        latencies_ms.push_back(std::chrono::duration<double, std::milli>(SteadyClock::now() - published).count());
      }
    }
    std::this_thread::sleep_until(published + milliseconds(200));  // five a second, as a rig says
  }
  const double seconds = std::chrono::duration<double>(SteadyClock::now() - begin).count();
  std::sort(latencies_ms.begin(), latencies_ms.end());
  ASSERT_EQ(latencies_ms.size(), static_cast<std::size_t>(browsers * statuses));
  std::printf(
      "%d browsers, %d statuses, a picture of 85 kB at most four times a second: latency median %.1f ms, 99 %% %.1f "
      "ms; "
      "server %.0f %% of one core, %ld kB resident\n",
      browsers, statuses, latencies_ms[latencies_ms.size() / 2], latencies_ms[latencies_ms.size() * 99 / 100],
      100 * (program.process().cpu_seconds() - cpu_before) / seconds, program.process().resident_kb());
  EXPECT_TRUE(contains(status_line(ask(program, "GET /")), " 200 "));
  EXPECT_LT(program.process().resident_kb(), 60'000);
  EXPECT_EQ(program.process().end(), 0);
}

TEST_F(PageServerTest, BrowsersBeyondTheLimitAreRefusedAndTheRestGoesOn) {
  test::StatusProgram program(socket_);
  std::list<HttpClient> all;
  int refused = 0;
  for (int i = 0; i < 70; ++i) {
    HttpClient& client = all.emplace_back(program.port());
    client.send("GET /events HTTP/1.1\r\nHost: " + program.host() + "\r\n\r\n");
    refused += contains(client.some(), " 503 ") ? 1 : 0;
  }
  EXPECT_EQ(refused, 6);
  EXPECT_TRUE(contains(status_line(ask(program, "GET /")), " 200 "));
  all.clear();
  // Their places are free again.
  EXPECT_TRUE(becomes([&] {
    HttpClient client(program.port());
    client.send("GET /events HTTP/1.1\r\nHost: " + program.host() + "\r\n\r\n");
    return contains(client.some(), " 200 ");
  }));
}

TEST_F(PageServerTest, WhatIsWrongAtTheStartIsOneLineAndExitOne) {
  const test::StatusProgram first(socket_);
  const std::string program = std::string(MF_BINARY_DIR) + "/mirrorfield-status";
  std::ofstream(folder_ / "rig.toml") << "[status]\nport = 8081\ncolour = 'red'\n";
  std::ofstream(folder_ / "switch.toml") << "[status]\nremote_start = true\n";
  const std::vector<std::pair<std::vector<std::string>, std::string>> wrong{
      {{"--port", std::to_string(first.port()), "--address", "127.0.0.1"}, "is in use"},
      {{"--address", "192.0.2.1"}, "is no address of this machine"},
      {{"--address", "rig.local"}, "is no address"},
      {{"--port", "70000"}, "--port: must lie"},
      {{"--socket", std::string(200, 'x')}, "a socket's path"},
      {{"--token-file", folder_ / "none"}, "none"},
      {{"--config", folder_ / "none.toml"}, "none.toml"},
      {{"--config", folder_ / "rig.toml"}, "status.colour: is no key"},
      {{"--config", folder_ / "switch.toml"}, "status.token_file: is missing"}};
  for (const auto& [arguments, part] : wrong) {
    std::vector<std::string> all{program};
    all.insert(all.end(), arguments.begin(), arguments.end());
    const test::CommandOutcome outcome = test::run_command(all);
    EXPECT_EQ(outcome.exit_code, 1) << part;
    EXPECT_EQ(outcome.error_lines(), 1) << outcome.err;
    EXPECT_TRUE(contains(outcome.err, part));
  }
}

TEST_F(PageServerTest, TheConfigOfTheDaemonIsEnough) {
  std::ofstream(folder_ / "rig.toml")
      << "[camera]\n[mirror]\ntarget = 't.json'\n[recording]\nfolder = '.'\n"
         "[status]\nsocket = 'rig.sock'\naddress = '::1'\nport = 0\nhost_names = ['Rig.Example']\n";
  test::ChildProcess program({std::string(MF_BINARY_DIR) + "/mirrorfield-status", "--config", folder_ / "rig.toml"});
  const std::string url = program.first_line();
  if (url.empty()) GTEST_SKIP() << "no IPv6 on loopback here";
  EXPECT_TRUE(url.starts_with("http://[::1]:")) << url;
  EXPECT_EQ(program.end(), 0);
}

}  // namespace
}  // namespace mf
