// SPDX-License-Identifier: Apache-2.0
#include "device/status/request_rules.h"

#include <arpa/inet.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

namespace mf {

namespace {

constexpr std::size_t longest_host = 255;

PageDecision refused(int code, std::string_view reason, std::string_view allow = {}) {
  return {PageRoute::refused, code, reason, allow};
}

std::string lower(std::string_view text) {
  std::string small(text);
  for (char& c : small)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return small;
}

bool is_address(int family, const std::string& text) {
  std::array<unsigned char, sizeof(in6_addr)> parsed{};
  // inet_pton would stop at a NUL.
  return text.find('\0') == std::string::npos && ::inet_pton(family, text.c_str(), parsed.data()) == 1;
}

// Without ":8080"; nothing when what follows the name is no port.
std::optional<std::string> host_name_of(std::string_view host) {
  const std::size_t end_of_name = host.starts_with('[') ? host.find(']') + 1 : std::min(host.find(':'), host.size());
  if (host.starts_with('[') && end_of_name == 0) return std::nullopt;
  const std::string_view rest = host.substr(end_of_name);
  const bool is_port =
      rest.empty() || (rest.size() >= 2 && rest.size() <= 6 && rest.front() == ':' &&
                       std::all_of(rest.begin() + 1, rest.end(), [](char c) { return c >= '0' && c <= '9'; }));
  if (!is_port) return std::nullopt;
  return lower(host.substr(0, end_of_name));
}

bool is_our_host(std::string_view host, const PageRules& rules) {
  if (host.empty() || host.size() > longest_host) return false;
  std::optional<std::string> name = host_name_of(host);
  if (!name || name->empty()) return false;
  if (name->front() == '[') return is_address(AF_INET6, name->substr(1, name->size() - 2));
  if (name->back() == '.') name->pop_back();  // the same name, said absolutely
  return *name == "localhost" || is_address(AF_INET, *name) ||
         std::find(rules.host_names.begin(), rules.host_names.end(), *name) != rules.host_names.end();
}

bool is_json(std::string_view content_type) {
  std::string_view kind = content_type.substr(0, content_type.find(';'));
  while (kind.ends_with(' ')) kind.remove_suffix(1);
  return lower(kind) == "application/json";
}

bool is_too_long(std::string_view content_length) {
  // Four digits hold every length that is allowed.
  return content_length.empty() || content_length.size() > 4 ||
         !std::all_of(content_length.begin(), content_length.end(), [](char c) { return c >= '0' && c <= '9'; }) ||
         static_cast<std::size_t>(std::stoi(std::string(content_length))) > longest_start_body;
}

PageDecision decide_on_start_head(const PageRequest& request, const PageRules& rules) {
  if (!rules.remote_start) return refused(403, "Remote start is off.");
  if (!request.origin) return refused(403, "A start must come from the rig's own page.");
  const std::string origin = lower(*request.origin), host = lower(*request.host);
  if (origin != "http://" + host && origin != "https://" + host)
    return refused(403, "A start must come from the rig's own page.");
  if (!request.content_type || !is_json(*request.content_type)) return refused(415, "Send application/json.");
  if (request.content_length && is_too_long(*request.content_length)) return refused(413, "That is too long.");
  return {PageRoute::start, 0, {}, {}};
}

}  // namespace

bool same_secret(std::string_view given, std::string_view secret) {
  volatile unsigned char difference = given.size() == secret.size() ? 0 : 1;
  for (std::size_t i = 0; i < secret.size(); ++i) {
    const char other = i < given.size() ? given[i] : '\0';
    difference = static_cast<unsigned char>(difference | static_cast<unsigned char>(other ^ secret[i]));
  }
  return difference == 0 && !secret.empty();
}

PageDecision decide_on_head(const PageRequest& request, const PageRules& rules) {
  struct Known {
    std::string_view path;
    PageRoute route;
    std::string_view methods;
  };
  static constexpr std::array<Known, 5> routes{{{"/", PageRoute::page, "GET, HEAD"},
                                                {"/status.json", PageRoute::status, "GET, HEAD"},
                                                {"/favicon.ico", PageRoute::icon, "GET, HEAD"},
                                                {"/events", PageRoute::events, "GET"},
                                                {"/start", PageRoute::start, "POST"}}};
  if (!request.host || !is_our_host(*request.host, rules))
    return refused(403, "Ask for this page by the rig's address or its name.");
  const auto* const found =
      std::find_if(routes.begin(), routes.end(), [&](const Known& k) { return k.path == request.path; });
  if (found == routes.end()) return refused(404, "There is no such page.");
  const bool reads = request.method == "GET" || (request.method == "HEAD" && found->methods == "GET, HEAD");
  const bool fits = found->route == PageRoute::start ? request.method == "POST" : reads;
  if (!fits) return refused(405, "That method does not fit.", found->methods);
  if (found->route == PageRoute::start) return decide_on_start_head(request, rules);
  return {found->route, 0, {}, {}};
}

PageDecision decide_on_start(const PageRequest& request, const PageRules& rules) {
  PageDecision head = decide_on_head(request, rules);
  if (head.route != PageRoute::start) return head;
  if (request.body.size() > longest_start_body) return refused(413, "That is too long.");
  const nlohmann::json body = nlohmann::json::parse(request.body, nullptr, false);
  const bool has_token =
      !body.is_discarded() && body.is_object() && body.contains("token") && body["token"].is_string();
  if (!has_token) return refused(400, "Send {\"token\": \"…\"}.");
  if (rules.token.size() < shortest_token || !same_secret(body["token"].get_ref<const std::string&>(), rules.token))
    return refused(403, "That is not the pairing word.");
  return head;
}

bool AttemptLimit::take(Clock::time_point now) {
  const Clock::time_point from = std::max(paid_until_, now);
  if (from + each - now > burst * each) return false;
  paid_until_ = from + each;
  return true;
}

}  // namespace mf
