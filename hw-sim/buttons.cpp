// SPDX-License-Identifier: Apache-2.0
#include "hw-sim/buttons.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/input.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <random>
#include <span>
#include <thread>

#include "common/error.h"
#include "device/clock.h"
#include "device/owned_fd.h"
#include "hw-sim/mock_device.h"

namespace mf::sim {

namespace {

namespace fs = std::filesystem;

using Request = unsigned long;

void reply(UMockdevIoctlClient* client, std::span<const std::uint8_t> bytes) {
  if (const MockData argument = argument_bytes(client, bytes.size())) put(*argument, bytes);
  finish(client, static_cast<long>(bytes.size()));
}

void set_bit(std::vector<std::uint8_t>& bits, unsigned bit) {
  if (bit / 8 < bits.size()) bits[bit / 8] = static_cast<std::uint8_t>(bits[bit / 8] | 1U << bit % 8);
}

}  // namespace

struct SimulatedButton::Impl {
  Impl(UMockdevTestbed* bed, const SimulatedButtonOptions& o) : testbed(bed), options(o) {}

  // The device's answers, in umockdev's own thread.
  static gboolean on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self) {
    return static_cast<Impl*>(self)->answer(client) ? TRUE : FALSE;
  }
  bool answer(UMockdevIoctlClient* client);
  void send(bool down);

  void make_line();

  UMockdevTestbed* testbed;
  SimulatedButtonOptions options;
  MockDevice device;
  MockHandler handler;
  OwnedFd line;  // a pseudo terminal: what is written here can be read, and waited for, at the node
  std::atomic<bool> pressed = false, grabbed = false, plugged = false;
  std::mt19937 random{1};
};

bool SimulatedButton::Impl::answer(UMockdevIoctlClient* client) {
  const Request request = umockdev_ioctl_client_get_request(client);
  if (_IOC_TYPE(request) != 'E') return false;
  if (!plugged) {
    fail(client, ENODEV);
    return true;
  }
  std::vector<std::uint8_t> bytes(_IOC_SIZE(request));
  const unsigned number = _IOC_NR(request);
  if (request == EVIOCGRAB) {
    if (options.refuses_grab) {
      fail(client, EBUSY);
    } else {
      std::uintptr_t wanted = 0;  // the argument is the number itself, no pointer
      std::memcpy(&wanted, umockdev_ioctl_client_get_arg(client)->data, sizeof wanted);
      grabbed = wanted != 0;
      finish(client);
    }
    return true;
  }
  if (request == EVIOCSCLOCKID) {
    finish(client);
    return true;
  }
  if (_IOC_DIR(request) != _IOC_READ) return false;
  if (number == _IOC_NR(EVIOCGVERSION)) {
    const int version = EV_VERSION;
    std::memcpy(bytes.data(), &version, std::min(bytes.size(), sizeof version));
  } else if (number == _IOC_NR(EVIOCGNAME(0))) {
    const std::string name = "Simulated start button";
    bytes.resize(name.size() + 1);
    std::memcpy(bytes.data(), name.c_str(), bytes.size());
  } else if (number == _IOC_NR(EVIOCGPHYS(0)) || number == _IOC_NR(EVIOCGUNIQ(0))) {
    fail(client, ENOENT);
    return true;
  } else if (number == _IOC_NR(EVIOCGBIT(0, 0))) {
    set_bit(bytes, EV_SYN);
    set_bit(bytes, EV_KEY);
  } else if (number == _IOC_NR(EVIOCGBIT(EV_KEY, 0)) || (number == _IOC_NR(EVIOCGKEY(0)) && pressed)) {
    set_bit(bytes, options.key);
  }
  reply(client, bytes);  // all else: it has none of that
  return true;
}

void SimulatedButton::Impl::send(bool down) {
  pressed = down;
  if (!plugged) return;
  const std::int64_t now = clock_ns(CLOCK_MONOTONIC);
  std::array<input_event, 2> events{};
  for (input_event& event : events) {
    event.input_event_sec = now / 1'000'000'000;
    event.input_event_usec = now % 1'000'000'000 / 1000;
  }
  events[0].type = EV_KEY;
  events[0].code = static_cast<std::uint16_t>(options.key);
  events[0].value = down ? 1 : 0;
  if (::write(line.get(), events.data(), sizeof events) != ssize_t{sizeof events})
    throw InputError(device.node, "",
                     fmt::format("the simulated button's events are not taken: {}", std::strerror(errno)));
}

// Not umockdev's own pseudo terminal: that stays open when the device is removed, and nobody would notice.
void SimulatedButton::Impl::make_line() {
  line = OwnedFd(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC));
  std::array<char, 64> name{};
  termios mode{};
  const bool made = line.get() >= 0 && ::grantpt(line.get()) == 0 && ::unlockpt(line.get()) == 0 &&
                    ::ptsname_r(line.get(), name.data(), name.size()) == 0 && ::tcgetattr(line.get(), &mode) == 0;
  if (!made) throw InputError(device.node, "", "no pseudo terminal can be had: mount /dev/pts");
  ::cfmakeraw(&mode);
  ::tcsetattr(line.get(), TCSANOW, &mode);
  fs::remove(real_node(testbed, device));
  fs::create_symlink(name.data(), real_node(testbed, device));
}

SimulatedButton::SimulatedButton(UMockdevTestbed* testbed, const SimulatedButtonOptions& options)
    : impl_(std::make_unique<Impl>(testbed, options)) {
  const std::string path = "/devices/mirrorfield/input/" + options.node;
  const std::string node = "/dev/input/" + options.node;
  const std::string tags = options.tag.empty() ? "" : "E: TAGS=:" + options.tag + ":\n";
  impl_->device = {"/sys" + path, node,
                   fmt::format("P: {}\nN: input/{}=00\nE: DEVNAME={}\nE: SUBSYSTEM=input\nE: ID_INPUT=1\n"
                               "E: ID_INPUT_KEY=1\n{}",
                               path, options.node, node, tags)};
}

SimulatedButton::~SimulatedButton() {
  try {
    unplug();
  } catch (const InputError&) {  // the testbed goes with it
  }
}

void SimulatedButton::plug_in(bool pressed) {
  if (impl_->plugged) return;
  impl_->pressed = pressed;
  impl_->grabbed = false;
  impl_->handler.reset();
  impl_->handler = add_mock_device(impl_->testbed, impl_->device, Impl::on_ioctl, impl_.get());
  impl_->make_line();
  impl_->plugged = true;
  umockdev_testbed_uevent(impl_->testbed, impl_->device.path.c_str(), "add");
}

void SimulatedButton::unplug() {
  if (!impl_->plugged) return;
  impl_->plugged = false;
  remove_mock_device(impl_->testbed, impl_->device);
  impl_->line = OwnedFd();  // whoever reads is told at once
}

void SimulatedButton::contact(bool pressed, int bounces) {
  const auto short_while = [&] { return std::chrono::milliseconds(1 + impl_->random() % 3); };
  impl_->send(pressed);
  for (int i = 0; i < bounces; ++i) {
    std::this_thread::sleep_for(short_while());
    impl_->send(!pressed);
    std::this_thread::sleep_for(short_while());
    impl_->send(pressed);
  }
}

bool SimulatedButton::grabbed() const {
  return impl_->grabbed;
}

}  // namespace mf::sim
