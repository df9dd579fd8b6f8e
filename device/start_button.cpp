// SPDX-License-Identifier: Apache-2.0
#include "device/start_button.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <libevdev/libevdev.h>
#include <poll.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <deque>
#include <set>
#include <vector>

#include "common/error.h"
#include "device/clock.h"
#include "device/owned_fd.h"
#include "device/udev_handle.h"

namespace mf {

namespace {

using Evdev = std::unique_ptr<libevdev, FreeWith<libevdev_free>>;

constexpr std::int64_t retry_ns = 1'000'000'000;  // a device that could not be opened is tried again so often

// One input device, open and grabbed.
struct InputDevice {
  std::string node;
  OwnedFd file;  // outlives evdev, which lets go of its grab through it
  Evdev evdev;
  std::set<unsigned> down;  // keys
  bool hung_up = false;     // poll says so: it is gone, whatever reading says
};

struct Opened {
  std::optional<InputDevice> device;
  std::string problem;  // empty without a device: it has no such key
};

// Any key but those of a mouse's or a touchscreen's making would do; a device without keys is no button.
bool has_key(const libevdev* device, std::optional<unsigned> key) {
  if (libevdev_has_event_type(device, EV_KEY) == 0) return false;
  return !key || libevdev_has_event_code(device, EV_KEY, *key) != 0;
}

std::string why_not(const std::string& node, const char* what, int error, const char* remedy) {
  return fmt::format("{}: cannot be {}: {}: {}", node, what, std::strerror(error), remedy);
}

Opened open_input(const std::string& node, std::optional<unsigned> key) {
  OwnedFd file(::open(node.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC));
  if (file.get() < 0 && (errno == ENOENT || errno == ENODEV || errno == ENXIO)) return {};  // unplugged by now
  if (file.get() < 0) return {{}, why_not(node, "opened", errno, "see udev/60-mirrorfield.rules")};
  libevdev* raw = nullptr;
  const int made = libevdev_new_from_fd(file.get(), &raw);
  if (made < 0) return {{}, why_not(node, "read as a button", -made, "take the udev tag from it")};
  Evdev evdev(raw);
  if (!has_key(raw, key)) return {};
  const int grabbed = libevdev_grab(raw, LIBEVDEV_GRAB);
  if (grabbed < 0) return {{}, why_not(node, "grabbed", -grabbed, "end the program that holds it")};
  (void)libevdev_set_clock_id(raw, CLOCK_MONOTONIC);  // refused by no kernel of today
  InputDevice device{node, std::move(file), std::move(evdev), {}, false};
  for (unsigned code = 0; code < KEY_CNT; ++code)
    if ((!key || code == *key) && libevdev_get_event_value(raw, EV_KEY, code) != 0) device.down.insert(code);
  return {std::move(device), {}};
}

std::optional<unsigned> key_code(const std::string& name) {
  if (name.empty()) return std::nullopt;
  const int code = libevdev_event_code_from_name(EV_KEY, name.c_str());
  if (code < 0) throw InputError("the button", "key", name + " is no key: name one as KEY_RECORD or BTN_0");
  return static_cast<unsigned>(code);
}

class EvdevButton final : public Button {
 public:
  explicit EvdevButton(const StartButtonOptions& options)
      : tag_(":" + options.udev_tag + ":"), key_(key_code(options.key)), logic_(options.timing), udev_(udev_new()) {
    if (udev_) monitor_.reset(udev_monitor_new_from_netlink(udev_.get(), "udev"));
    if (!monitor_) throw InputError("the button", "", "libudev does not answer: run it where /run/udev and /sys are");
    udev_monitor_filter_add_match_subsystem_devtype(monitor_.get(), "input", nullptr);
    udev_monitor_enable_receiving(monitor_.get());  // before looking, so that none slips through
    look_for_devices();
  }

  [[nodiscard]] std::optional<ButtonEvent> poll(std::chrono::milliseconds at_most) override;
  void set_recording(bool recording) override { logic_.set_recording(recording); }
  [[nodiscard]] bool present() const override { return !devices_.empty(); }
  [[nodiscard]] std::string problem() const override { return problem_; }

 private:
  void look_for_devices();
  void add_if_tagged(udev_device* device);
  void wait_until(std::int64_t time_ns);
  void hear_of_plugging();
  [[nodiscard]] bool read(InputDevice& device);  // false: it is gone
  void take(InputDevice& device, const input_event& event);
  void read_all();
  void note(std::optional<ButtonEvent> event) {
    if (event) meant_.push_back(*event);
  }
  [[nodiscard]] bool pressed() const {
    return std::any_of(devices_.begin(), devices_.end(), [](const InputDevice& d) { return !d.down.empty(); });
  }

