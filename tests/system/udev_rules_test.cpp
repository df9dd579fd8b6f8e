// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <iterator>
#include <regex>

#include "tests/support/expect_input_error.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_folder.h"
#include "tests/system/udev_rules_lint.h"

namespace mf::test {
namespace {

const std::string rules_file = MF_SOURCE_DIR "/udev/60-mirrorfield.rules";

std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(UdevRules, OursAreClean) {
  const std::string text = text_of(rules_file);
  EXPECT_TRUE(contains(text, "ENV{ID_USB_INTERFACES}==\"*:ef0500:*\""));
  for (const std::string& fault : lint_udev_rules("60-mirrorfield.rules", text)) ADD_FAILURE() << fault;
}

TEST(UdevRules, EachKindOfFaultIsFound) {
  struct Sample {
    const char* rule;
    const char* fault;
  };
  const std::array samples{
      Sample{R"(SUBSYSTEM=="usb", ATTR{idVendor}="1209", GROUP="a", MODE="0660")", "ATTR is assigned with ="},
      Sample{R"(SUBSYSTEM=="usb", ENV{DEVTYPE}="usb_device", GROUP="a", MODE="0660")", "ENV is assigned"},
      Sample{R"(SUBSYSTEM="usb", GROUP="a", MODE="0660")", "SUBSYSTEM is assigned"},
      Sample{R"(SUBSYSTEM=="usb", GROUP="a", MODE="0666")", "lets everybody in"},
      Sample{R"(SUBSYSTEM=="usb", GROUP="a", MODE="0664")", "lets everybody in"},
      Sample{R"(SUBSYSTEM=="usb", GROUP="a", MODE="660")", "four octal digits"},
      Sample{R"(SUBSYSTEM=="usb", MODE="0660")", "belong together"},
      Sample{R"(SUBSYSTEM=="usb", TAG="uaccess")", "must be added"},
      Sample{R"(SUBSYSTEM=="usb", GROUP=="a", MODE="0660")", "GROUP must be assigned"},
      Sample{R"(KERNEL=="event*", GROUP="a", MODE="0660")", "names no SUBSYSTEM"},
      Sample{R"(SUBSYSTEM=="leds", RUN+="/usr/bin/chmod 0666 /sys%p/brightness")", "lets everybody write"},
      Sample{R"(SUBSYSTEM=="leds", RUN+="/usr/bin/chmod a+w /sys%p/brightness")", "lets everybody write"},
      Sample{R"(ACTION=="remove", GOTO="nowhere")", "no LABEL nowhere"},
      Sample{R"(SUBSYSTEM=="usb" GROUP="a", MODE="0660")", "is no KEY"},
      Sample{R"(SUBSYTEM=="usb")", "no key that these rules know"},
      Sample{R"(#SUBSYSTEM=="usb", ATTR{idVendor}="1209")", "ATTR is assigned"},
  };
  for (const Sample& sample : samples) {
    const std::vector<std::string> faults = lint_udev_rules("60-x.rules", std::string(sample.rule) + "\n");
    ASSERT_FALSE(faults.empty()) << sample.rule;
    EXPECT_TRUE(contains(faults.front(), sample.fault));
  }
  EXPECT_EQ(lint_udev_rules("71-x.rules", "SUBSYSTEM==\"usb\", TAG+=\"uaccess\"\n").size(), 1U);
}

// What udev itself makes of the rules, on devices that are simulated, with the user database of a rig.
class UdevTest : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* program : {"unshare", "udevadm", "umockdev-run"})
      if (!has_program(program)) GTEST_SKIP() << program << " is missing";
    if (::geteuid() != 0) GTEST_SKIP() << "needs root, for a mount namespace of its own";
    if (run_command({"unshare", "-m", "true"}).exit_code != 0) GTEST_SKIP() << "no mount namespace can be had";
    std::filesystem::create_directories(folder_ / "rules");
    std::ofstream(folder_ / "rules/60-mirrorfield.rules") << text_of(rules_file);
    std::ofstream(folder_ / "devices") << devices;
    std::ofstream(folder_ / "group") << text_of("/etc/group") << "mirrorfield:x:990:\n";
    std::filesystem::create_directories(folder_ / "run");
    std::ofstream(folder_ / "try.sh") << "set -e\n"
                                         "mount --bind \"$1/run\" /run\n"
                                         "mount --bind \"$1/group\" /etc/group\n"
                                         "mount --bind \"$1/rules\" /etc/udev/rules.d\n"
                                         "exec umockdev-run -d \"$1/devices\" -- udevadm test \"$2\" 2>&1\n";
  }
  [[nodiscard]] std::string udev_says(const std::string& device) const {
    const CommandOutcome outcome =
        run_command({"unshare", "-m", "sh", folder_ / "try.sh", folder_.path(), "/sys/devices/" + device});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.out << outcome.err;
    EXPECT_TRUE(contains(outcome.out, "/etc/udev/rules.d/60-mirrorfield.rules")) << "it was not read";
    EXPECT_EQ(outcome.out.find("nvalid"), std::string::npos) << outcome.out;
    return outcome.out;
  }
  // A camera with USB3 Vision's control interface and a stick with mass storage's; a button with the key RECORD alone,
  // and a keyboard that has it, too; two LEDs.
  static constexpr const char* devices = R"(P: /devices/usb1/1-3
