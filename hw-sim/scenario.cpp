// SPDX-License-Identifier: Apache-2.0
#include "hw-sim/scenario.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <sstream>
#include <utility>

#include "common/error.h"
#include "device/config_table.h"
#include "hw-sim/desk_rig.h"

namespace mf::sim {

namespace {

using namespace std::string_view_literals;

constexpr std::array fault_names{std::pair{"packet_loss"sv, FaultKind::packet_loss},
                                 std::pair{"camera_death"sv, FaultKind::camera_death},
                                 std::pair{"skipped"sv, FaultKind::skipped},
                                 std::pair{"jitter"sv, FaultKind::jitter},
                                 std::pair{"slow_disk"sv, FaultKind::slow_disk},
                                 std::pair{"full_disk"sv, FaultKind::full_disk},
                                 std::pair{"io_error"sv, FaultKind::io_error},
                                 std::pair{"knock"sv, FaultKind::knock},
                                 std::pair{"replug"sv, FaultKind::replug}};

toml::table parse_scenario(const std::filesystem::path& file) {
  try {
    return toml::parse_file(file.string());
  } catch (const toml::parse_error& e) {
    throw InputError(file.string(), fmt::format("line {}", e.source().begin.line), std::string(e.description()));
  }
}

void read_take(ConfigTable table, Scenario& s) {
  s.take.frames = table.integer("frames", 10, 99999).value_or(s.take.frames);
  s.take.samples = table.integer("samples", 1, 10000).value_or(s.take.samples);
  s.take.scene_samples = table.integer("scene_samples", 1, 100000).value_or(s.take.scene_samples);
  s.take.blur = table.number("blur", 0, 1).value_or(s.take.blur);
  s.take.seed = static_cast<std::uint64_t>(table.integer("seed", 0, 1 << 30).value_or(1));
  s.panorama = table.path("panorama").value_or("");
  s.lead_s = table.number("lead_s", 0.5, 60).value_or(s.lead_s);
  s.tail_s = table.number("tail_s", 0, 60).value_or(s.tail_s);
  table.refuse_unknown_keys();
}

void read_camera(ConfigTable table, Scenario& s) {
  s.address = table.text("address").value_or(s.address);
  s.size_px = table.integer("size_px", 128, 2048).value_or(s.size_px);
  if (s.size_px % 2 != 0) table.fail("size_px", "must be even");
  s.frame_rate_hz = table.number("frame_rate_hz", 0.1, 1000).value_or(s.frame_rate_hz);
  s.exposure_s = table.number("exposure_s", 1e-6, 1).value_or(s.exposure_s);
  s.packet_loss = table.number("packet_loss", 0, 0.5).value_or(s.packet_loss);
  s.clock_ppm = table.number("clock_ppm", -1000, 1000).value_or(s.clock_ppm);
  s.pixel_format = table.text("pixel_format").value_or(s.pixel_format);
  const std::optional<WireFormat> format = wire_format(s.pixel_format);
  if (!format) table.fail("pixel_format", s.pixel_format + " is none that a camera of ours sends");
  s.sensor.format = format->format;
  table.refuse_unknown_keys();
}

void read_sensor(ConfigTable table, Scenario& s) {
  SensorTraits& sensor = s.sensor;
  sensor.black_level = table.number("black_level", 0, 1000).value_or(sensor.black_level);
  sensor.full_exposure = table.number("full_exposure", 1e-6, 1e6).value_or(0.015);
  sensor.full_electrons = table.number("full_electrons", 10, 1e9).value_or(sensor.full_electrons);
  sensor.read_noise_codes = table.number("read_noise_codes", 0, 1000).value_or(sensor.read_noise_codes);
  const double falloff = table.number("vignetting", 0, 0.9).value_or(0);
  sensor.vignetting.centre_px = Eigen::Vector2d::Constant(0.5 * s.size_px);
  sensor.vignetting.radius_px = 0.5 * std::sqrt(2.0) * s.size_px;
  sensor.vignetting.coefficients = {-falloff, 0, 0};
  table.refuse_unknown_keys();
}

Fault read_fault(ConfigTable table) {
  Fault fault;
  const std::string kind = table.text("kind").value_or("");
  const auto* found =
      std::find_if(fault_names.begin(), fault_names.end(), [&](const auto& f) { return f.first == kind; });
  if (found == fault_names.end()) {
    std::string names;
    for (const auto& [name, value] : fault_names) names += fmt::format("{}{}", names.empty() ? "" : ", ", name);
    table.fail("kind", "must be one of " + names);
  }
  fault.kind = found->second;
  fault.at_s = table.number("at_s", 0, 1e6).value_or(0);
  fault.seconds = table.number("seconds", 0, 1e6).value_or(0);
  fault.amount = table.number("amount", 0, 1e6).value_or(0);
  table.refuse_unknown_keys();
  return fault;
}

void read_faults(const toml::table& root, const std::string& file, Scenario& s) {
  if (!root.contains("fault")) return;
  const toml::array* list = root["fault"].as_array();
  if (list == nullptr) throw InputError(file, "fault", "must be [[fault]], once for each");
  for (const toml::node& node : *list) {
    if (node.as_table() == nullptr) throw InputError(file, "fault", "must be [[fault]], once for each");
    toml::table wrapped;  // a table of the name that messages shall have
    wrapped.insert("fault", *node.as_table());
    s.faults.push_back(read_fault(ConfigTable(wrapped, "fault", file)));
  }
  std::stable_sort(s.faults.begin(), s.faults.end(), [](const Fault& a, const Fault& b) { return a.at_s < b.at_s; });
}

}  // namespace

std::string_view fault_name(FaultKind kind) {
  return std::find_if(fault_names.begin(), fault_names.end(), [&](const auto& f) { return f.second == kind; })->first;
}

Scenario read_scenario(const std::filesystem::path& file) {
  const toml::table root = parse_scenario(file);
  for (const auto& [key, value] : root)
    if (const std::string_view name = key.str();
        name != "take" && name != "camera" && name != "sensor" && name != "fault" && name != "rig")
      throw InputError(file.string(), std::string(name),
                       "is no table of a scenario: it has take, camera, sensor, rig, fault");
  Scenario scenario;
  read_take(ConfigTable(root, "take", file.string()), scenario);
  read_camera(ConfigTable(root, "camera", file.string()), scenario);
  read_sensor(ConfigTable(root, "sensor", file.string()), scenario);
  read_faults(root, file.string(), scenario);
  if (root.contains("rig")) {
    if (root["rig"].as_table() == nullptr)
      throw InputError(file.string(), "rig", "must be tables of the daemon's config");
    std::ostringstream text;
    text << *root["rig"].as_table();
    scenario.rig_config = text.str();
  }
  return scenario;
}

}  // namespace mf::sim
