// SPDX-License-Identifier: Apache-2.0
#include "device/status/rig_link.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <vector>

#include "common/error.h"
#include "device/rig_status_json.h"
#include "device/status_socket.h"

namespace mf {

namespace {

// The largest preview that is believed, as base64, and as much again for the rest.
constexpr std::size_t longest_status_line = std::size_t{4} * most_preview_px * most_preview_px;

std::string why_not_connected(int error, const std::string& socket) {
  if (error == ENOENT || error == ECONNREFUSED) return "mirrorfieldd does not run: systemctl start mirrorfieldd";
  if (error == EACCES) return fmt::format("{} may not be read: let this program's user be of its group", socket);
  return fmt::format("{}: {}", socket, std::strerror(error));
}

}  // namespace

RigLink::RigLink(const RigLinkOptions& options) : options_(options), bell_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (!bell_.valid()) throw InputError("mirrorfield-status", "", "no event descriptor is left: raise the limit");
  connect();
}

RigLink::~RigLink() {
  stop();
}

void RigLink::start(std::function<void(const RigNews&)> on_news) {
  on_news_ = std::move(on_news);
  on_news_(news_);
  thread_ = std::thread([this] { run(); });
}

void RigLink::stop() {
  {
    const std::scoped_lock hold(mutex_);
    stopping_ = true;
  }
  ring();
  if (thread_.joinable()) thread_.join();
}

void RigLink::ring() const {
  const std::uint64_t one = 1;
  (void)!::write(bell_.get(), &one, sizeof(one));  // a full counter has rung already
}

bool RigLink::request_start(const std::string& token) {
  {
    const std::scoped_lock hold(mutex_);
    if (!connected_) return false;
    start_ = token;
  }
  ring();
  return true;
}

void RigLink::run() {
  while (true) {
    {
      const std::scoped_lock hold(mutex_);
      if (stopping_) return;
    }
    std::array<pollfd, 2> polled{{{bell_.get(), POLLIN, 0}, {fd_.get(), POLLIN, 0}}};
    const auto wait = fd_.valid() ? options_.tick : std::min(options_.tick, options_.retry_each);
    const int ready = ::poll(polled.data(), fd_.valid() ? 2 : 1, static_cast<int>(wait.count()));
    std::uint64_t rings = 0;
    (void)!::read(bell_.get(), &rings, sizeof(rings));
    if (!fd_.valid()) connect();
    send_start();
    if (fd_.valid() && polled[1].revents != 0) read_lines();
    if (ready == 0) on_news_(news_);
  }
}

void RigLink::connect() {
  fd_ = connect_status_socket(options_.socket);
  received_.clear();
  if (!fd_.valid()) return disconnect(why_not_connected(errno, options_.socket.string()));
  news_.connected = true;
  news_.problem.clear();
  const std::scoped_lock hold(mutex_);
  connected_ = true;
}

void RigLink::disconnect(const std::string& why) {
  const bool was_connected = news_.connected;
  fd_ = OwnedFd();
  news_.connected = false;
  news_.problem = why;
  {
    const std::scoped_lock hold(mutex_);
    connected_ = false;
    start_.reset();
  }
  if (was_connected) on_news_(news_);
}

void RigLink::read_lines() {
  std::array<char, 65536> bytes{};
  const ssize_t got = ::recv(fd_.get(), bytes.data(), bytes.size(), 0);
  if (got < 0 && (errno == EAGAIN || errno == EINTR)) return;
  if (got <= 0) return disconnect("mirrorfieldd has ended");
  const std::size_t known = received_.size();
  received_.append(bytes.data(), static_cast<std::size_t>(got));
  std::size_t begin = 0;
  for (std::size_t end = received_.find('\n', known); end != std::string::npos; end = received_.find('\n', begin)) {
    take_line(received_.substr(begin, end - begin));
    if (!fd_.valid()) return;
    begin = end + 1;
  }
  received_.erase(0, begin);
  if (received_.size() > longest_status_line)
    disconnect("mirrorfieldd speaks too long a line: are both of one version?");
}

void RigLink::take_line(const std::string& line) {
  const std::string source = "mirrorfieldd's status";
  try {
    const nlohmann::json said = nlohmann::json::parse(line, nullptr, false);
    if (said.is_discarded()) throw InputError(source, "", "is no JSON: are both of one version?");
    if (said.is_object() && said.contains("answer")) {
      const int number = news_.start_answer ? news_.start_answer->number + 1 : 1;
      news_.start_answer = StartAnswer{number, said.value("accepted", false), said.value("reason", "")};
    } else {
      news_.status = std::make_shared<const RigStatus>(rig_status_from_json(said, source));
      news_.status_at = std::chrono::steady_clock::now();
    }
    on_news_(news_);
  } catch (const InputError& e) {
    disconnect(e.what());
  } catch (const nlohmann::json::exception&) {  // an answer's values
    disconnect(source + ": an answer cannot be read: are both of one version?");
  }
}

void RigLink::send_start() {
  std::optional<std::string> token;
  {
    const std::scoped_lock hold(mutex_);
    token = std::exchange(start_, std::nullopt);
  }
  if (!token || !fd_.valid()) return;
  const std::string line = nlohmann::json{{"command", "start"}, {"token", *token}}.dump() + "\n";
  if (::send(fd_.get(), line.data(), line.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(line.size()))
    disconnect("mirrorfieldd took no command");
}

}  // namespace mf
