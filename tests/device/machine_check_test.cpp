// SPDX-License-Identifier: Apache-2.0
// Against made-up trees of /proc, /sys and /dev.
#include "device/machine_check.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <iostream>

#include "device/board.h"
#include "device/instance_lock.h"
#include "tests/support/temporary_folder.h"

namespace mf {
namespace {

using Level = Finding::Level;

class MachineCheck : public testing::Test {
 protected:
  // A machine with nothing to complain of.
  MachineCheck() {
    put("proc/sys/net/core/rmem_max", "33554432");
    put("proc/net/route",
        "Iface\tDestination\tGateway\tFlags\tRefCnt\tUse\tMetric\tMask\tMTU\tWindow\tIRTT\n"
        "wlan0\t00000000\t0100000A\t0003\t0\t0\t100\t00000000\t0\t0\t0\n"
        "eth0\t0001A8C0\t00000000\t0001\t0\t0\t0\t00FFFFFF\t0\t0\t0\n");
    put("sys/class/net/eth0/mtu", "9000");
    put("sys/class/net/wlan0/mtu", "1500");
    put("sys/module/usbcore/parameters/usbfs_memory_mb", "1000");
    put("sys/bus/usb/devices/1-1:1.0/bInterfaceClass", "ef");
    put("sys/bus/usb/devices/1-1:1.0/bInterfaceSubClass", "05");
    put("sys/bus/usb/devices/1-1/busnum", "1");
    put("sys/bus/usb/devices/1-1/devnum", "9");
    put("dev/bus/usb/001/009", "");
    put("dev/video0", "");
    put("sys/devices/system/clocksource/clocksource0/current_clocksource", "tsc");
    put("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "schedutil");
    put("sys/class/thermal/thermal_zone0/temp", "41000");
    std::filesystem::create_directories(machine_ / "recordings");
    options_.gige = options_.usb = true;
    options_.camera_address = "192.168.1.20";
    options_.video_node = machine_ / "dev/video0";
    options_.recordings = machine_ / "recordings";
    options_.bytes_per_second = 1e5;
    options_.proc = machine_ / "proc";
    options_.sys = machine_ / "sys";
    options_.dev = machine_ / "dev";
    options_.clock_is_set = [] { return true; };
  }
  void put(const std::filesystem::path& file, const std::string& content) {
    std::filesystem::create_directories((machine_ / file).parent_path());
    std::ofstream(machine_ / file) << content << "\n";
  }
  // What the findings say of `part`: "level: remedy"; empty when none does.
  [[nodiscard]] std::string of(const std::string& part) const {
    for (const Finding& f : check_machine(options_))
      if (f.what.find(part) != std::string::npos) return finding_line(f);
    return "";
  }
  testing::AssertionResult says(const std::string& part, const std::string& level, const std::string& remedy) const {
    const std::string line = of(part);
    const bool good = line.starts_with(level + ": ") && line.find(remedy) != std::string::npos;
    return (good ? testing::AssertionSuccess() : testing::AssertionFailure()) << "'" << line << "'";
  }
  test::TemporaryFolder machine_;
  MachineCheckOptions options_;
};

TEST_F(MachineCheck, AMachineInOrderHasNothingWrong) {
  const std::vector<Finding> findings = check_machine(options_);
  EXPECT_GE(findings.size(), 12U);
  for (const Finding& f : findings) {
    // How fast this disk is, and what it is, is not made up.
    if (f.what.find("become durable") != std::string::npos || f.what.find(" is on ") != std::string::npos) continue;
    EXPECT_EQ(f.level, Level::ok) << finding_line(f);
    EXPECT_EQ(f.remedy, "");
  }
}

TEST_F(MachineCheck, LeavesNothingBehind) {
  (void)check_machine(options_);
  EXPECT_TRUE(std::filesystem::is_empty(options_.recordings));
}

TEST_F(MachineCheck, Network) {
  EXPECT_TRUE(says("camera.packet_bytes is 1400, eth0 passes 9000", "ok", ""));
  put("proc/sys/net/core/rmem_max", "212992");
  EXPECT_TRUE(says("net.core.rmem_max is 212992", "warning", "sysctl -w net.core.rmem_max=16777216"));
  put("sys/class/net/eth0/mtu", "1500");
  options_.packet_bytes = 8000;
  EXPECT_TRUE(says("packet_bytes is 8000, eth0 passes 1500", "error", "ip link set eth0 mtu 8000"));
  options_.camera_address = "10.1.1.1";
  EXPECT_TRUE(says("packet_bytes is 8000, wlan0 passes 1500", "error", "smaller"));
  put("proc/net/route", "Iface\tDestination\tGateway\tFlags\tRefCnt\tUse\tMetric\tMask\tMTU\tWindow\tIRTT\n");
  EXPECT_TRUE(says("no network reaches 10.1.1.1", "error", "address"));
  options_.camera_address = "Maker-Model-123";
  EXPECT_TRUE(says("packets of 8000 bytes", "ok", ""));
}

TEST_F(MachineCheck, Usb) {
  put("sys/module/usbcore/parameters/usbfs_memory_mb", "16");
  EXPECT_TRUE(says("usbfs_memory_mb is 16", "warning", "echo 1000 > "));
  std::filesystem::remove(machine_ / "dev/bus/usb/001/009");
  EXPECT_TRUE(says("001/009 is not there", "error", "plug"));
  put("sys/bus/usb/devices/1-1:1.0/bInterfaceClass", "03");
  options_.gige = false;
  EXPECT_TRUE(says("no USB3 Vision camera", "warning", "plug"));
}

TEST_F(MachineCheck, Video) {
  options_.video_node = machine_ / "dev/video7";
  EXPECT_TRUE(says("video7 is not there", "error", "plug"));
}

TEST_F(MachineCheck, Disk) {
  options_.bytes_per_second = 1e18;
  EXPECT_TRUE(says("about 0 minutes", "error", "delete or move"));
  options_.bytes_per_second = 1e5;
  {
    const InstanceLock other(options_.recordings);
    EXPECT_TRUE(says("a mirrorfieldd (process " + std::to_string(::getpid()) + ") is running", "warning", "stop"));
  }
  EXPECT_TRUE(says("no other mirrorfieldd", "ok", ""));
  options_.recordings = "/dev/shm";
  EXPECT_TRUE(says("tmpfs", "warning", "ext4"));
  options_.recordings = machine_ / "missing";
  EXPECT_TRUE(says("missing is no folder", "error", "make it"));
  options_.recordings = "/proc";  // where no file can be made
  const std::vector<Finding> findings = check_machine(options_);
  EXPECT_NE(findings.front().level, Level::ok) << finding_line(findings.front());
}

TEST_F(MachineCheck, ClockAndProcessor) {
  put("sys/devices/system/clocksource/clocksource0/current_clocksource", "hpet");
  EXPECT_TRUE(says("clock is hpet", "warning", "tsc"));
  options_.clock_is_set = [] { return false; };
  EXPECT_TRUE(says("clock is not set by the network", "warning", "timesyncd"));
  put("sys/devices/system/cpu/cpu1/cpufreq/scaling_governor", "powersave");
  EXPECT_TRUE(says("powersave (1), schedutil (1)", "warning", "schedutil | tee"));
  put("sys/devices/system/cpu/intel_pstate/status", "active");
  EXPECT_TRUE(says("powersave (1), schedutil (1)", "ok", ""));
  put("sys/class/thermal/thermal_zone1/temp", "91000");
  EXPECT_TRUE(says("the board has 91 degrees", "warning", "cool"));
}

TEST_F(MachineCheck, TemperatureIsTheHottestZonesOrNone) {
  put("sys/class/thermal/thermal_zone1/temp", "52500");
  put("sys/class/thermal/thermal_zone2/temp", "-274000");
  put("sys/class/thermal/cooling_device0/temp", "99000");
  EXPECT_EQ(board_temperature_c(options_.sys), 52.5);
  EXPECT_FALSE(board_temperature_c(machine_ / "nothing"));
}

TEST_F(MachineCheck, Config) {
  put("rig.toml", "[mirror]\ntarget = 'target.json'\n[recording]\nfolder = '/var/lib/mirrorfield'");
  EXPECT_EQ(check_config(machine_ / "rig.toml").level, Level::ok);
  put("rig.toml", "[mirrors]");
  const Finding bad = check_config(machine_ / "rig.toml");
  EXPECT_EQ(bad.level, Level::error);
  EXPECT_NE(bad.what.find("mirrors"), std::string::npos);
}

class ScriptedButton final : public Button {
 public:
  ScriptedButton(bool there, std::string why) : there_(there), why_(std::move(why)) {}
  [[nodiscard]] std::optional<ButtonEvent> poll(std::chrono::milliseconds) override { return std::nullopt; }
  void set_recording(bool) override {}
  [[nodiscard]] bool present() const override { return there_; }
  [[nodiscard]] std::string problem() const override { return why_; }

 private:
  bool there_;
  std::string why_;
};

TEST_F(MachineCheck, Button) {
  EXPECT_EQ(check_button(ScriptedButton(true, "")).level, Level::ok);
  EXPECT_EQ(check_button(ScriptedButton(false, "")).level, Level::warning);
  EXPECT_EQ(check_button(ScriptedButton(false, "cannot be opened")).level, Level::error);
}

// The one that it runs on: whatever it is like, it is told.
TEST(MachineCheckHere, ThisMachineIsDescribed) {
  const test::TemporaryFolder recordings;
  MachineCheckOptions options;
  options.gige = options.usb = true;
  options.camera_address = "127.0.0.1";
  options.recordings = recordings.path();
  for (const Finding& f : check_machine(options)) {
    EXPECT_FALSE(f.what.empty());
    EXPECT_EQ(f.remedy.empty(), f.level == Level::ok) << finding_line(f);
    std::cout << "  " << finding_line(f) << "\n";
  }
}

}  // namespace
}  // namespace mf
