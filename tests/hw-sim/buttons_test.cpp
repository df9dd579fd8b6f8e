// SPDX-License-Identifier: Apache-2.0
// The daemon's buttons against simulated ones: libevdev, libudev and libusb are the real libraries. Runs under
// umockdev's preloaded library.
#include "hw-sim/buttons.h"

#include <gtest/gtest.h>
#include <umockdev.h>

#include <chrono>
#include <future>

#include "device/c_handle.h"
#include "device/hid_button.h"
#include "device/start_button.h"
#include "device/usb_reset.h"
#include "hw-sim/hid_button.h"
#include "hw-sim/v4l2_camera.h"
#include "tests/support/expect_input_error.h"

namespace mf {
namespace {

using namespace std::chrono_literals;

struct Counts {
  int starts = 0, stops = 0;
};

// A simulated button and the daemon's reader of it, whichever kind.
template <typename Simulated>
class Rig {
 public:
  Rig(Simulated& simulated, Button& button) : simulated_(simulated), button_(button) {}

  // Whatever is asked for within `time`, while `meanwhile` runs.
  template <typename Action>
  Counts during(std::chrono::milliseconds time, Action meanwhile) {
    auto acting = std::async(std::launch::async, meanwhile);
    return count(std::chrono::steady_clock::now() + time,
                 [&] { return acting.wait_for(0ms) == std::future_status::ready; });
  }
  Counts during(std::chrono::milliseconds time) {
    return count(std::chrono::steady_clock::now() + time, [] { return true; });
  }
  [[nodiscard]] bool becomes_present(bool present) {
    const auto until = std::chrono::steady_clock::now() + 10s;
    while (button_.present() != present && std::chrono::steady_clock::now() < until)
      if (button_.poll(20ms)) ADD_FAILURE() << "an event from a button that is plugged";
    return button_.present() == present;
  }
  // Waits for an event, generously.
  [[nodiscard]] std::optional<ButtonEvent> next() { return button_.poll(10s); }
  void bounce(bool pressed) { simulated_.contact(pressed, 5); }

