// SPDX-License-Identifier: Apache-2.0
#include "device/hid_button.h"

#include <fmt/format.h>
#include <libusb-1.0/libusb.h>

#include <algorithm>
#include <atomic>
#include <deque>
#include <utility>

#include "common/error.h"
#include "device/c_handle.h"
#include "device/clock.h"

namespace mf {

namespace {

using UsbContext = std::unique_ptr<libusb_context, FreeWith<libusb_exit>>;
using UsbTransfer = std::unique_ptr<libusb_transfer, FreeWith<libusb_free_transfer>>;

constexpr std::int64_t look_each_ns = 1'000'000'000;  // what could not be opened is tried again so often
constexpr unsigned answer_ms = 100;                   // a button that does not answer within is as good as silent

// A transfer with its bytes; `under_way` from its submission to its callback.
struct Transfer {
  UsbTransfer usb{libusb_alloc_transfer(0)};
  std::vector<std::uint8_t> bytes;
  bool under_way = false;

  bool submit() {
    under_way = libusb_submit_transfer(usb.get()) == LIBUSB_SUCCESS;
    return under_way;
  }
  void cancel() const {
    if (under_way) (void)libusb_cancel_transfer(usb.get());
  }
};

class LibusbButton final : public HidButton {
 public:
  explicit LibusbButton(const HidButtonOptions& options);
  ~LibusbButton() override;

  [[nodiscard]] std::optional<ButtonEvent> poll(std::chrono::milliseconds at_most) override;
  void set_recording(bool recording) override { logic_.set_recording(recording); }
  [[nodiscard]] bool present() const override { return handle_ != nullptr; }
  [[nodiscard]] std::string problem() const override { return problem_; }
  void light(bool lit) override {
    lit_ = lit;
    libusb_interrupt_event_handler(context_.get());
  }

 private:
  static int LIBUSB_CALL on_plugging(libusb_context*, libusb_device*, libusb_hotplug_event, void* self);
  static void LIBUSB_CALL on_report(libusb_transfer* transfer);
  static void LIBUSB_CALL on_lamp_sent(libusb_transfer* transfer);

  void look_for_device();
  void open(libusb_device* device);
  void close();
  void refuse(const char* what, int error);
  void ask_for_first_level();
  void take_report(const std::uint8_t* report, int length);
  void send_lamp();
  void note(std::optional<ButtonEvent> event) {
    if (event) meant_.push_back(*event);
  }
  void handle_events(std::int64_t until_ns);

