// SPDX-License-Identifier: Apache-2.0
#include "hw-sim/gige_camera.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <mutex>
#include <random>
#include <thread>
#include <vector>

#include "common/error.h"
#include "hw-sim/gige_block.h"
#include "hw-sim/gige_registers.h"

namespace mf::sim {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::uint16_t gvcp_port = 3956;
constexpr std::uint8_t gvcp_key = 0x42;
constexpr std::size_t gvsp_overhead = 36;              // IP, UDP and GVSP headers, which the packet size counts too
constexpr std::size_t wire_bytes_per_s = 118'000'000;  // gigabit Ethernet
constexpr std::uint32_t packets_in_a_row = 32;
constexpr std::size_t kept_blocks = 32;  // for resending: most of a second

enum Command : std::uint16_t {  // GVCP, §16
  discovery = 0x0002,
  packet_resend = 0x0040,
  read_register = 0x0080,
  write_register = 0x0082,
  read_memory = 0x0084,
  write_memory = 0x0086,
};
enum Status : std::uint16_t { ok = 0, not_implemented = 0x8001, invalid_address = 0x8003, access_denied = 0x8006 };

bool same_peer(const sockaddr_in& a, const sockaddr_in& b) {
  return a.sin_addr.s_addr == b.sin_addr.s_addr && a.sin_port == b.sin_port;
}

class Socket {
 public:
  Socket(const std::string& address, std::uint16_t port)
      : descriptor_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in local{};
    local.sin_family = AF_INET;
    local.sin_port = htons(port);
    const bool good = inet_pton(AF_INET, address.c_str(), &local.sin_addr) == 1;
    if (!good || descriptor_ < 0 || ::bind(descriptor_, reinterpret_cast<const sockaddr*>(&local), sizeof local) != 0) {
      const std::string reason = good ? std::strerror(errno) : "no IPv4 address";
      if (descriptor_ >= 0) ::close(descriptor_);
      throw InputError(address, fmt::format("UDP port {}", port),
                       reason + ": choose an address of this machine where no other camera answers");
    }
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  ~Socket() { ::close(descriptor_); }

  void send(const Bytes& packet, const sockaddr_in& to) const {
    ::sendto(descriptor_, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
  }
  // 0 when nothing came in time.
  std::size_t receive(std::span<std::uint8_t> into, sockaddr_in& from, int at_most_ms) const {
    pollfd waiting{descriptor_, POLLIN, 0};
    if (::poll(&waiting, 1, at_most_ms) <= 0) return 0;
    socklen_t length = sizeof from;
    const ssize_t got =
        ::recvfrom(descriptor_, into.data(), into.size(), 0, reinterpret_cast<sockaddr*>(&from), &length);
    return got > 0 ? static_cast<std::size_t>(got) : 0;
  }

 private:
  int descriptor_;
};

}  // namespace

struct GigeCamera::Impl {
  Impl(const GigeCameraOptions& o, Expose e)
      : options(o),
        expose(std::move(e)),
        control(o.address, gvcp_port),
        stream(o.address, 0),
        registers(o),
        booted(Clock::now()),
        losses(o.seed) {}

  void answer_commands();
  void answer(std::span<const std::uint8_t> command, const sockaddr_in& from);
  [[nodiscard]] Status run(std::uint16_t command, std::span<const std::uint8_t> data, const sockaddr_in& from,
                           Bytes& reply);
  [[nodiscard]] Status read_registers(std::span<const std::uint8_t> data, Bytes& reply);
  [[nodiscard]] Status write_registers(std::span<const std::uint8_t> data, const sockaddr_in& from, Bytes& reply);
  [[nodiscard]] bool may_write(std::uint32_t address, const sockaddr_in& from) const;
  void after_write(std::uint32_t address, const sockaddr_in& from);
  void resend(std::span<const std::uint8_t> data);
  void watch_heartbeat();
  void boot();

  void send_frames();
  void send_packets(const GigeBlock&, std::unique_lock<std::mutex>& lock);
  [[nodiscard]] GigeBlock next_frame_to_take(GigeShot&);
  [[nodiscard]] std::uint64_t clock_ns() const;
  [[nodiscard]] bool streaming() const {
    return alive && registers.read(gige::acquisition) == 1U && registers.read(gige::stream_port).value_or(0) != 0;
  }

