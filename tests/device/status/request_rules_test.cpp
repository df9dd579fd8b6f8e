// SPDX-License-Identifier: Apache-2.0
#include "device/status/request_rules.h"

#include <gtest/gtest.h>

#include <fstream>
#include <regex>

#include "common/file_bytes.h"
#include "device/status/disk_forecast.h"
#include "device/status/status_service.h"
#include "tests/support/expect_input_error.h"
#include "tests/support/temporary_folder.h"

namespace mf {
namespace {

using std::chrono::seconds;
using test::contains;

constexpr const char* right_token = "correct-horse-battery";

PageRules rules() {
  PageRules r;
  r.host_names = {"rig", "rig.local"};
  r.remote_start = true;
  r.token = right_token;
  return r;
}

PageRequest get(std::string_view path) {
  PageRequest r;
  r.method = "GET";
  r.path = path;
  r.host = "10.0.0.1:8080";
  return r;
}

PageRequest good_start() {
  PageRequest r;
  r.method = "POST";
  r.path = "/start";
  r.host = "10.0.0.1:8080";
  r.origin = "http://10.0.0.1:8080";
  r.content_type = "application/json";
  r.content_length = "33";
  r.body = R"({"token":"correct-horse-battery"})";
  return r;
}

TEST(RequestRules, EveryRouteAndEveryMethod) {
  EXPECT_EQ(decide_on_head(get("/"), rules()).route, PageRoute::page);
  EXPECT_EQ(decide_on_head(get("/status.json"), rules()).route, PageRoute::status);
  EXPECT_EQ(decide_on_head(get("/events"), rules()).route, PageRoute::events);
  EXPECT_EQ(decide_on_head(get("/favicon.ico"), rules()).route, PageRoute::icon);
  for (const char* path : {"", "/index.html", "//", "/status.json/", "/../etc/passwd", "/stop", "/delete", "*"})
    EXPECT_EQ(decide_on_head(get(path), rules()).code, 404) << path;
  for (const char* path : {"/", "/status.json", "/events", "/favicon.ico"})
    for (const char* method : {"POST", "PUT", "DELETE", "PATCH", "OPTIONS", "TRACE", "get", ""}) {
      PageRequest r = get(path);
      r.method = method;
      EXPECT_EQ(decide_on_head(r, rules()).code, 405) << method << " " << path;
      EXPECT_TRUE(decide_on_head(r, rules()).allow.starts_with("GET"));
    }
  for (const char* method : {"GET", "HEAD", "PUT", "DELETE", "OPTIONS"}) {
    PageRequest r = good_start();
    r.method = method;
    EXPECT_EQ(decide_on_head(r, rules()).code, 405) << method;
    EXPECT_EQ(decide_on_head(r, rules()).allow, "POST");
  }
}

TEST(RequestRules, OnlyOurOwnNamesAreHosts) {
  for (const char* host : {"10.0.0.1", "10.0.0.1:8080", "[::1]", "[fe80::1]:8080", "localhost", "localhost:1", "rig",
                           "RIG.local:8080", "rig.local."}) {
    PageRequest r = get("/");
    r.host = host;
    EXPECT_EQ(decide_on_head(r, rules()).route, PageRoute::page) << host;
  }
  for (const std::string host :
       {"evil.com",  "evil.com:8080", "10.0.0.1.evil.com", "rig.evil.com", "xrig",   "",      ":8080", "rig:",
        "rig:80:80", "rig:80a",       "rig:123456",        "[::1",         "[::1]x", "[rig]", "[]",    "::1",
        "0x7f.1",    "127.1",         "rig@evil.com",      "rig/"}) {
    PageRequest r = get("/");
    r.host = host;
    EXPECT_EQ(decide_on_head(r, rules()).code, 403) << host;
    r = good_start();
    r.host = host;
    EXPECT_EQ(decide_on_start(r, rules()).code, 403) << host;
  }
  PageRequest r = get("/");
  r.host = std::nullopt;
  EXPECT_EQ(decide_on_head(r, rules()).code, 403);
  const std::string long_host(300, '1'), nul("10.0.0.1\0.evil.com", 18);
  for (const std::string& host : {long_host, nul}) {
    r.host = host;
    EXPECT_EQ(decide_on_head(r, rules()).code, 403);
  }
}

TEST(RequestRules, AStartNeedsEverythingRight) {
  EXPECT_EQ(decide_on_start(good_start(), rules()).route, PageRoute::start);
  const auto code = [](auto&& change) {
    PageRequest r = good_start();
    PageRules all = rules();
    change(r, all);
    const PageDecision d = decide_on_start(r, all);
    EXPECT_EQ(d.route, PageRoute::refused);
    return d.code;
  };
  EXPECT_EQ(code([](auto&, auto& all) { all.remote_start = false; }), 403);
  EXPECT_EQ(code([](auto&, auto& all) { all.token.clear(); }), 403);
  EXPECT_EQ(code([](auto& r, auto& all) {
              all.token = "short";
              r.body = R"({"token":"short"})";
            }),
            403);
  EXPECT_EQ(code([](auto& r, auto&) { r.origin = std::nullopt; }), 403);
  for (const char* origin : {"null", "", "http://evil.com", "http://10.0.0.1", "http://10.0.0.1:80", "10.0.0.1:8080",
                             "http://10.0.0.1:8080/", "http://10.0.0.1:8080.evil.com", "ftp://10.0.0.1:8080"})
    EXPECT_EQ(code([&](auto& r, auto&) { r.origin = origin; }), 403) << origin;
  EXPECT_EQ(code([](auto& r, auto&) { r.content_type = std::nullopt; }), 415);
  for (const char* type : {"", "text/plain", "application/x-www-form-urlencoded", "multipart/form-data",
                           "application/jsonp", "text/plain; application/json"})
    EXPECT_EQ(code([&](auto& r, auto&) { r.content_type = type; }), 415) << type;
  for (const char* length : {"513", "9999", "10000", "99999999999999999999", "-1", "", "1e2", "0x10"})
    EXPECT_EQ(code([&](auto& r, auto&) { r.content_length = length; }), 413) << length;
  const std::string spaces(longest_start_body + 1, ' ');
  EXPECT_EQ(code([&](auto& r, auto&) {
              r.body = spaces;
              r.content_length = std::nullopt;
            }),
            413);
  for (const char* body : {"", "{}", "[]", "token=correct-horse-battery", R"({"token":1})", R"({"token":null})",
                           R"({"token":"correct-horse-battery"}x)", R"(["correct-horse-battery"])"})
    EXPECT_EQ(code([&](auto& r, auto&) { r.body = body; }), 400) << body;
  for (const char* body :
       {R"({"token":""})", R"({"token":"correct-horse-batter"})", R"({"token":"correct-horse-batteryy"})",
        R"({"token":"Correct-horse-battery"})", R"({"token":"correct-horse-battery\u0000"})"})
    EXPECT_EQ(code([&](auto& r, auto&) { r.body = body; }), 403) << body;
}

TEST(RequestRules, AStartMayComeInOtherSpellings) {
  PageRequest r = good_start();
  r.content_type = "Application/JSON; charset=utf-8";
  r.origin = "http://10.0.0.1:8080";
  EXPECT_EQ(decide_on_start(r, rules()).route, PageRoute::start);
  r.host = "rig.local:8080";
  r.origin = "http://RIG.local:8080";
  r.content_length = std::nullopt;  // in chunks
  EXPECT_EQ(decide_on_start(r, rules()).route, PageRoute::start);
  r.origin = "https://rig.local:8080";  // behind a proxy that speaks TLS
  EXPECT_EQ(decide_on_start(r, rules()).route, PageRoute::start);
}

TEST(SameSecret, ComparesAll) {
  EXPECT_TRUE(same_secret("abc", "abc"));
  for (const char* other : {"", "a", "ab", "abd", "bbc", "abcd", "ABC"})
    EXPECT_FALSE(same_secret(other, "abc")) << other;
  EXPECT_FALSE(same_secret("", ""));
  EXPECT_FALSE(same_secret(std::string_view("abc\0", 4), "abc"));
}

TEST(AttemptLimit, FiveAtOnceThenOneInTwoSeconds) {
  AttemptLimit limit;
  const AttemptLimit::Clock::time_point now(seconds(1000));
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(limit.take(now)) << i;
  EXPECT_FALSE(limit.take(now));
  EXPECT_FALSE(limit.take(now + seconds(1)));
  EXPECT_TRUE(limit.take(now + seconds(2)));
  EXPECT_FALSE(limit.take(now + seconds(2)));
  int taken = 0;
  for (int i = 0; i < 1000; ++i) taken += limit.take(now + seconds(100) + std::chrono::milliseconds(10 * i)) ? 1 : 0;
  EXPECT_EQ(taken, 5 + 4);  // ten seconds, less the last one begun
}

TEST(DiskForecast, FollowsTheRateOfTheLastHalfMinute) {
  DiskForecast forecast;
  RigStatus s;
  s.free_bytes = 10'000'000'000;
  const DiskForecast::Clock::time_point begin(seconds(5000));
  EXPECT_FALSE(forecast.seconds_left(s, begin));
  s.state = RigState::recording;
  std::optional<double> left;
  for (int tenth = 0; tenth <= 600; ++tenth) {
    s.free_bytes -= tenth < 200 ? 1'000'000 : 4'000'000;  // 10, then 40 MB a second
    left = forecast.seconds_left(s, begin + std::chrono::milliseconds(100 * tenth));
    EXPECT_EQ(left.has_value(), tenth >= 50) << tenth;
  }
  EXPECT_NEAR(*left, static_cast<double>(s.free_bytes) / 40e6, 1);
  s.free_bytes += 5'000'000'000;  // an old session was deleted
  EXPECT_FALSE(forecast.seconds_left(s, begin + seconds(61)));
  s.state = RigState::done;
  EXPECT_FALSE(forecast.seconds_left(s, begin + seconds(62)));
}

TEST(PairingToken, IsOneLongWordThatOthersCannotRead) {
  const test::TemporaryFolder folder;
  const std::filesystem::path file = folder / "token";
  const auto write = [&](const std::string& text) {
    std::ofstream(file) << text;
    std::filesystem::permissions(file, std::filesystem::perms(0640));
  };
  write("correct-horse-battery\n");
  EXPECT_EQ(read_pairing_token(file), right_token);
  for (const std::string& text :
       {std::string("short"), std::string(), std::string(200, 'x'), std::string("two words, and long"),
        std::string("\x01\x02\x03\x04\x05\x06\x07\x08\x09\x0a\x0b\x0c\x0d\x0e\x0f\x10\x11")}) {
    write(text);
    EXPECT_TRUE(contains(test::input_error_of([&] { (void)read_pairing_token(file); }), "one word"));
  }
  write(right_token);
  std::filesystem::permissions(file, std::filesystem::perms(0644));
  EXPECT_TRUE(contains(test::input_error_of([&] { (void)read_pairing_token(file); }), "chmod 640"));
  EXPECT_TRUE(contains(test::input_error_of([&] { (void)read_pairing_token(folder / "none"); }), "none"));
}

// WCAG's relative luminance of "#rrggbb".
double luminance(const std::string& colour) {
  double sum = 0;
  for (const auto& [at, weight] : {std::pair{1U, 0.2126}, {3U, 0.7152}, {5U, 0.0722}}) {
    const double level = std::stoi(colour.substr(at, 2), nullptr, 16) / 255.0;
    sum += weight * (level <= 0.04045 ? level / 12.92 : std::pow((level + 0.055) / 1.055, 2.4));
  }
  return sum;
}

TEST(PageStyle, EveryPairOfColoursIsReadableInSunlight) {
  const std::string style = read_file_bytes(MF_SOURCE_DIR "/device/status/page/page.css");
  const std::regex pair(R"(--(\w+)-paper: (#\w{6}); --(\w+)-ink: (#\w{6});)");
  int pairs = 0;
  for (std::sregex_iterator it(style.begin(), style.end(), pair), end; it != end; ++it) {
    EXPECT_EQ((*it)[1], (*it)[3]);
    double light = luminance((*it)[2]), dark = luminance((*it)[4]);
    if (light < dark) std::swap(light, dark);
    EXPECT_GE((light + 0.05) / (dark + 0.05), 7) << (*it)[1];  // WCAG 2.1, 1.4.6 (AAA)
    ++pairs;
  }
  EXPECT_EQ(pairs, 13);
}

}  // namespace
}  // namespace mf
