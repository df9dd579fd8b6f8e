// SPDX-License-Identifier: Apache-2.0
#include "device/status/status_service.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>

#include "common/error.h"
#include "common/file_bytes.h"

namespace mf {

namespace {

constexpr std::size_t longest_token = 128;

// What people type to get here: this machine's name, alone and in the local network.
std::vector<std::string> with_own_names(std::vector<std::string> names) {
  std::array<char, 256> name{};
  if (::gethostname(name.data(), name.size() - 1) == 0 && name.front() != '\0') {
    const std::string own = name.data();
    names.push_back(own);
    names.push_back(own.substr(0, own.find('.')) + ".local");
  }
  for (std::string& n : names)
    std::transform(n.begin(), n.end(), n.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return names;
}

PageServerOptions server_options(const StatusConfig& config) {
  PageServerOptions options;
  options.address = config.address;
  options.port = config.port;
  options.rules.host_names = with_own_names(config.host_names);
  options.rules.remote_start = config.remote_start;
  if (config.remote_start) options.rules.token = read_pairing_token(config.token_file);
  return options;
}

RigLinkOptions link_options(const StatusConfig& config) {
  RigLinkOptions options;
  options.socket = config.socket;
  return options;
}

}  // namespace

std::string read_pairing_token(const std::filesystem::path& file) {
  std::string token = read_file_bytes(file);
  while (!token.empty() && std::isspace(static_cast<unsigned char>(token.back())) != 0) token.pop_back();
  const bool printable = std::all_of(token.begin(), token.end(), [](char c) { return c > ' ' && c <= '~'; });
  if (token.size() < shortest_token || token.size() > longest_token || !printable)
    throw InputError(file.string(), "", "must hold one word of 16 to 128 letters: head -c 18 /dev/urandom | base64");
  struct stat found {};
  if (::stat(file.c_str(), &found) != 0 || (found.st_mode & 07U) != 0)
    throw InputError(file.string(), "", "is open to every user: chmod 640");
  return token;
}

StatusService::StatusService(const StatusConfig& config)
    : texts_(config.remote_start),
      link_(link_options(config)),
      server_(server_options(config), [this](const std::string& token) { return link_.request_start(token); }) {
  link_.start([this](const RigNews& news) { server_.publish(texts_.make(news, std::chrono::steady_clock::now())); });
}

StatusService::~StatusService() {
  link_.stop();  // it feeds the server, which goes first
}

}  // namespace mf
