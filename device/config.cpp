// SPDX-License-Identifier: Apache-2.0
#include "device/config.h"

#include <string>

#include "device/camera_config.h"
#include "device/config_table.h"

namespace mf {

namespace {

namespace fs = std::filesystem;

MeteringOptions metering_options(ConfigTable& table) {
  MeteringOptions m;
  m.least_exposure_s = table.number("least_exposure_s", 1e-7, 60).value_or(m.least_exposure_s);
  m.most_exposure_s = table.number("most_exposure_s", 1e-7, 60).value_or(m.most_exposure_s);
  m.clipped_share = table.number("clipped_share", 1e-9, 0.5).value_or(m.clipped_share);
  m.headroom = table.number("headroom", 1, 100).value_or(m.headroom);
  m.change_response = table.flag("change_response").value_or(m.change_response);
  return m;
}

std::optional<MeteringOptions> read_metering_config(ConfigTable table, double black_level) {
  const bool wanted = table.flag("on").value_or(true);
  MeteringOptions m = metering_options(table);
  m.black_level = black_level;
  table.refuse_unknown_keys();
  if (const std::string fault = m.validate(); !fault.empty()) table.fail("most_exposure_s", fault);
  return wanted ? std::optional(m) : std::nullopt;
}

std::optional<LookoutOptions> read_detection_config(ConfigTable table) {
  const bool wanted = table.flag("on").value_or(true);
  LookoutOptions o;
  o.detection.duty = table.number("duty", 0.01, 1).value_or(o.detection.duty);
  o.detection.detector.quad_decimate = table.number("quad_decimate", 1, 8).value_or(o.detection.detector.quad_decimate);
  if (const auto calibration = table.path("calibration")) o.seeing.camera = read_camera_model(*calibration);
  table.refuse_unknown_keys();
  return wanted ? std::optional(o) : std::nullopt;
}

std::optional<LightPlane> read_plane_config(ConfigTable table) {
  const auto centre = table.numbers("centre_m", -100, 100);
  const auto size = table.numbers("size_m", 1e-3, 100);
  table.refuse_unknown_keys();
  if (!centre && !size) return std::nullopt;
  if (!centre || centre->size() != 2) table.fail("centre_m", "must be [x, y], in the world");
  if (!size || size->size() != 2) table.fail("size_m", "must be [width, height]");
  return LightPlane{{(*centre)[0], (*centre)[1]}, {(*size)[0], (*size)[1]}};
}

}  // namespace

DeviceConfig read_device_config(const fs::path& file) {
  const toml::table root = read_config_file(file);
  DeviceConfig config;
  config.camera = read_camera_config(ConfigTable(root, "camera", file.string()));
  config.camera.response = read_response_config(ConfigTable(root, "response", file.string()));
  ConfigTable mirror(root, "mirror", file.string());
  config.target = mirror.needed_path("target");
  config.world = mirror.path("world");
  config.mirror_reflectance = mirror.number("reflectance", 0.01, 1).value_or(config.mirror_reflectance);
  mirror.refuse_unknown_keys();
  ConfigTable recording(root, "recording", file.string());
  config.recordings = recording.needed_path("folder");
  config.black_level_hint = recording.number("black_level_hint", 0, 65535).value_or(config.black_level_hint);
  config.recorder.queue_frames = recording.integer("queue_frames", 2, 10000).value_or(config.recorder.queue_frames);
  recording.refuse_unknown_keys();
  config.metering = read_metering_config(ConfigTable(root, "metering", file.string()), config.black_level_hint);
  config.lookout = read_detection_config(ConfigTable(root, "detection", file.string()));
  const std::optional<LightPlane> plane = read_plane_config(ConfigTable(root, "plane", file.string()));
  if (config.lookout) config.lookout->seeing.plane = plane;
  config.operating = read_operator_config(root, file.string());
  config.status = read_status_config(ConfigTable(root, "status", file.string()));
  return config;
}

MachineCheckOptions machine_check_options(const DeviceConfig& config) {
  const std::string& address = config.camera.address;
  MachineCheckOptions o;
  if (address.starts_with("/dev/"))
    o.video_node = address;
  else
    o.gige = true;
  o.usb = address.empty();
  if (!address.empty() && address.find_first_not_of("0123456789.") == std::string::npos) o.camera_address = address;
  o.packet_bytes = config.camera.packet_bytes;
  o.socket_buffer_bytes = config.camera.socket_buffer_bytes;
  o.recordings = config.recordings;
  return o;
}

}  // namespace mf
