// SPDX-License-Identifier: Apache-2.0
#include "device/status_socket.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <list>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include "common/error.h"
#include "device/peer_identity.h"
#include "device/rig_status_json.h"
#include "device/status_command.h"

namespace mf {

namespace {

using SteadyClock = std::chrono::steady_clock;
using Line = std::shared_ptr<const std::string>;

constexpr int preview_px = 256;  // an edge: 87 kB of base64 at most, on a phone 1.4 of its pixels each
constexpr std::size_t longest_command = 4096;
constexpr std::chrono::seconds start_valid{5};

sockaddr_un address_of(const std::filesystem::path& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string& text = path.native();
  if (text.empty() || text.size() >= sizeof(address.sun_path))
    throw InputError(text, "", fmt::format("a socket's path has 1 to {} bytes", sizeof(address.sun_path) - 1));
  std::memcpy(address.sun_path, text.data(), text.size());
  return address;
}

OwnedFd stream_socket() {
  return OwnedFd(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
}

// Held as long as the socket is served, so that of two daemons that start at once only one replaces a stale one.
OwnedFd lock_beside(const std::filesystem::path& path) {
  const std::string name = path.string() + ".lock";
  OwnedFd lock(::open(name.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600));
  if (!lock.valid())
    throw InputError(name, "",
                     fmt::format("cannot be made ({}): make the folder, writable for this user", std::strerror(errno)));
  if (::flock(lock.get(), LOCK_EX | LOCK_NB) != 0)
    throw InputError(path.string(), "", "is served by another mirrorfieldd: stop it, or give another status.socket");
  return lock;
}

void remove_stale(const std::filesystem::path& path) {
  struct stat found {};
  if (::lstat(path.c_str(), &found) != 0) return;
  if (!S_ISSOCK(found.st_mode))
    throw InputError(path.string(), "", "is there and no socket: remove it, or give another status.socket");
  if (connect_status_socket(path).valid() || errno != ECONNREFUSED)
    throw InputError(path.string(), "", "is served by another program: stop it, or give another status.socket");
  ::unlink(path.c_str());
}

OwnedFd listen_at(const StatusSocketOptions& options, std::optional<gid_t> group) {
  const sockaddr_un address = address_of(options.path);
  OwnedFd fd = stream_socket();
  // Linux gives the file the mode of the socket: it is never open to all, not for a moment.
  const bool listens = fd.valid() && ::fchmod(fd.get(), 0660) == 0 &&
                       ::bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0 &&
                       ::chmod(options.path.c_str(), 0660) == 0 && ::listen(fd.get(), options.most_clients) == 0;
  if (!listens) throw InputError(options.path.string(), "", fmt::format("cannot be served: {}", std::strerror(errno)));
  if (group && ::chown(options.path.c_str(), static_cast<uid_t>(-1), *group) != 0)
    throw InputError(options.path.string(), "",
                     fmt::format("cannot be given to group {}: let this user be a member", options.group));
  return fd;
}

std::string answer_line(const std::string& refusal) {
  const nlohmann::json answer{{"answer", "start"}, {"accepted", refusal.empty()}, {"reason", refusal}};
  return answer.dump() + "\n";
}

struct StatusClient {
  OwnedFd fd;
  PeerIdentity peer;
  Line sending;  // what is on its way, from `sent` on
  std::size_t sent = 0;
  std::uint64_t number = 0;  // of the last status taken for it
  SteadyClock::time_point next_line, last_progress;
  std::string answers;  // go before the next status
  std::string received;
};

}  // namespace

struct StatusSocket::Server {
  explicit Server(const StatusSocketOptions&);
  ~Server();
  void publish(RigStatus&&);
  std::optional<StartRequest> take_start();

  void serve();
  [[nodiscard]] bool look_at_status();
  void accept_client();
  void read_from(StatusClient&) const;
  void take_lines(StatusClient&);
  std::string hand_on(const StatusClient&, const std::string& token);
  void write_to(StatusClient&);
  bool choose_line(StatusClient&);
  [[nodiscard]] Line latest_line();
  [[nodiscard]] int wait_ms() const;
  void ring() const;