  std::string tag_;  // as udev lists it among others: ":tag:"
  std::optional<unsigned> key_;
  ButtonLogic logic_;
  Udev udev_;
  UdevMonitor monitor_;
  std::vector<InputDevice> devices_;
  std::deque<ButtonEvent> meant_;  // not yet told
  std::string problem_;
  std::int64_t look_again_ns_ = ButtonLogic::never;
};

// By the property that lists the tags, not by udev's index of tags: the same whether the kernel's devices are looked at
// or simulated ones.
void EvdevButton::add_if_tagged(udev_device* device) {
  const char* node = device == nullptr ? nullptr : udev_device_get_devnode(device);
  const char* tags = device == nullptr ? nullptr : udev_device_get_property_value(device, "TAGS");
  if (node == nullptr || tags == nullptr || std::string_view(tags).find(tag_) == std::string_view::npos) return;
  for (const InputDevice& known : devices_)
    if (known.node == node) return;
  Opened opened = open_input(node, key_);
  if (opened.device) {
    devices_.push_back(std::move(*opened.device));
    logic_.unplugged();  // whatever was under way: a contact that is closed now was closed by plugging it in
    (void)logic_.contact(clock_ns(CLOCK_MONOTONIC), pressed());
  } else if (!opened.problem.empty()) {
    problem_ = opened.problem;
    look_again_ns_ = clock_ns(CLOCK_MONOTONIC) + retry_ns;
  }
}

void EvdevButton::look_for_devices() {
  problem_.clear();
  look_again_ns_ = ButtonLogic::never;
  const UdevEnumerate found(udev_enumerate_new(udev_.get()));
  udev_enumerate_add_match_subsystem(found.get(), "input");
  udev_enumerate_add_match_sysname(found.get(), "event*");
  udev_enumerate_scan_devices(found.get());
  for (udev_list_entry* e = udev_enumerate_get_list_entry(found.get()); e != nullptr; e = udev_list_entry_get_next(e))
    add_if_tagged(UdevDevice(udev_device_new_from_syspath(udev_.get(), udev_list_entry_get_name(e))).get());
}

// Every message is a reason to look, whatever it says: so a lost one costs nothing.
void EvdevButton::hear_of_plugging() {
  bool heard = false;
  while (UdevDevice(udev_monitor_receive_device(monitor_.get()))) heard = true;
  if (heard || clock_ns(CLOCK_MONOTONIC) >= look_again_ns_) look_for_devices();
}

void EvdevButton::take(InputDevice& device, const input_event& event) {
  if (event.type != EV_KEY || (key_ && event.code != *key_)) return;
  if (event.value == 0)
    device.down.erase(event.code);
  else
    device.down.insert(event.code);
  // A time that is none of this clock's would stop the button for good: never later than now.
  const std::int64_t time_ns = std::int64_t{event.input_event_sec} * 1'000'000'000 + event.input_event_usec * 1000;
  note(logic_.contact(std::min(time_ns, clock_ns(CLOCK_MONOTONIC)), pressed()));
}

bool EvdevButton::read(InputDevice& device) {
  unsigned flag = LIBEVDEV_READ_FLAG_NORMAL;
  while (true) {
    input_event event{};
    const int got = libevdev_next_event(device.evdev.get(), flag, &event);
    if (got == -EAGAIN && flag == LIBEVDEV_READ_FLAG_SYNC) {
      flag = LIBEVDEV_READ_FLAG_NORMAL;  // caught up with what the kernel had dropped
      continue;
    }
    if (got == -EINTR) continue;
    if (got < 0) return got == -EAGAIN;
    if (got == LIBEVDEV_READ_STATUS_SYNC) flag = LIBEVDEV_READ_FLAG_SYNC;
    take(device, event);
  }
}

void EvdevButton::read_all() {
  const auto gone =
      std::remove_if(devices_.begin(), devices_.end(), [this](InputDevice& d) { return !read(d) || d.hung_up; });
  if (gone != devices_.end()) {
    devices_.erase(gone, devices_.end());
    logic_.unplugged();
    if (present()) note(logic_.contact(clock_ns(CLOCK_MONOTONIC), pressed()));
    look_again_ns_ = clock_ns(CLOCK_MONOTONIC);  // the message of its return may have come already
  }
  note(logic_.advance(clock_ns(CLOCK_MONOTONIC)));
}

void EvdevButton::wait_until(std::int64_t time_ns) {
  std::vector<pollfd> files{{udev_monitor_get_fd(monitor_.get()), POLLIN, 0}};
  for (const InputDevice& device : devices_) files.push_back({device.file.get(), POLLIN, 0});
  const std::int64_t left_ns = std::max<std::int64_t>(0, time_ns - clock_ns(CLOCK_MONOTONIC));
  const timespec left{left_ns / 1'000'000'000, left_ns % 1'000'000'000};
  if (::ppoll(files.data(), files.size(), &left, nullptr) <= 0) return;  // a signal is as good as a time-out
  for (std::size_t i = 0; i < devices_.size(); ++i)
    devices_[i].hung_up = (files[i + 1].revents & (POLLHUP | POLLERR | POLLNVAL)) != 0;
}

std::optional<ButtonEvent> EvdevButton::poll(std::chrono::milliseconds at_most) {
  const std::int64_t until_ns = clock_ns(CLOCK_MONOTONIC) + std::chrono::nanoseconds(at_most).count();
  while (true) {
    wait_until(std::min({until_ns, logic_.deadline_ns(), look_again_ns_}));  // be it to look which are gone
    read_all();
    if (!meant_.empty()) {
      const ButtonEvent event = meant_.front();
      meant_.pop_front();
      return event;
    }
    hear_of_plugging();
    if (clock_ns(CLOCK_MONOTONIC) >= until_ns) return std::nullopt;
  }
}

}  // namespace

std::unique_ptr<Button> open_start_button(const StartButtonOptions& options) {
  if (const std::string problem = options.timing.problem(); !problem.empty())
    throw InputError("the button", "", problem);
  if (options.udev_tag.empty())
    throw InputError("the button", "tag", "must not be empty: see udev/60-mirrorfield.rules");
  return std::make_unique<EvdevButton>(options);
}

}  // namespace mf