  const GigeCameraOptions options;
  const Expose expose;
  const Socket control;
  const Socket stream;

  mutable std::mutex mutex;  // guards what follows
  std::condition_variable changed;
  GigeRegisters registers;
  Clock::time_point booted;
  bool alive = true;
  bool ending = false;
  sockaddr_in controller{};
  Clock::time_point last_heard;
  sockaddr_in destination{};
  std::deque<std::shared_ptr<const GigeBlock>> recent;  // a packet is made without the lock
  std::uint64_t next_frame = 1;
  std::uint16_t next_block = 1;
  GigeCameraCounts counts;
  std::mt19937_64 losses;
  double packet_loss = options.packet_loss;
  double jitter_s = 0;
  int skipping = 0;

  std::thread answering;
  std::thread sending;
};

void GigeCamera::Impl::boot() {
  registers = GigeRegisters(options);
  booted = Clock::now();
  controller = {};
  recent.clear();
  next_block = 1;
}

std::uint64_t GigeCamera::Impl::clock_ns() const {
  if (registers.read(gige::ptp_enable) == 1U) {
    const auto real = std::chrono::system_clock::now().time_since_epoch();
    return static_cast<std::uint64_t>(std::chrono::nanoseconds(real).count() + options.ptp_offset_ns);
  }
  const double host = std::chrono::duration<double, std::nano>(Clock::now() - booted).count();
  return static_cast<std::uint64_t>(host * (1 + 1e-6 * options.clock_ppm));
}

void GigeCamera::Impl::answer_commands() {
  std::array<std::uint8_t, 2048> buffer{};
  while (true) {
    sockaddr_in from{};
    const std::size_t size = control.receive(buffer, from, 20);
    const std::lock_guard lock(mutex);
    if (ending) return;
    if (!alive) continue;
    watch_heartbeat();
    if (size >= 8 && buffer[0] == gvcp_key) answer(std::span(buffer).first(size), from);
  }
}

void GigeCamera::Impl::watch_heartbeat() {
  if (registers.read(gige::control_privilege) == 0U) return;
  const std::chrono::milliseconds timeout(registers.read(gige::heartbeat_timeout_ms).value_or(3000));
  if (Clock::now() - last_heard < timeout) return;
  registers.set(gige::control_privilege, 0U);
  registers.set(gige::acquisition, 0U);
  registers.set(gige::stream_port, 0U);
}

void GigeCamera::Impl::answer(std::span<const std::uint8_t> packet, const sockaddr_in& from) {
  const std::uint16_t command = get16(packet, 2), size = get16(packet, 4), id = get16(packet, 6);
  if (packet.size() < 8U + size) return;
  const std::span<const std::uint8_t> data = packet.subspan(8, size);
  if (same_peer(from, controller)) last_heard = Clock::now();
  if (command == packet_resend) return resend(data);
  Bytes reply;
  const Status status = run(command, data, from, reply);
  const bool wants_answer = (packet[1] & 1) != 0;
  if (!wants_answer) return;
  Bytes out;
  put16(out, status);
  put16(out, command + 1U);
  put16(out, static_cast<std::uint32_t>(reply.size()));
  put16(out, id);
  out.insert(out.end(), reply.begin(), reply.end());
  control.send(out, from);
}

Status GigeCamera::Impl::run(std::uint16_t command, std::span<const std::uint8_t> data, const sockaddr_in& from,
                             Bytes& reply) {
  constexpr std::size_t discovery_size = 0xF8;
  switch (command) {
    case discovery: {
      const auto bytes = registers.read(0, discovery_size);
      reply.assign(bytes->begin(), bytes->end());
      return ok;
    }
    case read_register:
      return read_registers(data, reply);
    case write_register:
      return write_registers(data, from, reply);
    case read_memory: {
      if (data.size() < 8) return invalid_address;
      const auto bytes = registers.read(get32(data, 0), get16(data, 6));
      if (!bytes) return invalid_address;
      put32(reply, get32(data, 0));
      reply.insert(reply.end(), bytes->begin(), bytes->end());
      return ok;
    }
    case write_memory: {
      if (data.size() < 4 || !may_write(get32(data, 0), from)) return access_denied;
      if (!registers.write(get32(data, 0), data.subspan(4))) return access_denied;
      put32(reply, static_cast<std::uint32_t>(data.size() - 4));
      after_write(get32(data, 0), from);
      return ok;
    }
    default:
      return not_implemented;
  }
}

Status GigeCamera::Impl::read_registers(std::span<const std::uint8_t> data, Bytes& reply) {
  for (std::size_t at = 0; at + 4 <= data.size(); at += 4) {
    const auto value = registers.read(get32(data, at));
    if (!value) return invalid_address;
    put32(reply, *value);
  }
  return ok;
}

Status GigeCamera::Impl::write_registers(std::span<const std::uint8_t> data, const sockaddr_in& from, Bytes& reply) {
  std::uint32_t done = 0;
  for (std::size_t at = 0; at + 8 <= data.size(); at += 8, ++done) {
    const std::uint32_t address = get32(data, at);
    if (!may_write(address, from) || !registers.write(address, data.subspan(at + 4, 4))) break;
    after_write(address, from);
  }
  put32(reply, done);
  return done * 8 == data.size() ? ok : access_denied;
}

// Only who has control may write; anybody may take it when nobody has.
bool GigeCamera::Impl::may_write(std::uint32_t address, const sockaddr_in& from) const {
  if (registers.read(gige::control_privilege) != 0U) return same_peer(from, controller);
  return address == gige::control_privilege;
}

void GigeCamera::Impl::after_write(std::uint32_t address, const sockaddr_in& from) {
  switch (address) {
    case gige::control_privilege:
      controller = registers.read(address) != 0U ? from : sockaddr_in{};
      last_heard = Clock::now();
      if (registers.read(address) == 0U) registers.set(gige::acquisition, 0U);
      break;
    case gige::timestamp_control: {
      const std::uint64_t now = clock_ns();
      registers.set(gige::timestamp_high, static_cast<std::uint32_t>(now >> 32));
      registers.set(gige::timestamp_low, static_cast<std::uint32_t>(now));
      break;
    }
    case gige::stream_port:
    case gige::stream_destination:
      destination.sin_family = AF_INET;
      destination.sin_port = htons(static_cast<std::uint16_t>(registers.read(gige::stream_port).value_or(0)));
      destination.sin_addr.s_addr = htonl(registers.read(gige::stream_destination).value_or(0));
      break;
    case gige::acquisition:
      next_block = 1;
      break;
    case gige::ptp_enable:
      registers.set(gige::ptp_status, registers.read(address) == 1U ? 9U : 3U);
      break;
    case gige::ptp_latch: {
      const auto offset = static_cast<std::uint64_t>(options.ptp_offset_ns);
      registers.set(gige::ptp_offset_ns, static_cast<std::uint32_t>(offset >> 32));
      registers.set(gige::ptp_offset_ns + 4, static_cast<std::uint32_t>(offset));
      break;
    }
    default:
      break;
  }
  changed.notify_all();
}

void GigeCamera::Impl::resend(std::span<const std::uint8_t> data) {
  if (data.size() < 12) return;
  const auto number = static_cast<std::uint16_t>(get32(data, 0));
  const std::uint32_t first = get32(data, 4) & 0xFFFFFF, last = get32(data, 8) & 0xFFFFFF;
  const auto block = std::find_if(recent.begin(), recent.end(), [&](const auto& b) { return b->number == number; });
  if (block == recent.end()) return;
  for (std::uint32_t packet = first; packet <= std::min(last, (*block)->data_packets() + 1); ++packet) {
    stream.send(packet_of(**block, packet), destination);
    ++counts.resent;
  }
}

GigeBlock GigeCamera::Impl::next_frame_to_take(GigeShot& shot) {
  GigeBlock block;
  block.number = next_block;
  next_block = next_block == 65535 ? std::uint16_t{1} : static_cast<std::uint16_t>(next_block + 1);
  block.timestamp_ns = clock_ns();
  block.data_per_packet = (registers.read(gige::stream_packet_size).value_or(1400) & 0xFFFF) - gvsp_overhead;
  block.payload.resize(registers.read(gige::payload_size).value_or(0));
  block.chunks = registers.read(gige::chunk_mode) == 1U;
  shot = {next_frame++, 1e-6 * registers.real(gige::exposure_us), registers.real(gige::gain_db), registers.response(),
          registers.format()};
  block.pfnc = shot.format.pfnc;
  block.width = options.width;
  block.height = options.height;
  return block;
}

// `lock` is held on entry and on return.
void GigeCamera::Impl::send_packets(const GigeBlock& block, std::unique_lock<std::mutex>& lock) {
  std::uniform_real_distribution<double> chance;
  const Clock::time_point begun = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                                     std::chrono::duration<double>(jitter_s * chance(losses)));
  changed.wait_until(lock, begun, [&] { return ending; });
  for (std::uint32_t packet = 0; packet <= block.data_packets() + 1 && streaming(); ++packet) {
    ++counts.packets;
    if (chance(losses) < packet_loss) {
      ++counts.dropped;
      continue;
    }
    lock.unlock();
    stream.send(packet_of(block, packet), destination);
    // No faster than the wire that a camera has: a burst would overflow buffers that hold on location.
    if (packet % packets_in_a_row == 0)
      std::this_thread::sleep_until(begun + std::chrono::nanoseconds(packet * (block.data_per_packet + gvsp_overhead) *
                                                                     1'000'000'000 / wire_bytes_per_s));
    lock.lock();
  }
}

void GigeCamera::Impl::send_frames() {
  std::unique_lock lock(mutex);
  Clock::time_point next_at = Clock::now();
  while (true) {
    if (!ending && !streaming()) {
      changed.wait(lock, [&] { return ending || streaming(); });
      next_at = Clock::now();
    }
    if (ending) return;
    next_at = std::max(next_at + std::chrono::duration_cast<Clock::duration>(
                                     std::chrono::duration<double>(1 / registers.real(gige::frame_rate_hz))),
                       Clock::now() - std::chrono::milliseconds(50));
    if (changed.wait_until(lock, next_at, [&] { return ending || !streaming(); })) continue;
    if (options.most_frames > 0 && next_frame > static_cast<std::uint64_t>(options.most_frames)) {
      next_at = Clock::now() + std::chrono::milliseconds(100);
      continue;
    }
    GigeShot shot;
    const auto sent = std::make_shared<GigeBlock>(next_frame_to_take(shot));
    const std::size_t picture_bytes = registers.picture_bytes();
    if (skipping > 0) {
      --skipping;
      continue;
    }
    lock.unlock();
    expose(shot, std::span(sent->payload).first(picture_bytes));
    if (sent->chunks) append_chunks(*sent, picture_bytes, shot.exposure_s);
    lock.lock();
    recent.push_back(sent);
    if (recent.size() > kept_blocks) recent.pop_front();
    ++counts.frames;
    send_packets(*sent, lock);
  }
}

GigeCamera::GigeCamera(const GigeCameraOptions& options, Fill fill)
    : GigeCamera(options, Expose([fill = std::move(fill)](const GigeShot& shot, std::span<std::uint8_t> payload) {
                   fill(shot.number, payload);
                 })) {}

GigeCamera::GigeCamera(const GigeCameraOptions& options, Expose expose)
    : impl_(std::make_unique<Impl>(options, std::move(expose))) {
  impl_->answering = std::thread([this] { impl_->answer_commands(); });
  impl_->sending = std::thread([this] { impl_->send_frames(); });
}

GigeCamera::~GigeCamera() {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->ending = true;
  }
  impl_->changed.notify_all();
  impl_->answering.join();
  impl_->sending.join();
}

void GigeCamera::die() {
  const std::lock_guard lock(impl_->mutex);
  impl_->alive = false;
  impl_->changed.notify_all();
}

void GigeCamera::revive() {
  const std::lock_guard lock(impl_->mutex);
  impl_->boot();
  impl_->alive = true;
}

void GigeCamera::set_packet_loss(double share) {
  const std::lock_guard lock(impl_->mutex);
  impl_->packet_loss = share;
}

void GigeCamera::set_jitter(double most_s) {
  const std::lock_guard lock(impl_->mutex);
  impl_->jitter_s = most_s;
}

void GigeCamera::skip_frames(int count) {
  const std::lock_guard lock(impl_->mutex);
  impl_->skipping += count;
}

GigeCameraCounts GigeCamera::counts() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->counts;
}

}  // namespace mf::sim