 private:
  template <typename Done>
  Counts count(std::chrono::steady_clock::time_point until, Done done) {
    Counts counts;
    while (std::chrono::steady_clock::now() < until || !done()) {
      const auto event = button_.poll(20ms);
      counts.starts += event == ButtonEvent::start ? 1 : 0;
      counts.stops += event == ButtonEvent::stop ? 1 : 0;
    }
    return counts;
  }
  Simulated& simulated_;
  Button& button_;
};

class ButtonsTest : public testing::Test {
 protected:
  void SetUp() override {
    testbed_.reset(umockdev_testbed_new());
    if (!sim::has_umockdev()) GTEST_SKIP() << "runs under umockdev-wrapper (package umockdev)";
  }
  std::unique_ptr<UMockdevTestbed, FreeWith<g_object_unref>> testbed_;
};

template <typename Simulated>
void one_start_and_one_stop(Simulated& simulated, Button& button, std::chrono::milliseconds hold) {
  Rig rig(simulated, button);
  ASSERT_TRUE(rig.becomes_present(true));
  Counts c = rig.during(400ms, [&] { rig.bounce(true); });
  EXPECT_EQ(c.starts, 1) << "one press that bounces";
  c = rig.during(hold + 300ms);
  EXPECT_EQ(c.starts + c.stops, 0) << "held on, it does not stop what it began";
  rig.bounce(false);
  c = rig.during(300ms, [&] {
    rig.bounce(true);
    std::this_thread::sleep_for(60ms);
    rig.bounce(false);
  });
  EXPECT_EQ(c.starts + c.stops, 0) << "a knock while recording";
  rig.bounce(true);
  EXPECT_EQ(rig.next(), ButtonEvent::stop);
  c = rig.during(300ms, [&] { rig.bounce(false); });
  EXPECT_EQ(c.starts + c.stops, 0);
  button.set_recording(false);
  rig.bounce(true);
  EXPECT_EQ(rig.next(), ButtonEvent::start);
}

template <typename Simulated>
void replug(Simulated& simulated, Button& button, int times) {
  Rig rig(simulated, button);
  for (int i = 0; i < times; ++i) {
    ASSERT_TRUE(rig.becomes_present(true)) << i;
    simulated.contact(true);
    ASSERT_EQ(rig.next(), ButtonEvent::start) << i;
    simulated.unplug();  // while it is pressed
    ASSERT_TRUE(rig.becomes_present(false)) << i;
    button.set_recording(false);
    simulated.plug_in(i % 2 == 1);  // every other time still pressed, which is no start
    if (i % 2 == 0) continue;
    ASSERT_TRUE(rig.becomes_present(true)) << i;
    const Counts c = rig.during(80ms);
    ASSERT_EQ(c.starts + c.stops, 0) << i;
    simulated.contact(false);
    (void)rig.during(50ms);
  }
}

TEST_F(ButtonsTest, AnInputDeviceStartsOnceAndIsGrabbed) {
  sim::SimulatedButton simulated(testbed_.get(), {});
  const auto button = open_start_button({});
  EXPECT_FALSE(button->present());
  EXPECT_FALSE(button->poll(10ms));
  simulated.plug_in();
  one_start_and_one_stop(simulated, *button, 1000ms);
  EXPECT_TRUE(simulated.grabbed());
}

TEST_F(ButtonsTest, AnInputDeviceThatWasThereBeforeIsFound) {
  sim::SimulatedButton simulated(testbed_.get(), {});
  simulated.plug_in();
  const auto button = open_start_button({});
  EXPECT_TRUE(button->present());
  EXPECT_EQ(button->problem(), "");
}

TEST_F(ButtonsTest, AnInputDeviceIsReplugged) {
  sim::SimulatedButton simulated(testbed_.get(), {});
  const auto button = open_start_button({});
  simulated.plug_in();
  replug(simulated, *button, 10);
}

TEST_F(ButtonsTest, OnlyDevicesWithTheTagAndTheKeyAreTaken) {
  sim::SimulatedButtonOptions keyboard{"event3", "", 30, false};
  sim::SimulatedButton untagged(testbed_.get(), keyboard);
  sim::SimulatedButtonOptions other{"event4", "mirrorfield-button", 30, false};
  sim::SimulatedButton other_key(testbed_.get(), other);
  sim::SimulatedButton simulated(testbed_.get(), {});
  untagged.plug_in();
  other_key.plug_in();
  StartButtonOptions options;
  options.key = "KEY_RECORD";
  const auto button = open_start_button(options);
  EXPECT_FALSE(button->present());
  simulated.plug_in();
  Rig rig(simulated, *button);
  ASSERT_TRUE(rig.becomes_present(true));
  EXPECT_FALSE(untagged.grabbed());
  EXPECT_FALSE(other_key.grabbed());
  const Counts c = rig.during(150ms, [&] { other_key.contact(true); });
  EXPECT_EQ(c.starts, 0);
}

TEST_F(ButtonsTest, ADeviceThatAnotherHoldsIsAProblemWithItsRemedy) {
  sim::SimulatedButtonOptions held;
  held.refuses_grab = true;
  sim::SimulatedButton simulated(testbed_.get(), held);
  simulated.plug_in();
  const auto button = open_start_button({});
  EXPECT_FALSE(button->present());
  EXPECT_TRUE(test::contains(button->problem(), "/dev/input/event5: cannot be grabbed"));
}

TEST_F(ButtonsTest, OptionsThatDoNotFitAreRefused) {
  StartButtonOptions options;
  options.key = "KEY_NONSENSE";
  EXPECT_TRUE(test::contains(test::input_error_of([&] { (void)open_start_button(options); }), "KEY_NONSENSE"));
  HidButtonOptions hid;
  EXPECT_TRUE(test::contains(test::input_error_of([&] { (void)open_hid_button(hid); }), "vendor"));
  hid.vendor_id = 0x1209;
  hid.button_byte = 8;
  EXPECT_TRUE(test::contains(test::input_error_of([&] { (void)open_hid_button(hid); }), "not in its report"));
}

HidButtonOptions hid_options(int lamp_endpoint = 0) {
  HidButtonOptions o;
  o.vendor_id = 0x1209;
  o.product_id = 0x0001;
  o.report_bytes = 2;
  o.lamp = HidLampOptions{{0, 0}, 1, 1, lamp_endpoint, std::nullopt};
  return o;
}

TEST_F(ButtonsTest, AHidButtonStartsOnce) {
  sim::SimulatedHidButton simulated(testbed_.get(), {});
  HidButtonOptions options = hid_options();
  options.timing.hold = 500ms;
  const auto button = open_hid_button(options);
  EXPECT_FALSE(button->poll(10ms));
  EXPECT_FALSE(button->present());
  simulated.plug_in();
  one_start_and_one_stop(simulated, *button, options.timing.hold);
  EXPECT_EQ(button->problem(), "");
}

TEST_F(ButtonsTest, AHidButtonIsReplugged) {
  sim::SimulatedHidButton simulated(testbed_.get(), {});
  const auto button = open_hid_button(hid_options());
  simulated.plug_in();
  replug(simulated, *button, 10);
}

TEST_F(ButtonsTest, AHidButtonsLampIsLitByEitherWay) {
  for (const int endpoint : {0, 2}) {
    sim::SimulatedHidButton simulated(testbed_.get(), {});
    const auto button = open_hid_button(hid_options(endpoint));
    button->light(true);  // before it is there
    simulated.plug_in();
    const auto shows = [&](bool lit) {
      for (int i = 0; i < 500 && simulated.lit() != lit; ++i) (void)button->poll(10ms);
      return simulated.lit() == lit;
    };
    EXPECT_TRUE(shows(true)) << endpoint;
    button->light(false);
    EXPECT_TRUE(shows(false)) << endpoint;
    const int told = simulated.lamp_reports();
    button->light(false);
    (void)button->poll(30ms);
    EXPECT_EQ(simulated.lamp_reports(), told) << "the same again is not sent";
    button->light(true);
    EXPECT_TRUE(shows(true));
    simulated.unplug();
    for (int i = 0; i < 500 && button->present(); ++i) (void)button->poll(10ms);
    simulated.plug_in();
    EXPECT_TRUE(shows(true)) << "a lamp that comes back is told again";
    auto sender = std::async(std::launch::async, [&] { button->light(false); });
    const auto began = std::chrono::steady_clock::now();
    while (simulated.lit() && std::chrono::steady_clock::now() - began < 10s) (void)button->poll(100ms);
    EXPECT_FALSE(simulated.lit());
  }
}

TEST_F(ButtonsTest, AUsbDeviceIsResetByNameAndSerial) {
  using Result = UsbResetOutcome::Result;
  sim::SimulatedHidButton one(testbed_.get(), {});
  sim::SimulatedHidButtonOptions other;
  other.serial = "MF-BUTTON-2";
  other.device = 8;
  sim::SimulatedHidButton two(testbed_.get(), other);
  EXPECT_EQ(reset_usb_device({0x1209, 1, "MF-BUTTON-1"}).result, Result::absent);
  one.plug_in();
  EXPECT_EQ(reset_usb_device({0x1209, 1, ""}).result, Result::done);
  EXPECT_EQ(one.resets(), 1);
  two.plug_in();
  EXPECT_EQ(reset_usb_device({0x1209, 1, ""}).result, Result::refused) << "two of that name";
  EXPECT_EQ(reset_usb_device({0, 0, "MF-BUTTON-2"}).result, Result::done);
  EXPECT_EQ(one.resets(), 1);
  EXPECT_EQ(two.resets(), 1);
  EXPECT_EQ(reset_usb_device({0x1209, 2, "MF-BUTTON-2"}).result, Result::absent);
  EXPECT_EQ(reset_usb_device({}).result, Result::refused);
}

}  // namespace
}  // namespace mf
