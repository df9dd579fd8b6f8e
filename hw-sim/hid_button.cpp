// SPDX-License-Identifier: Apache-2.0
#include "hw-sim/hid_button.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/usbdevice_fs.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstddef>
#include <cstring>
#include <deque>
#include <filesystem>
#include <mutex>
#include <random>
#include <span>
#include <thread>
#include <vector>

#include "common/error.h"
#include "device/owned_fd.h"
#include "hw-sim/mock_device.h"

namespace mf::sim {

namespace {

namespace fs = std::filesystem;

using Bytes = std::vector<std::uint8_t>;

constexpr std::uint8_t in_endpoint = 0x81, out_endpoint = 0x02;
constexpr std::size_t setup_bytes = 8;  // of a control transfer, before its data

// USB 2.0, 9.6: device, configuration, interface, HID, two endpoints; as umockdev takes a file's bytes.
std::string descriptors(int vendor, int product) {
  const auto word = [](int value) { return fmt::format("{:02X}{:02X}", value & 0xff, value >> 8); };
  return "1201000200000008" + word(vendor) + word(product) + "000100000101" +  //
         "090229000101008032" + "090400000203000000" + "092111010001221000" +  //
         "07058103020001" + "07050203020001";
}

// A transfer that the client waits for.
struct Urb {
  MockData urb, buffer;

  [[nodiscard]] usbdevfs_urb head() const {
    usbdevfs_urb h{};
    std::memcpy(&h, urb->data, sizeof h);
    return h;
  }
  void complete(int status, std::size_t bytes) const {
    usbdevfs_urb h = head();
    h.status = status;
    h.actual_length = static_cast<int>(bytes);
    std::array<std::uint8_t, sizeof h> raw{};
    std::memcpy(raw.data(), &h, sizeof h);
    put(*urb, raw);
  }
};

// What the client polls at the node: writable only while there is something to fetch, as usbfs. A pipe of one page that
// we keep full or empty.
class ReadySign {
 public:
  void make(const fs::path& node) {
    fs::remove(node);
    if (::mkfifo(node.c_str(), 0600) != 0) throw InputError(node.string(), "", "no pipe can be made there");
    pipe_ = OwnedFd(::open(node.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
    if (pipe_.get() < 0 || ::fcntl(pipe_.get(), F_SETPIPE_SZ, page.size()) < 0)
      throw InputError(node.string(), "", "the pipe there cannot be used");
    show(false);
  }
  void show(bool ready) {
    while ((ready ? ::read(pipe_.get(), page.data(), page.size()) : ::write(pipe_.get(), page.data(), page.size())) > 0)
      continue;
  }

 private:
  std::array<char, 4096> page{};
  OwnedFd pipe_;
};

bool is_request(const Bytes& setup, std::uint8_t type, std::uint8_t request) {
  return setup.size() > setup_bytes && setup[0] == type && setup[1] == request;
}

}  // namespace

struct SimulatedHidButton::Impl {
  Impl(UMockdevTestbed* bed, const SimulatedHidButtonOptions& o);

  static gboolean on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self) {
    return static_cast<Impl*>(self)->answer(client) ? TRUE : FALSE;
  }
  bool answer(UMockdevIoctlClient* client);
  bool administer(UMockdevIoctlClient* client, unsigned long request);
  void submit(UMockdevIoctlClient* client);
  void control(Urb urb, const Bytes& bytes);
  void discard(UMockdevIoctlClient* client);
  void fetch(UMockdevIoctlClient* client);
  void take_lamp(std::span<const std::uint8_t> report);
  void finish_reports();
  void end(Urb urb, int status, std::size_t bytes) {
    urb.complete(status, bytes);
    done.push_back(std::move(urb));
  }
  void show() { ready.show(!done.empty() || (!reports.empty() && !waiting.empty())); }
  void report(bool down);

  UMockdevTestbed* testbed;
  MockDevice device;
  MockHandler handler;
  std::mt19937 random{1};
  std::atomic<bool> lit = false;
  std::atomic<int> lamp_reports = 0, resets = 0;

