// SPDX-License-Identifier: Apache-2.0
#include "device/camera_config.h"

namespace mf {

namespace {

MultiSlopeSensor read_multi_slope(ConfigTable& table) {
  MultiSlopeSensor sensor;
  const std::vector<double> times = table.numbers("knee_times", 0, 1).value_or(std::vector<double>{});
  const std::vector<double> levels = table.numbers("knee_levels", 0, 1).value_or(std::vector<double>{});
  if (times.size() != levels.size()) table.fail("knee_levels", "must have as many numbers as knee_times");
  for (std::size_t i = 0; i < times.size(); ++i) sensor.knees.push_back({times[i], levels[i]});
  return sensor;
}

LinLogSensor read_lin_log(ConfigTable& table) {
  LinLogSensor sensor;
  sensor.value_1 = table.number("value_1", 0, 1).value_or(sensor.value_1);
  sensor.value_2 = table.number("value_2", 0, 1).value_or(sensor.value_1);
  sensor.time_1 = table.number("time_1", 0, 1).value_or(sensor.time_1);
  sensor.time_2 = table.number("time_2", 0, 1).value_or(sensor.time_2);
  return sensor;
}

}  // namespace

CameraSettings read_camera_config(ConfigTable table) {
  CameraSettings s;
  s.address = table.text("address").value_or("");
  s.pixel_format = table.text("pixel_format");
  s.region_px = table.region("region_px");
  s.exposure_s = table.number("exposure_s", 1e-7, 60);
  s.gain_db = table.number("gain_db", -20, 80);
  s.gain_step_db = table.number("gain_step_db", 1e-6, 20);
  s.frame_rate_hz = table.number("frame_rate_hz", 0.01, 10000);
  s.ptp = table.flag("ptp");
  s.packet_bytes = table.integer("packet_bytes", 576, 16000).value_or(s.packet_bytes);
  s.socket_buffer_bytes = table.integer("socket_buffer_bytes", 65536, 1 << 30).value_or(s.socket_buffer_bytes);
  table.refuse_unknown_keys();
  return s;
}

std::optional<ResponseRequest> read_response_config(ConfigTable table) {
  const std::optional<std::string> kind = table.text("kind");
  std::optional<ResponseRequest> request;
  if (kind == "linear") request = LinearSensor{};
  if (kind == "multi_slope") request = read_multi_slope(table);
  if (kind == "lin_log") request = read_lin_log(table);
  if (kind == "wide_dynamic_range") request = WideDynamicRange{};
  if (kind && !request) table.fail("kind", "must be linear, multi_slope, lin_log or wide_dynamic_range");
  table.refuse_unknown_keys();
  if (const auto* slopes = request ? std::get_if<MultiSlopeSensor>(&*request) : nullptr)
    if (const std::string fault = fault_of(*slopes); !fault.empty()) table.fail("knee_times", fault);
  if (const auto* pixel = request ? std::get_if<LinLogSensor>(&*request) : nullptr)
    if (const std::string fault = fault_of(*pixel); !fault.empty()) table.fail("time_1", fault);
  return request;
}

}  // namespace mf
