// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace mf {

// What a browser sent, as the HTTP library cut it to pieces; an absent header is nothing.
struct PageRequest {
  std::string_view method;
  std::string_view path;  // without the query
  std::optional<std::string_view> host, origin, content_type, content_length;
  std::string_view body;
};

struct PageRules {
  std::vector<std::string> host_names;  // lower case; beside addresses and "localhost"
  bool remote_start = false;
  std::string token;  // what a start must know; at least shortest_token characters when remote_start is on
};

enum class PageRoute { page, status, events, icon, start, refused };

struct PageDecision {
  PageRoute route = PageRoute::refused;
  int code = 0;             // HTTP's, when refused
  std::string_view reason;  // one line, when refused
  std::string_view allow;   // the methods that a 405 names
};

inline constexpr std::size_t longest_start_body = 512;
inline constexpr std::size_t shortest_token = 16;

// What to do with a request, before its body is read. Pure.
//
//   GET, HEAD  /  /status.json  /favicon.ico      GET  /events      POST  /start
//
// Every request must name this machine as its Host: by an address, or by a name that we know. A page elsewhere whose
// own name was made to point here (DNS rebinding) is refused by that, also when it only wants to look. A start must
// besides come from our own page (Origin equals Host), be JSON (which another page cannot send unasked), and short.
[[nodiscard]] PageDecision decide_on_head(const PageRequest&, const PageRules&);

// The same for a start with its whole body: {"token": "…"} with the right token.
[[nodiscard]] PageDecision decide_on_start(const PageRequest&, const PageRules&);

// Takes as long whatever the difference is; the lengths may show.
[[nodiscard]] bool same_secret(std::string_view given, std::string_view secret);

// The first `burst` at once, then one in `each`. One for all callers: who floods it keeps others from the page's
// start, but never from the button.
class AttemptLimit {
 public:
  using Clock = std::chrono::steady_clock;
  [[nodiscard]] bool take(Clock::time_point now);

 private:
  static constexpr int burst = 5;
  static constexpr std::chrono::seconds each{2};
  Clock::time_point paid_until_{};  // attempts made so far cost time until then
};

}  // namespace mf
