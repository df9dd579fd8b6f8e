// SPDX-License-Identifier: Apache-2.0
// What the phone's page decides about a request. An input is the lines method, path, host, origin, content type and
// content length ("~": absent), and the rest is the body.
#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <regex>
#include <stdexcept>

#include "device/status/request_rules.h"
#include "tests/fuzz/fuzz_target.h"

namespace mf::fuzz {
namespace {

constexpr std::string_view token = "correct-horse-battery";

std::string lower(std::string_view text) {
  std::string small(text);
  std::transform(small.begin(), small.end(), small.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c | 0x20) : c; });
  return small;
}

void require(bool condition, const char* what) {
  if (!condition) throw std::logic_error(what);
}

PageRequest split(std::string_view input) {
  std::array<std::string_view, 6> lines{};
  for (std::string_view& line : lines) {
    line = input.substr(0, input.find('\n'));
    input.remove_prefix(std::min(input.size(), line.size() + 1));
  }
  const auto header = [&](std::size_t i) { return lines[i] == "~" ? std::nullopt : std::optional(lines[i]); };
  return {lines[0], lines[1], header(2), header(3), header(4), header(5), input};
}

// Said anew, not as the rules say it: addresses are made of digits, dots, colons and brackets; our names are known.
void check_host(const PageRequest& r) {
  static const std::regex ours(R"(([0-9.]+|\[[0-9a-f:.]+\]|(rig|rig\.local|localhost)\.?)(:[0-9]+)?)",
                               std::regex::icase);
  require(r.host && r.host->size() < 256, "a request without a host passed");
  require(std::regex_match(std::string(*r.host), ours), "a foreign host passed");
}

void check_start(const PageRequest& r) {
  require(r.method == "POST" && r.path == "/start", "a start by another way passed");
  require(r.origin && lower(*r.origin).ends_with("://" + lower(*r.host)), "a foreign origin passed");
  require(r.content_type && lower(*r.content_type).starts_with("application/json"), "another content passed");
  require(r.body.size() <= longest_start_body, "a long body passed");
  require(nlohmann::json::parse(r.body).at("token") == token, "a wrong token passed");
}

void run_request(std::span<const std::uint8_t> bytes) {
  const PageRequest request = split({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  const PageRules rules{{"rig", "rig.local"}, true, std::string(token)};
  const PageDecision head = decide_on_head(request, rules), whole = decide_on_start(request, rules);
  for (const PageDecision& d : {head, whole}) {
    constexpr std::array<int, 6> codes{400, 403, 404, 405, 413, 415};
    const bool refused = d.route == PageRoute::refused;
    require(!refused || std::find(codes.begin(), codes.end(), d.code) != codes.end(), "refused with another code");
    require(refused == !d.reason.empty(), "a refusal gives its reason");
    if (!refused) check_host(request);
  }
  if (whole.route == PageRoute::start) check_start(request);
  require(whole.route != PageRoute::start || head.route == PageRoute::start, "the body made up for the head");
  PageRules read_only = rules;
  read_only.remote_start = false;
  require(decide_on_start(request, read_only).route != PageRoute::start, "a start passed although it is off");
}

std::vector<std::string> request_seeds() {
  return {"GET\n/\n10.0.0.1:8080\n~\n~\n~\n", "HEAD\n/status.json\nrig.local\n~\n~\n~\n",
          "GET\n/events\n[::1]:80\n~\n~\n~\n",
          "POST\n/start\nrig:8080\nhttp://rig:8080\napplication/json\n33\n{\"token\":\"correct-horse-battery\"}",
          "POST\n/start\n10.0.0.1\nhttp://10.0.0.1\napplication/json; "
          "charset=utf-8\n~\n{\"token\":\"correct-horse-battery\"}"};
}

}  // namespace

FuzzTarget fuzz_target() {
  return {run_request, request_seeds};
}

}  // namespace mf::fuzz
