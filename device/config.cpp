// SPDX-License-Identifier: Apache-2.0
#include "device/config.h"

#include <string>

#include "device/config_table.h"

namespace mf {

namespace {

namespace fs = std::filesystem;

CameraSettings camera_settings(ConfigTable table) {
  CameraSettings s;
  s.address = table.text("address").value_or("");
  s.pixel_format = table.text("pixel_format");
  s.region_px = table.region("region_px");
  s.exposure_s = table.number("exposure_s", 1e-7, 60);
  s.gain_db = table.number("gain_db", -20, 80);
  s.frame_rate_hz = table.number("frame_rate_hz", 0.01, 10000);
  s.packet_bytes = table.integer("packet_bytes", 576, 16000).value_or(s.packet_bytes);
  s.socket_buffer_bytes = table.integer("socket_buffer_bytes", 65536, 1 << 30).value_or(s.socket_buffer_bytes);
  table.refuse_unknown_keys();
  return s;
}

}  // namespace

DeviceConfig read_device_config(const fs::path& file) {
  const toml::table root = read_config_file(file);
  DeviceConfig config;
  config.camera = camera_settings(ConfigTable(root, "camera", file.string()));
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
  config.status = read_status_config(ConfigTable(root, "status", file.string()));
  return config;
}

}  // namespace mf