  HidButtonOptions options_;
  ButtonLogic logic_;
  UsbContext context_;
  libusb_hotplug_callback_handle plugging_ = 0;
  libusb_device_handle* handle_ = nullptr;  // closed by close(), which has transfers to end before
  Transfer report_, lamp_;
  std::deque<ButtonEvent> meant_;  // not yet told
  std::string problem_;
  std::int64_t look_again_ns_ = 0;  // at once
  bool gone_ = false;               // close it
  std::atomic<bool> lit_ = false;
  std::optional<bool> shown_;  // what the lamp was told; none: it has to be told again
};

LibusbButton::LibusbButton(const HidButtonOptions& options) : options_(options), logic_(options.timing) {
  libusb_context* raw = nullptr;
  const int made = libusb_init(&raw);
  if (made != LIBUSB_SUCCESS)
    throw InputError("the button", "", fmt::format("libusb does not start: {}", libusb_strerror(made)));
  context_.reset(raw);
  // Without hot-plug (no udev) it is looked for once a second.
  if (libusb_has_capability(LIBUSB_CAP_HAS_HOTPLUG) != 0)
    (void)libusb_hotplug_register_callback(raw, LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED | LIBUSB_HOTPLUG_EVENT_DEVICE_LEFT,
                                           LIBUSB_HOTPLUG_NO_FLAGS, options.vendor_id, options.product_id,
                                           LIBUSB_HOTPLUG_MATCH_ANY, on_plugging, this, &plugging_);
}

LibusbButton::~LibusbButton() {
  close();
  if (plugging_ != 0) libusb_hotplug_deregister_callback(context_.get(), plugging_);
}

// Here nothing may be opened or asked: poll() does that.
int LibusbButton::on_plugging(libusb_context* /*context*/, libusb_device* device, libusb_hotplug_event event,
                              void* self) {
  auto& button = *static_cast<LibusbButton*>(self);
  if (event == LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED)
    button.look_again_ns_ = 0;
  else if (button.handle_ != nullptr && libusb_get_device(button.handle_) == device)
    button.gone_ = true;
  return 0;  // go on telling
}

void LibusbButton::on_report(libusb_transfer* transfer) {
  auto& button = *static_cast<LibusbButton*>(transfer->user_data);
  button.report_.under_way = false;
  if (transfer->status == LIBUSB_TRANSFER_CANCELLED) return;
  if (transfer->status == LIBUSB_TRANSFER_COMPLETED) button.take_report(transfer->buffer, transfer->actual_length);
  // Whatever else went wrong, opening it anew is the remedy.
  if (transfer->status != LIBUSB_TRANSFER_COMPLETED || !button.report_.submit()) button.gone_ = true;
}

void LibusbButton::on_lamp_sent(libusb_transfer* transfer) {
  auto& button = *static_cast<LibusbButton*>(transfer->user_data);
  button.lamp_.under_way = false;
  if (transfer->status == LIBUSB_TRANSFER_NO_DEVICE) button.gone_ = true;
}

void LibusbButton::take_report(const std::uint8_t* report, int length) {
  if (length <= options_.button_byte) return;
  if (options_.report_id && report[0] != *options_.report_id) return;
  const bool set = (report[options_.button_byte] & options_.button_mask) != 0;
  note(logic_.contact(clock_ns(CLOCK_MONOTONIC), set != options_.pressed_when_clear));
}

void LibusbButton::refuse(const char* what, int error) {
  const char* remedy = error == LIBUSB_ERROR_BUSY ? "end the program that holds it" : "see udev/60-mirrorfield.rules";
  problem_ = fmt::format("the button {:04x}:{:04x} cannot be {}: {}: {}", options_.vendor_id, options_.product_id, what,
                         libusb_strerror(error), remedy);
}

void LibusbButton::look_for_device() {
  look_again_ns_ = clock_ns(CLOCK_MONOTONIC) + look_each_ns;
  problem_.clear();
  libusb_device** list = nullptr;
  const ssize_t count = libusb_get_device_list(context_.get(), &list);
  for (ssize_t i = 0; i < count && handle_ == nullptr; ++i) {
    libusb_device_descriptor d{};
    if (libusb_get_device_descriptor(list[i], &d) == LIBUSB_SUCCESS && d.idVendor == options_.vendor_id &&
        d.idProduct == options_.product_id)
      open(list[i]);
  }
  if (count >= 0) libusb_free_device_list(list, 1);
}

void LibusbButton::open(libusb_device* device) {
  if (const int error = libusb_open(device, &handle_); error != LIBUSB_SUCCESS) {
    handle_ = nullptr;
    if (error != LIBUSB_ERROR_NO_DEVICE) refuse("opened", error);
    return;
  }
  gone_ = false;
  shown_.reset();
  (void)libusb_set_auto_detach_kernel_driver(handle_, 1);  // where there is no such thing, claiming says so
  const int claimed = libusb_claim_interface(handle_, options_.interface_number);
  if (claimed != LIBUSB_SUCCESS) {
    refuse("claimed", claimed);
    libusb_close(std::exchange(handle_, nullptr));
    return;
  }
  ask_for_first_level();
  report_.bytes.resize(static_cast<std::size_t>(options_.report_bytes));
  libusb_fill_interrupt_transfer(report_.usb.get(), handle_, static_cast<unsigned char>(options_.endpoint),
                                 report_.bytes.data(), options_.report_bytes, on_report, this, 0);
  if (!report_.submit()) gone_ = true;
}

// A button reports only changes: one that is down now would seem to be up until then. One that can't be asked is up.
void LibusbButton::ask_for_first_level() {
  constexpr std::uint8_t from_interface = 0xa1, get_report = 0x01;  // HID 1.11, 7.2.1
  std::vector<std::uint8_t> report(static_cast<std::size_t>(options_.report_bytes));
  const int got = libusb_control_transfer(handle_, from_interface, get_report,
                                          static_cast<std::uint16_t>(0x100 | options_.report_id.value_or(0)),
                                          static_cast<std::uint16_t>(options_.interface_number), report.data(),
                                          static_cast<std::uint16_t>(report.size()), answer_ms);
  logic_.unplugged();
  if (got > options_.button_byte)
    take_report(report.data(), got);
  else
    note(logic_.contact(clock_ns(CLOCK_MONOTONIC), false));
}

void LibusbButton::close() {
  if (handle_ == nullptr) return;
  report_.cancel();
  lamp_.cancel();
  const std::int64_t until_ns = clock_ns(CLOCK_MONOTONIC) + look_each_ns;
  while ((report_.under_way || lamp_.under_way) && clock_ns(CLOCK_MONOTONIC) < until_ns) handle_events(until_ns);
  (void)libusb_release_interface(handle_, options_.interface_number);
  libusb_close(std::exchange(handle_, nullptr));  // and the kernel ends what is still under way
  logic_.unplugged();
}

void LibusbButton::send_lamp() {
  const bool lit = lit_;
  if (!options_.lamp || handle_ == nullptr || lamp_.under_way || shown_ == lit) return;
  const HidLampOptions& o = *options_.lamp;
  std::vector<std::uint8_t> report = o.report;
  std::uint8_t& byte = report[static_cast<std::size_t>(o.byte)];
  byte = static_cast<std::uint8_t>(lit ? byte | o.mask : byte & ~o.mask);
  if (o.endpoint != 0) {
    lamp_.bytes = std::move(report);
    libusb_fill_interrupt_transfer(lamp_.usb.get(), handle_, static_cast<unsigned char>(o.endpoint), lamp_.bytes.data(),
                                   static_cast<int>(lamp_.bytes.size()), on_lamp_sent, this, answer_ms);
  } else {
    constexpr std::uint8_t to_interface = 0x21, set_report = 0x09;  // HID 1.11, 7.2.2
    lamp_.bytes.assign(LIBUSB_CONTROL_SETUP_SIZE, 0);
    libusb_fill_control_setup(
        lamp_.bytes.data(), to_interface, set_report, static_cast<std::uint16_t>(0x200 | o.report_id.value_or(0)),
        static_cast<std::uint16_t>(options_.interface_number), static_cast<std::uint16_t>(report.size()));
    lamp_.bytes.insert(lamp_.bytes.end(), report.begin(), report.end());
    libusb_fill_control_transfer(lamp_.usb.get(), handle_, lamp_.bytes.data(), on_lamp_sent, this, answer_ms);
  }
  shown_ = lit;  // a lamp that fails is told again at the next change, and does not keep the button from being read
  (void)lamp_.submit();
}

void LibusbButton::handle_events(std::int64_t until_ns) {
  const std::int64_t left_us = std::max<std::int64_t>(0, until_ns - clock_ns(CLOCK_MONOTONIC)) / 1000;
  timeval left{left_us / 1'000'000, left_us % 1'000'000};
  (void)libusb_handle_events_timeout_completed(context_.get(), &left, nullptr);
}

std::optional<ButtonEvent> LibusbButton::poll(std::chrono::milliseconds at_most) {
  const std::int64_t until_ns = clock_ns(CLOCK_MONOTONIC) + std::chrono::nanoseconds(at_most).count();
  while (true) {
    handle_events(0);
    if (gone_) close();
    gone_ = false;
    if (handle_ == nullptr && clock_ns(CLOCK_MONOTONIC) >= look_again_ns_) look_for_device();
    send_lamp();
    note(logic_.advance(clock_ns(CLOCK_MONOTONIC)));
    if (!meant_.empty()) {
      const ButtonEvent event = meant_.front();
      meant_.pop_front();
      return event;
    }
    if (clock_ns(CLOCK_MONOTONIC) >= until_ns) return std::nullopt;
    if (gone_) continue;
    handle_events(std::min({until_ns, logic_.deadline_ns(), handle_ == nullptr ? look_again_ns_ : until_ns}));
  }
}

bool within(int value, int low, int high) {
  return value >= low && value <= high;
}

std::string lamp_problem(const HidLampOptions& o) {
  if (o.report.empty() || o.report.size() > 1024) return "the lamp's report must have 1 to 1024 bytes";
  if (!within(o.byte, 0, static_cast<int>(o.report.size()) - 1)) return "the lamp's byte is not in its report";
  if (!within(o.mask, 1, 255)) return "the lamp's mask must lie from 1 to 255";
  if (!within(o.endpoint, 0, 0x0f)) return "the lamp's endpoint must be 0, or 0x01 to 0x0f (OUT)";
  if (o.report_id && !within(*o.report_id, 1, 255)) return "the lamp's report number must lie from 1 to 255";
  return "";
}

}  // namespace

std::string HidButtonOptions::problem() const {
  if (!within(vendor_id, 1, 0xffff) || !within(product_id, 0, 0xffff)) return "vendor and product are 16-bit numbers";
  if (!within(interface_number, 0, 255)) return "the interface must lie from 0 to 255";
  if (!within(endpoint, 0x81, 0x8f)) return "the button's endpoint must lie from 0x81 to 0x8f (IN)";
  if (!within(report_bytes, 1, 1024)) return "a report has 1 to 1024 bytes";
  if (!within(button_byte, 0, report_bytes - 1)) return "the button's byte is not in its report";
  if (!within(button_mask, 1, 255)) return "the button's mask must lie from 1 to 255";
  if (report_id && !within(*report_id, 1, 255)) return "the button's report number must lie from 1 to 255";
  if (lamp) return lamp_problem(*lamp);
  return timing.problem();
}

std::unique_ptr<HidButton> open_hid_button(const HidButtonOptions& options) {
  if (const std::string problem = options.problem(); !problem.empty()) throw InputError("the button", "", problem);
  return std::make_unique<LibusbButton>(options);
}

}  // namespace mf