  std::mutex mutex;  // guards what follows: umockdev's thread answers, the simulator's presses
  ReadySign ready;
  bool plugged = false, pressed = false, kernel_driver = true;
  std::deque<Urb> waiting;    // for a report
  std::deque<Urb> done;       // to be fetched
  std::deque<Bytes> reports;  // that nobody has fetched yet
};

SimulatedHidButton::Impl::Impl(UMockdevTestbed* bed, const SimulatedHidButtonOptions& o) : testbed(bed) {
  const std::string path = fmt::format("/devices/mirrorfield/usb{}/{}-{}", o.bus, o.bus, o.device);
  const std::string node = fmt::format("bus/usb/{:03}/{:03}", o.bus, o.device);
  device = {"/sys" + path, "/dev/" + node,
            fmt::format("P: {}\nN: {}=00\nE: DEVNAME=/dev/{}\nE: DEVTYPE=usb_device\nE: SUBSYSTEM=usb\n"
                        "E: BUSNUM={:03}\nE: DEVNUM={:03}\nA: busnum={}\nA: devnum={}\nA: speed=12\n"
                        "A: bConfigurationValue=1\nA: idVendor={:04x}\nA: idProduct={:04x}\nA: serial={}\n"
                        "H: descriptors={}\n",
                        path, node, node, o.bus, o.device, o.bus, o.device, o.vendor_id, o.product_id, o.serial,
                        descriptors(o.vendor_id, o.product_id))};
}

bool SimulatedHidButton::Impl::answer(UMockdevIoctlClient* client) {
  const std::lock_guard lock(mutex);
  const unsigned long request = umockdev_ioctl_client_get_request(client);
  if (request == USBDEVFS_REAPURBNDELAY || request == USBDEVFS_REAPURB) {
    fetch(client);
  } else if (!plugged) {
    fail(client, ENODEV);
  } else if (request == USBDEVFS_SUBMITURB) {
    submit(client);
  } else if (request == USBDEVFS_DISCARDURB) {
    discard(client);
  } else if (request == USBDEVFS_GET_CAPABILITIES) {
    const std::uint8_t capabilities = USBDEVFS_CAP_NO_PACKET_SIZE_LIM | USBDEVFS_CAP_REAP_AFTER_DISCONNECT;
    put(*argument_bytes(client, sizeof(std::uint32_t)), std::array<std::uint8_t, 4>{capabilities, 0, 0, 0});
    finish(client);
  } else {
    return administer(client, request);
  }
  return true;
}

// The kernel's own driver holds it until it is sent off, as it does with any HID device.
bool SimulatedHidButton::Impl::administer(UMockdevIoctlClient* client, unsigned long request) {
  if (request == USBDEVFS_CLAIMINTERFACE && kernel_driver) {
    fail(client, EBUSY);
    return true;
  }
  if (request == USBDEVFS_DISCONNECT_CLAIM)
    kernel_driver = false;
  else if (request == USBDEVFS_IOCTL)  // the only one that libusb has left: back to the driver
    kernel_driver = true;
  else if (request == USBDEVFS_RESET)
    ++resets;
  else if (request != USBDEVFS_CLAIMINTERFACE && request != USBDEVFS_RELEASEINTERFACE)
    return false;
  finish(client);
  return true;
}

void SimulatedHidButton::Impl::take_lamp(std::span<const std::uint8_t> report) {
  if (report.size() < 2) return;
  lit = (report[1] & 1U) != 0;
  ++lamp_reports;
}

// HID 1.11, 7.2: GET_REPORT and SET_REPORT; anything else is stalled.
void SimulatedHidButton::Impl::control(Urb urb, const Bytes& bytes) {
  if (is_request(bytes, 0xa1, 0x01)) {
    Bytes reply = bytes;
    reply[setup_bytes] = pressed ? 1 : 0;
    put(*urb.buffer, reply);
    end(std::move(urb), 0, std::min<std::size_t>(2, bytes.size() - setup_bytes));
  } else if (is_request(bytes, 0x21, 0x09)) {
    take_lamp(std::span(bytes).subspan(setup_bytes));
    end(std::move(urb), 0, bytes.size() - setup_bytes);
  } else {
    end(std::move(urb), -EPIPE, 0);
  }
}

void SimulatedHidButton::Impl::submit(UMockdevIoctlClient* client) {
  Urb urb{argument_bytes(client, sizeof(usbdevfs_urb)), nullptr};
  const usbdevfs_urb head = urb.head();
  urb.buffer.reset(umockdev_ioctl_data_resolve(urb.urb.get(), offsetof(usbdevfs_urb, buffer),
                                               static_cast<gsize>(head.buffer_length), nullptr));
  const Bytes bytes(urb.buffer->data, urb.buffer->data + urb.buffer->data_len);
  if (head.type == USBDEVFS_URB_TYPE_CONTROL) {
    control(std::move(urb), bytes);
  } else if (head.endpoint == in_endpoint) {
    waiting.push_back(std::move(urb));
  } else if (head.endpoint == out_endpoint) {
    take_lamp(bytes);
    end(std::move(urb), 0, bytes.size());
  } else {
    fail(client, ENOENT);
    return;
  }
  show();
  finish(client);
}

void SimulatedHidButton::Impl::discard(UMockdevIoctlClient* client) {
  const MockData named = argument_bytes(client, sizeof(usbdevfs_urb));
  for (auto urb = waiting.begin(); urb != waiting.end(); ++urb) {
    if (urb->urb->client_addr != named->client_addr) continue;
    end(std::move(*urb), -ENOENT, 0);
    waiting.erase(urb);
    show();
    finish(client);
    return;
  }
  fail(client, EINVAL);
}

void SimulatedHidButton::Impl::finish_reports() {
  while (!reports.empty() && !waiting.empty()) {
    Urb urb = std::move(waiting.front());
    waiting.pop_front();
    put(*urb.buffer, reports.front());
    end(std::move(urb), 0, reports.front().size());
    reports.pop_front();
  }
}

void SimulatedHidButton::Impl::fetch(UMockdevIoctlClient* client) {
  finish_reports();
  if (done.empty()) {
    fail(client, plugged ? EAGAIN : ENODEV);
    return;
  }
  const Urb urb = std::move(done.front());
  done.pop_front();
  const MockData pointer = argument_bytes(client, sizeof(void*));
  umockdev_ioctl_data_set_ptr(pointer.get(), 0, urb.urb.get());
  show();
  finish(client);
}

void SimulatedHidButton::Impl::report(bool down) {
  const std::lock_guard lock(mutex);
  pressed = down;
  if (!plugged) return;
  reports.push_back({static_cast<std::uint8_t>(down ? 1 : 0), 0});
  show();
}

SimulatedHidButton::SimulatedHidButton(UMockdevTestbed* testbed, const SimulatedHidButtonOptions& options)
    : impl_(std::make_unique<Impl>(testbed, options)) {}

SimulatedHidButton::~SimulatedHidButton() {
  try {
    unplug();
  } catch (const InputError&) {  // the testbed goes with it
  }
}

void SimulatedHidButton::plug_in(bool pressed) {
  if (impl_->plugged) return;
  impl_->handler.reset();
  impl_->handler = add_mock_device(impl_->testbed, impl_->device, Impl::on_ioctl, impl_.get());
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->waiting.clear();
    impl_->done.clear();
    impl_->reports.clear();
    impl_->pressed = pressed;
    impl_->kernel_driver = true;
    impl_->lit = false;
    impl_->ready.make(real_node(impl_->testbed, impl_->device));
    impl_->plugged = true;
  }
  umockdev_testbed_uevent(impl_->testbed, impl_->device.path.c_str(), "add");
}

void SimulatedHidButton::unplug() {
  {
    const std::lock_guard lock(impl_->mutex);
    if (!impl_->plugged) return;
    impl_->plugged = false;
    for (Urb& urb : impl_->waiting) impl_->end(std::move(urb), -ESHUTDOWN, 0);
    impl_->waiting.clear();
    impl_->ready.show(true);  // for good: whoever asks is told that it is gone
  }
  remove_mock_device(impl_->testbed, impl_->device);
}

void SimulatedHidButton::contact(bool pressed, int bounces) {
  const auto short_while = [&] { return std::chrono::milliseconds(1 + impl_->random() % 3); };
  impl_->report(pressed);
  for (int i = 0; i < bounces; ++i) {
    std::this_thread::sleep_for(short_while());
    impl_->report(!pressed);
    std::this_thread::sleep_for(short_while());
    impl_->report(pressed);
  }
}

bool SimulatedHidButton::lit() const {
  return impl_->lit;
}

int SimulatedHidButton::lamp_reports() const {
  return impl_->lamp_reports;
}

int SimulatedHidButton::resets() const {
  return impl_->resets;
}

}  // namespace mf::sim
