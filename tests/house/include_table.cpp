// SPDX-License-Identifier: Apache-2.0
#include "tests/house/include_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <regex>
#include <sstream>

namespace mf::house {

namespace {

using Names = std::vector<std::string_view>;

Names operator+(Names a, const Names& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

// What the headers of common/ show to everyone.
const Names vocabulary{"Eigen", "fmt", "JSON", "TOML"};
// What any host stage may use. OpenCV is not among them: it is a baseline for tests.
const Names stage_libraries = vocabulary + Names{"TBB"};
// The plain structs that stages hand forward.
const Names records{"host/calibration/calibration.h", "host/light_field/light_field.h",
                    "host/light_field/direction_set.h", "host/light_field/light_tiles.h",
                    "host/light_field/emitter_light.h"};
const Names stage_headers = Names{"common/", "host/io/", "host/gl/", "host/blending/", "host/tracing/", "host/team/"};

bool starts_with_any(std::string_view text, const Names& beginnings) {
  return std::any_of(beginnings.begin(), beginnings.end(), [&](std::string_view b) { return text.starts_with(b); });
}

bool contains(const Names& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

// The C++ standard library has no dots in its names; of POSIX and Linux, these folders and these files.
bool is_system_header(std::string_view header) {
  static const Names posix{"sys/",     "netinet/",  "arpa/",    "net/",      "dlfcn.h", "malloc.h",
                           "unistd.h", "fcntl.h",   "poll.h",   "pthread.h", "netdb.h", "signal.h",
                           "dirent.h", "termios.h", "endian.h", "ifaddrs.h", "grp.h",   "spawn.h"};
  return header.find('.') == std::string_view::npos || starts_with_any(header, posix);
}

std::optional<std::string_view> library_of(std::string_view header) {
  for (const Library& library : known_libraries())
    if (starts_with_any(header, library.headers)) return library.name;
  return std::nullopt;
}

const FolderRule* rule_for(std::string_view file) {
  const FolderRule* best = nullptr;
  for (const FolderRule& rule : include_table())
    if (file.starts_with(rule.folder) && (best == nullptr || rule.folder.size() > best->folder.size())) best = &rule;
  return best;
}

// Why the rule forbids an include; empty when it doesn't.
std::string fault(const FolderRule& rule, std::string_view header, bool quoted) {
  if (quoted) {
    const bool own = header.starts_with(rule.folder);
    if (own || starts_with_any(header, rule.headers)) return {};
    return fmt::format("{} may not include it", rule.folder);
  }
  if (const auto library = library_of(header)) {
    if (contains(rule.libraries, *library)) return {};
    return fmt::format("{} may not use {}", rule.folder, *library);
  }
  return is_system_header(header) ? "" : "belongs to no library of the table: add it there and to docs/dependencies.md";
}

}  // namespace

const std::vector<Library>& known_libraries() {
  static const std::vector<Library> libraries{
      {"Eigen", {"Eigen/", "unsupported/Eigen/"}},
      {"fmt", {"fmt/"}},
      {"JSON", {"nlohmann/"}},
      {"TOML", {"toml++/", "toml.hpp"}},
      {"CLI11", {"CLI/"}},
      {"SQLite", {"sqlite3.h"}},
      {"TIFF", {"tiff.h", "tiffio.h", "tiffvers.h"}},
      {"ISA-L", {"isa-l"}},
      {"PNG", {"png.h"}},
      {"zlib", {"zlib.h"}},
      {"JPEG", {"jpeglib.h", "jerror.h"}},
      {"OpenEXR", {"OpenEXR/", "Imf", "Iex", "IlmThread"}},
      {"Imath", {"Imath/", "Imath", "half.h"}},
      {"AprilTag", {"apriltag/", "apriltag", "tag36h11.h"}},
      {"Ceres", {"ceres/", "glog/"}},
      {"OpenCV", {"opencv2/"}},
      {"Embree", {"embree3/", "embree4/"}},
      {"TBB", {"tbb/", "oneapi/tbb"}},
      {"assimp", {"assimp/"}},
      {"GL", {"epoxy/", "EGL/", "GLES", "GL/"}},
      {"GLFW", {"GLFW/"}},
      {"ImGui", {"imgui", "backends/imgui_impl"}},
      {"Aravis", {"arv.h", "aravis"}},
      {"V4L2", {"linux/videodev2.h", "linux/v4l2"}},
      {"libusb", {"libusb"}},
      {"usbfs", {"linux/usbdevice_fs.h"}},
      {"libevdev", {"libevdev/", "linux/input"}},
      {"libudev", {"libudev.h"}},
      {"systemd", {"systemd/"}},
      {"microhttpd", {"microhttpd.h"}},
      {"umockdev", {"umockdev.h"}},
      {"MPI", {"mpi.h"}},
      {"GoogleTest", {"gtest/", "gmock/"}},
      {"benchmark", {"benchmark/"}},
      {"SIMD", {"immintrin.h", "xmmintrin.h", "x86intrin.h", "pmmintrin.h"}},
  };
  return libraries;
}

const std::vector<FolderRule>& include_table() {
  static const std::vector<FolderRule> table{
      {"common/", {}, vocabulary + Names{"SQLite", "TIFF", "ISA-L", "AprilTag"}},
      {"common/command_line/", {}, Names{"fmt", "CLI11"}},
      {"device/", {"common/"}, vocabulary + Names{"Aravis", "V4L2", "libusb", "libevdev", "libudev", "systemd"}},
      // A program of its own: of the daemon it knows what crosses the socket, and its table of the config.
      {"device/status/",
       {"common/", "device/rig_status", "device/status_socket.h", "device/status_config.h", "device/owned_fd.h"},
       vocabulary + Names{"microhttpd"}},
      // The simulator writes the import format: frames as PNG, truth as EXR, tags as AprilTag draws them.
      {"hw-sim/",
       {"common/", "device/"},
       vocabulary + Names{"Embree", "AprilTag", "PNG", "OpenEXR", "Imath", "umockdev", "V4L2", "libevdev", "usbfs"}},
      {"host/io/", {"common/"}, stage_libraries + Names{"OpenEXR", "Imath", "PNG", "zlib", "JPEG", "TIFF", "assimp"}},
      {"host/team/", {"common/"}, Names{"MPI"}},
      {"host/import/", {"common/", "host/io/"}, stage_libraries},
      {"host/gl/", {"common/"}, stage_libraries + Names{"GL"}},
      {"host/photometry/", {"common/", "host/io/"}, stage_libraries + Names{"Ceres"}},
      {"host/calibration/", {"common/", "host/io/"}, stage_libraries + Names{"Ceres"}},
      {"host/blending/", {"common/"}, stage_libraries},
      {"host/tracing/", {"common/", "host/io/"}, stage_libraries + Names{"Embree"}},
      {"host/light_field/", stage_headers + Names{"host/calibration/calibration.h"},
       stage_libraries + Names{"OpenEXR", "Imath", "SIMD"}},
      {"host/render/", stage_headers + records, stage_libraries + Names{"GL", "Embree"}},
      // A composite is two renderings and a plate.
      {"host/composite/", stage_headers + records + Names{"host/render/"}, stage_libraries},
      {"host/lumigraph/", stage_headers + Names{"host/calibration/calibration.h"},
       stage_libraries + Names{"GL", "Embree"}},
      {"host/report/", stage_headers + records, stage_libraries},
      // It shows what two stages give, and lets a hand ask them for more.
      {"host/viewer/",
       stage_headers + records +
           Names{"host/light_field/probe.h", "host/light_field/surroundings.h", "host/lumigraph/"},
       stage_libraries + Names{"GL", "GLFW", "ImGui"}},
      {"host/cli/", {"common/", "host/"}, stage_libraries},
      {"tests/",
       {"common/", "device/", "host/", "hw-sim/"},
       stage_libraries + Names{"GoogleTest", "benchmark", "OpenCV",   "Ceres",  "SQLite",  "TIFF",    "PNG",
                               "OpenEXR",    "Imath",     "AprilTag", "Embree", "assimp",  "GL",      "Aravis",
                               "umockdev",   "V4L2",      "libevdev", "libusb", "libudev", "systemd", "microhttpd"}},
  };
  return table;
}

std::vector<std::string> check_includes(const std::filesystem::path& file, std::string_view source) {
  static const std::regex include_line(R"(^\s*#\s*include\s*([<"])([^>"]+)[>"])");
  const std::string name = file.generic_string();
  const FolderRule* rule = rule_for(name);
  if (rule == nullptr) return {fmt::format("{}: its folder has no row in the include table", name)};

  std::vector<std::string> faults;
  std::istringstream lines{std::string(source)};
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    std::smatch match;
    if (!std::regex_search(line, match, include_line)) continue;
    const std::string header = match[2];
    const std::string why = fault(*rule, header, match[1] == "\"");
    if (!why.empty()) faults.push_back(fmt::format("{}:{}: includes {}: {}", name, number, header, why));
  }
  return faults;
}

}  // namespace mf::house