N: bus/usb/001/003=00
E: DEVNAME=/dev/bus/usb/001/003
E: DEVTYPE=usb_device
E: SUBSYSTEM=usb
A: busnum=1
A: devnum=3
A: idVendor=1234
A: idProduct=5678
H: descriptors=12010002EF020140341278560001000001010902200001010080320904000002EF0500000705810240000007050102400000

P: /devices/usb1/1-4
N: bus/usb/001/004=00
E: DEVNAME=/dev/bus/usb/001/004
E: DEVTYPE=usb_device
E: SUBSYSTEM=usb
A: busnum=1
A: devnum=4
A: idVendor=1234
A: idProduct=5679
H: descriptors=1201000200000040341278560001000001010902200001010080320904000002080650000705810240000007050102400000

P: /devices/button/input/input7
E: SUBSYSTEM=input
A: capabilities/key=8000000000 0 0

P: /devices/button/input/input7/event7
N: input/event7=00
E: DEVNAME=/dev/input/event7
E: SUBSYSTEM=input

P: /devices/button/input/input9
E: SUBSYSTEM=input
A: capabilities/key=80 0 0 0 0 0

P: /devices/button/input/input9/event9
N: input/event9=00
E: DEVNAME=/dev/input/event9
E: SUBSYSTEM=input

P: /devices/keyboard/input/input8
E: SUBSYSTEM=input
A: capabilities/key=8000000000 0 fffe

P: /devices/keyboard/input/input8/event8
N: input/event8=00
E: DEVNAME=/dev/input/event8
E: SUBSYSTEM=input

P: /devices/leds/mirrorfield:red:status
E: SUBSYSTEM=leds
A: brightness=0

P: /devices/leds/power
E: SUBSYSTEM=leds
A: brightness=0
)";
  TemporaryFolder folder_;
};

// Whether a device ended with the tag. udev prints a set, in any order, and the system's own rules may add to it.
bool has_tag(const std::string& udev_said, const std::string& tag) {
  return std::regex_search(udev_said, std::regex("(^|\\n)TAGS=:([^\\n]*:)?" + tag + ":"));
}

TEST_F(UdevTest, AUsb3VisionCameraIsGivenToTheGroup) {
  const std::string said = udev_says("usb1/1-3");
  EXPECT_TRUE(contains(said, "ID_USB_INTERFACES=:ef0500:"));
  EXPECT_TRUE(contains(said, "GROUP 990"));
  EXPECT_TRUE(contains(said, "MODE 0660"));
  EXPECT_TRUE(has_tag(said, "uaccess")) << said;
  EXPECT_EQ(udev_says("usb1/1-4").find("GROUP 990"), std::string::npos) << "another USB device";
}

TEST_F(UdevTest, AButtonIsTagged) {
  for (const char* button : {"button/input/input7/event7", "button/input/input9/event9"}) {
    const std::string said = udev_says(button);
    EXPECT_TRUE(contains(said, "GROUP 990")) << button;
    EXPECT_TRUE(contains(said, "MODE 0660")) << button;
    EXPECT_TRUE(has_tag(said, "mirrorfield-button")) << button << said;
  }
  EXPECT_EQ(udev_says("keyboard/input/input8/event8").find("mirrorfield-button"), std::string::npos);
}

TEST_F(UdevTest, ALampOfOursMayBeLit) {
  EXPECT_TRUE(contains(udev_says("leds/mirrorfield:red:status"), "run: '/usr/bin/chgrp mirrorfield"));
  EXPECT_EQ(udev_says("leds/power").find("chgrp"), std::string::npos);
}

}  // namespace
}  // namespace mf::test
