// SPDX-License-Identifier: Apache-2.0
#include "device/machine_check.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/timex.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <map>
#include <sstream>

#include "common/error.h"
#include "device/board.h"
#include "device/c_handle.h"
#include "device/clock.h"
#include "device/config.h"
#include "device/instance_lock.h"
#include "device/owned_fd.h"

namespace mf {

namespace {

namespace fs = std::filesystem;

using Level = Finding::Level;

constexpr double megabyte = 1e6;
constexpr int usbfs_megabytes = 256;  // some frames of 12 MB in both directions; the kernel's own 16 are too few

Finding ok(std::string what) {
  return {std::move(what), Level::ok, ""};
}
Finding warning(std::string what, std::string remedy) {
  return {std::move(what), Level::warning, std::move(remedy)};
}
Finding failing(std::string what, std::string remedy) {
  return {std::move(what), Level::error, std::move(remedy)};
}

std::optional<std::string> first_word(const fs::path& file) {
  std::ifstream in(file);
  std::string word;
  return in >> word ? std::optional(word) : std::nullopt;
}

std::optional<std::int64_t> number_in(const fs::path& file) {
  std::ifstream in(file);
  std::int64_t value = 0;
  return in >> value ? std::optional(value) : std::nullopt;
}

Finding receive_buffer(const MachineCheckOptions& o) {
  const auto most = number_in(o.proc / "sys/net/core/rmem_max");
  if (!most) return warning("net.core.rmem_max is not readable", "see that /proc is mounted");
  const std::string what =
      fmt::format("net.core.rmem_max is {}, camera.socket_buffer_bytes asks for {}", *most, o.socket_buffer_bytes);
  if (*most >= o.socket_buffer_bytes) return ok(what);
  return warning(what, fmt::format("sysctl -w net.core.rmem_max={}, and for good in /etc/sysctl.d/60-mirrorfield.conf",
                                   o.socket_buffer_bytes));
}

// ---- the way to a GigE camera -----------------------------------------------------------------------------------

std::optional<std::uint32_t> ipv4(const std::string& address) {
  std::istringstream in(address);
  std::uint32_t value = 0;
  for (int i = 0; i < 4; ++i) {
    int part = 0;
    if (i > 0 && in.get() != '.') return std::nullopt;
    if (!(in >> part) || part < 0 || part > 255) return std::nullopt;
    value = value << 8 | static_cast<std::uint32_t>(part);
  }
  return in.peek() == std::istringstream::traits_type::eof() ? std::optional(value) : std::nullopt;
}

std::uint32_t reversed(std::uint32_t v) {
  return v >> 24 | (v >> 8 & 0xff00U) | (v << 8 & 0xff0000U) | v << 24;
}

// The interface that packets to `address` leave by: the row of /proc/net/route with the longest mask that fits, whose
// numbers are hexadecimal in network order as a little-endian machine reads them.
std::string interface_towards(const MachineCheckOptions& o, std::uint32_t address) {
  if (address >> 24 == 127) return "lo";
  std::ifstream in(o.proc / "net/route");
  std::string line, best;
  std::int64_t best_mask = -1;
  std::getline(in, line);  // headings
  while (std::getline(in, line)) {
    std::istringstream fields(line);
    std::string name, skipped;
    std::uint32_t destination = 0, mask = 0;
    fields >> name >> std::hex >> destination;
    for (int i = 0; i < 5; ++i) fields >> skipped;
    if (!(fields >> mask)) continue;
    if ((address & reversed(mask)) != reversed(destination) || reversed(mask) <= best_mask) continue;
    best_mask = reversed(mask);
    best = name;
  }
  return best;
}

Finding packet_size(const MachineCheckOptions& o) {
  const auto address = ipv4(o.camera_address);
  if (!address) return ok(fmt::format("packets of {} bytes: the camera's network is not known yet", o.packet_bytes));
  const std::string name = interface_towards(o, *address);
  if (name.empty())
    return failing("no network reaches " + o.camera_address, "give an interface an address of the camera's network");
  const auto mtu = number_in(o.sys / "class/net" / name / "mtu");
  const std::string what =
      fmt::format("camera.packet_bytes is {}, {} passes {}", o.packet_bytes, name, mtu.value_or(0));
  if (mtu && *mtu >= o.packet_bytes) return ok(what);
  return failing(what, fmt::format("ip link set {} mtu {}, or a smaller packet_bytes", name, o.packet_bytes));
}

// ---- USB, and device nodes --------------------------------------------------------------------------------------

Finding usb_memory(const MachineCheckOptions& o) {
  const auto megabytes = number_in(o.sys / "module/usbcore/parameters/usbfs_memory_mb");
  if (!megabytes)
    return warning("usbfs_memory_mb is not there: this kernel has no USB", "use another camera or kernel");
  const std::string what = fmt::format("usbfs_memory_mb is {}", *megabytes);
  if (*megabytes == 0 || *megabytes >= usbfs_megabytes) return ok(what);  // 0: no limit
  return warning(what, fmt::format("echo 1000 > {}, and for good usbcore.usbfs_memory_mb=1000 on the kernel's line",
                                   (o.sys / "module/usbcore/parameters/usbfs_memory_mb").string()));
}

Finding node_access(const fs::path& node, const std::string& remedy) {
  if (!fs::exists(node)) return failing(node.string() + " is not there", "plug the camera in, or mend the config");
  if (::access(node.c_str(), R_OK | W_OK) == 0) return ok(node.string() + " can be read and written");
  return failing(node.string() + " may not be read and written", remedy);
}

// USB3 Vision devices by the class of their interfaces.
void usb_cameras(const MachineCheckOptions& o, std::vector<Finding>& findings) {
  std::error_code ignored;
  int found = 0;
  for (const auto& entry : fs::directory_iterator(o.sys / "bus/usb/devices", ignored)) {
    const fs::path& interface = entry.path();
    if (first_word(interface / "bInterfaceClass") != "ef" || first_word(interface / "bInterfaceSubClass") != "05")
      continue;
    const std::string name = interface.filename();
    const fs::path device = interface.parent_path() / name.substr(0, name.find(':'));
    const auto bus = number_in(device / "busnum"), number = number_in(device / "devnum");
    if (!bus || !number) continue;
    const fs::path node = o.dev / fmt::format("bus/usb/{:03}/{:03}", *bus, *number);
    if (std::any_of(findings.begin(), findings.end(),
                    [&](const Finding& f) { return f.what.starts_with(node.string()); }))
      continue;  // a camera has several such interfaces
    findings.push_back(node_access(node, "install udev/60-mirrorfield.rules and join the group mirrorfield"));
    ++found;
  }
  if (found == 0 && !o.gige) findings.push_back(warning("no USB3 Vision camera is plugged in", "plug it in"));
}

// ---- the disk ---------------------------------------------------------------------------------------------------

// Where a frame that was called durable would not be, or one cannot be named (statfs(2)).
std::optional<std::string> unfit_file_system(std::int64_t type) {
  static const std::map<std::int64_t, std::string> unfit{{0x01021994, "tmpfs, which is lost with the power"},
                                                         {0x858458f6, "ramfs, which is lost with the power"},
                                                         {0x4d44, "FAT, which has no journal"},
                                                         {0x2011bab0, "exFAT, which has no journal"},
                                                         {0x6969, "NFS, which waits for a network"},
                                                         {0xff534d42, "CIFS, which waits for a network"}};
  const auto found = unfit.find(type);
  return found == unfit.end() ? std::nullopt : std::optional(found->second);
}

Finding file_system(const fs::path& folder) {
  struct statfs s {};
  if (::statfs(folder.c_str(), &s) != 0) return warning("the recordings' file system is not known", "see df -T");
  if (const auto why = unfit_file_system(static_cast<std::int64_t>(s.f_type) & 0xffffffff))
    return warning(fmt::format("{} is on {}", folder.string(), *why), "record to ext4 or xfs");
  return ok(folder.string() + " is on a file system that keeps what is synced");
}

Finding free_space(const MachineCheckOptions& o) {
  const std::int64_t left = free_bytes(o.recordings).value_or(0);
  const double minutes = static_cast<double>(left) / o.bytes_per_second / 60;
  const std::string what = fmt::format("{:.1f} GB are free in {}: about {:.0f} minutes",
                                       static_cast<double>(left) / 1e9, o.recordings.string(), minutes);
  if (minutes < 1) return failing(what, "delete or move sessions");
  return minutes < 10 ? warning(what, "delete or move sessions") : ok(what);
}

// Eight times what a quarter of a second records, made durable: how long the slowest took.
Finding durable_speed(const MachineCheckOptions& o) {
  constexpr int times = 8;
  const OwnedFd file(::open(o.recordings.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600));
  if (file.get() < 0 && errno != EOPNOTSUPP)
    return failing(fmt::format("{} may not be written: {}", o.recordings.string(), std::strerror(errno)),
                   "give it to the daemon's user: chown -R mirrorfield");
  if (file.get() < 0) return warning("the disk's speed cannot be measured without leaving a file", "record a test");
  const std::string block(static_cast<std::size_t>(std::min(o.bytes_per_second / 4, 16 * megabyte)), '\x5a');
  std::int64_t slowest_ns = 0;
  for (int i = 0; i < times; ++i) {
    const std::int64_t began = clock_ns(CLOCK_MONOTONIC);
    if (::pwrite(file.get(), block.data(), block.size(), 0) != static_cast<ssize_t>(block.size()) ||
        ::fdatasync(file.get()) != 0)
      return failing(fmt::format("{}: writing fails: {}", o.recordings.string(), std::strerror(errno)),
                     "make room, or look at the disk (dmesg)");
    slowest_ns = std::max(slowest_ns, clock_ns(CLOCK_MONOTONIC) - began);
  }
  const double ms = static_cast<double>(slowest_ns) / 1e6;
  const std::string what =
      fmt::format("{:.1f} MB become durable within {:.0f} ms", static_cast<double>(block.size()) / megabyte, ms);
  return ms < 250 ? ok(what) : warning(what, "a recording needs them within 250 ms: use a faster disk");
}

void disk(const MachineCheckOptions& o, std::vector<Finding>& findings) {
  if (!fs::is_directory(o.recordings)) {
    findings.push_back(failing(o.recordings.string() + " is no folder", "make it, or mend recording.folder"));
    return;
  }
  findings.push_back(durable_speed(o));
  findings.push_back(file_system(o.recordings));
  findings.push_back(free_space(o));
  if (const auto holder = instance_lock_holder(o.recordings))
    findings.push_back(warning(fmt::format("a mirrorfieldd (process {}) is running", *holder),
                               "stop it before another is started: systemctl stop mirrorfieldd"));
  else
    findings.push_back(ok("no other mirrorfieldd records there"));
}

// ---- clock and processor ----------------------------------------------------------------------------------------

bool kernel_clock_is_set() {
  timex t{};
  return ::adjtimex(&t) != TIME_ERROR && (t.status & STA_UNSYNC) == 0;
}

Finding clock_source(const MachineCheckOptions& o) {
  const std::string name =
      first_word(o.sys / "devices/system/clocksource/clocksource0/current_clocksource").value_or("unknown");
  static const std::array slow{"hpet", "acpi_pm", "jiffies", "refined-jiffies", "pit"};
  const std::string what = "the kernel's clock is " + name;
  if (std::find(slow.begin(), slow.end(), name) == slow.end()) return ok(what);
  return warning(what, "it is slow to read and coarse: choose tsc in the firmware or with clocksource=");
}

Finding clock_set(const MachineCheckOptions& o) {
  if (o.clock_is_set ? o.clock_is_set() : kernel_clock_is_set()) return ok("the clock is set by the network");
  return warning("the clock is not set by the network: sessions may bear a wrong date",
                 "connect once, or run systemd-timesyncd or chrony");
}

Finding governor(const MachineCheckOptions& o) {
  std::error_code ignored;
  std::map<std::string, int> governors;
  for (const auto& cpu : fs::directory_iterator(o.sys / "devices/system/cpu", ignored))
    if (const auto name = first_word(cpu.path() / "cpufreq/scaling_governor")) ++governors[*name];
  if (governors.empty()) return ok("the processor's frequency is not Linux's to set");
  std::string list;
  for (const auto& [name, count] : governors) list += fmt::format("{}{} ({})", list.empty() ? "" : ", ", name, count);
  const std::string what = "the processor's governor is " + list;
  // Intel's powersave scales on demand; anybody else's stays at the lowest frequency.
  const bool intel = first_word(o.sys / "devices/system/cpu/intel_pstate/status") == "active";
  if (!governors.contains("powersave") || intel) return ok(what);
  return warning(what, "echo schedutil | tee /sys/devices/system/cpu/cpu*/cpufreq/scaling_governor");
}

Finding temperature(const MachineCheckOptions& o) {
  const auto celsius = board_temperature_c(o.sys);
  if (!celsius) return ok("the board's temperature is not known");
  const std::string what = fmt::format("the board has {:.0f} degrees Celsius", *celsius);
  return *celsius < 80 ? ok(what) : warning(what, "let it cool down, or it slows down while recording");
}

}  // namespace

std::vector<Finding> check_machine(const MachineCheckOptions& o) {
  std::vector<Finding> findings;
  disk(o, findings);
  if (o.gige) {
    findings.push_back(receive_buffer(o));
    findings.push_back(packet_size(o));
  }
  if (o.usb) {
    findings.push_back(usb_memory(o));
    usb_cameras(o, findings);
  }
  if (!o.video_node.empty())
    findings.push_back(node_access(o.video_node, "join the group video, or run it as the user mirrorfield"));
  findings.push_back(clock_source(o));
  findings.push_back(clock_set(o));
  findings.push_back(governor(o));
  findings.push_back(temperature(o));
  return findings;
}

Finding check_config(const fs::path& config) {
  try {
    (void)read_device_config(config);
    return ok(config.string() + " is read");
  } catch (const InputError& e) {
    return failing(e.what(), "mend the config: man mirrorfieldd.toml");
  }
}

Finding check_button(const Button& button) {
  if (!button.problem().empty()) return failing(button.problem(), "until then recordings start without a button only");
  if (button.present()) return ok("the start button is there");
  return warning("no start button is plugged in", "plug it in, or see [button] in the config");
}

std::string finding_line(const Finding& f) {
  static constexpr std::array names{"ok", "warning", "error"};
  const std::string line = fmt::format("{}: {}", names[static_cast<std::size_t>(f.level)], f.what);
  return f.remedy.empty() ? line : line + ": " + f.remedy;
}

}  // namespace mf