  StatusSocketOptions options;
  std::optional<gid_t> group;
  OwnedFd lock, listening, bell;
  std::atomic<int> count = 0;

  // The thread's own.
  std::list<StatusClient> all;
  std::uint64_t newest = 0;  // status that was published
  Line line;                 // made once for all clients, and only when one wants it
  std::uint64_t line_number = 0;

  std::mutex mutex;  // guards what follows
  RigStatus status;
  std::uint64_t number = 0;  // of `status`; 0: none yet
  bool stopping = false;
  std::optional<StartRequest> start;
  SteadyClock::time_point start_at;

  std::thread thread;
};

StatusSocket::Server::Server(const StatusSocketOptions& o) : options(o) {
  (void)address_of(options.path);
  if (!options.group.empty()) group = group_id(options.group, "status.group");
  lock = lock_beside(options.path);
  remove_stale(options.path);
  listening = listen_at(options, group);
  bell = OwnedFd(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  if (!bell.valid()) throw InputError(options.path.string(), "", "no event descriptor is left: raise the limit");
  thread = std::thread([this] { serve(); });
}

StatusSocket::Server::~Server() {
  {
    const std::scoped_lock hold(mutex);
    stopping = true;
  }
  ring();
  if (thread.joinable()) thread.join();
  ::unlink(options.path.c_str());
}

void StatusSocket::Server::ring() const {
  const std::uint64_t one = 1;
  (void)!::write(bell.get(), &one, sizeof(one));  // a full counter has rung already
}

// Until a client may have its next line, or has blocked for too long.
int StatusSocket::Server::wait_ms() const {
  const auto now = SteadyClock::now();
  auto until = now + std::chrono::seconds(60);
  for (const StatusClient& c : all) {
    if (c.sending) until = std::min(until, c.last_progress + options.longest_blockage);
    if (!c.sending && c.number != newest) until = std::min(until, c.next_line);
  }
  return static_cast<int>(std::max<std::int64_t>(0, std::chrono::ceil<std::chrono::milliseconds>(until - now).count()));
}

// False: it is time to end.
bool StatusSocket::Server::look_at_status() {
  std::uint64_t rings = 0;
  (void)!::read(bell.get(), &rings, sizeof(rings));
  const std::scoped_lock hold(mutex);
  newest = number;
  return !stopping;
}

void StatusSocket::Server::serve() {
  std::vector<pollfd> polled;
  while (look_at_status()) {
    for (StatusClient& c : all) write_to(c);
    std::erase_if(all, [](const StatusClient& c) { return !c.fd.valid(); });
    count = static_cast<int>(all.size());
    polled.assign({{bell.get(), POLLIN, 0}, {listening.get(), POLLIN, 0}});
    for (const StatusClient& c : all) {
      // Who does not take the answers is not asked any further.
      const int reading = c.answers.empty() ? POLLIN : 0;
      polled.push_back({c.fd.get(), static_cast<short>(reading | (c.sending ? POLLOUT : 0)), 0});
    }
    if (::poll(polled.data(), polled.size(), wait_ms()) <= 0) continue;
    std::size_t i = 2;
    for (StatusClient& c : all)
      if ((polled[i++].revents & (POLLIN | POLLHUP | POLLERR)) != 0) {
        read_from(c);
        take_lines(c);
      }
    if ((polled[1].revents & POLLIN) != 0) accept_client();
  }
}

void StatusSocket::Server::accept_client() {
  OwnedFd fd(::accept4(listening.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
  // Out of descriptors the caller stays in the queue, and would be reported again and again.
  if (!fd.valid()) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  if (!fd.valid() || static_cast<int>(all.size()) >= options.most_clients) return;
  StatusClient client;
  client.peer = peer_identity(fd.get());
  client.fd = std::move(fd);
  all.push_back(std::move(client));
}

void StatusSocket::Server::read_from(StatusClient& client) const {
  std::array<char, longest_command> bytes{};
  const ssize_t got = ::recv(client.fd.get(), bytes.data(), bytes.size(), 0);
  if (got > 0) client.received.append(bytes.data(), static_cast<std::size_t>(got));
  if (got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR)) client.fd = OwnedFd();
}

void StatusSocket::Server::take_lines(StatusClient& client) {
  std::size_t begin = 0;
  for (std::size_t end = client.received.find('\n'); end != std::string::npos;
       end = client.received.find('\n', begin)) {
    const StatusCommand command = read_status_command(std::string_view(client.received).substr(begin, end - begin));
    const std::string refusal = command.start_token ? hand_on(client, *command.start_token) : command.fault;
    client.answers += answer_line(refusal);
    begin = end + 1;
  }
  client.received.erase(0, begin);
  if (client.received.size() > longest_command) client.fd = OwnedFd();
}

// Empty, or why not.
std::string StatusSocket::Server::hand_on(const StatusClient& client, const std::string& token) {
  if (!options.accept_start) return "remote start is off";
  const PeerIdentity& peer = client.peer;
  if (peer.user != 0 && peer.user != ::geteuid() && !(group && peer.is_in(*group)))
    return "this user may not ask for a start";
  const std::scoped_lock hold(mutex);
  if (number > 0 && (status.state == RigState::metering || status.state == RigState::recording))
    return "the rig is recording already";
  const auto now = SteadyClock::now();
  if (start && now - start_at < start_valid) return "another request waits";
  start = StartRequest{token, peer.user, peer.process};
  start_at = now;
  return {};
}

std::optional<StartRequest> StatusSocket::Server::take_start() {
  const std::scoped_lock hold(mutex);
  if (start && SteadyClock::now() - start_at >= start_valid) start.reset();
  return std::exchange(start, std::nullopt);
}

Line StatusSocket::Server::latest_line() {
  if (line_number == newest) return line;
  RigStatus copy;
  {
    const std::scoped_lock hold(mutex);
    copy = status;
    newest = line_number = number;
  }
  if (copy.preview) copy.preview = shrunk_preview(*copy.preview, preview_px);
  // A path need not be UTF-8, JSON must be.
  line = std::make_shared<const std::string>(
      rig_status_to_json(copy).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
  return line;
}

// False: there is nothing to send, yet.
bool StatusSocket::Server::choose_line(StatusClient& client) {
  const auto now = SteadyClock::now();
  client.sent = 0;
  client.last_progress = now;
  if (!client.answers.empty()) {
    client.sending = std::make_shared<const std::string>(std::exchange(client.answers, {}));
    return true;
  }
  if (client.number == newest || now < client.next_line) return false;
  client.sending = latest_line();
  client.number = line_number;
  client.next_line = now + options.least_interval;
  return true;
}

void StatusSocket::Server::write_to(StatusClient& client) {
  while (client.fd.valid() && (client.sending || choose_line(client))) {
    const std::string& text = *client.sending;
    const ssize_t went = ::send(client.fd.get(), text.data() + client.sent, text.size() - client.sent, MSG_NOSIGNAL);
    if (went < 0 && errno != EAGAIN && errno != EINTR) client.fd = OwnedFd();
    if (went <= 0) break;
    client.last_progress = SteadyClock::now();
    client.sent += static_cast<std::size_t>(went);
    if (client.sent == text.size()) client.sending.reset();
  }
  if (client.sending && SteadyClock::now() - client.last_progress > options.longest_blockage) client.fd = OwnedFd();
}

void StatusSocket::Server::publish(RigStatus&& published) {
  {
    const std::scoped_lock hold(mutex);
    std::swap(status, published);  // the old one is freed outside
    ++number;
  }
  ring();
}

StatusSocket::StatusSocket(const StatusSocketOptions& options) : server_(std::make_unique<Server>(options)) {}
StatusSocket::~StatusSocket() = default;

void StatusSocket::publish(RigStatus status) {
  server_->publish(std::move(status));
}

std::optional<StartRequest> StatusSocket::take_start_request() {
  return server_->take_start();
}

int StatusSocket::clients() const {
  return server_->count;
}

OwnedFd connect_status_socket(const std::filesystem::path& path) {
  const sockaddr_un address = address_of(path);
  OwnedFd fd = stream_socket();
  if (!fd.valid()) return fd;
  if (::connect(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0) return fd;
  const int why = errno;
  fd = OwnedFd();
  errno = why;  // closing may have changed it
  return fd;
}

}  // namespace mf
