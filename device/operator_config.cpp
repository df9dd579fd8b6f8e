// SPDX-License-Identifier: Apache-2.0
#include "device/operator_config.h"

#include "common/error.h"

namespace mf {

namespace {

ButtonTiming read_timing(ConfigTable& table) {
  ButtonTiming timing;
  if (const auto ms = table.integer("debounce_ms", 1, 1000)) timing.debounce = std::chrono::milliseconds(*ms);
  if (const auto ms = table.integer("hold_ms", 2, 10000)) timing.hold = std::chrono::milliseconds(*ms);
  if (const std::string fault = timing.problem(); !fault.empty()) table.fail("hold_ms", fault);
  return timing;
}

StartButtonOptions read_button(ConfigTable table) {
  StartButtonOptions o;
  o.udev_tag = table.text("tag").value_or(o.udev_tag);
  o.key = table.text("key").value_or(o.key);
  o.timing = read_timing(table);
  table.refuse_unknown_keys();
  return o;
}

HidLampOptions read_hid_lamp(ConfigTable& table, const std::vector<double>& report) {
  HidLampOptions lamp;
  for (const double byte : report) lamp.report.push_back(static_cast<std::uint8_t>(byte));
  lamp.byte = table.integer("lamp_byte", 0, 1023).value_or(lamp.byte);
  lamp.mask = table.integer("lamp_mask", 1, 255).value_or(lamp.mask);
  lamp.endpoint = table.integer("lamp_endpoint", 0, 15).value_or(lamp.endpoint);
  lamp.report_id = table.integer("lamp_report_id", 1, 255);
  return lamp;
}

HidButtonOptions read_hid_button(ConfigTable table) {
  HidButtonOptions o;
  o.vendor_id = table.integer("vendor", 0, 65535).value_or(0);
  o.product_id = table.integer("product", 0, 65535).value_or(0);
  o.interface_number = table.integer("interface", 0, 255).value_or(o.interface_number);
  o.endpoint = table.integer("endpoint", 0x81, 0x8f).value_or(o.endpoint);
  o.report_bytes = table.integer("report_bytes", 1, 1024).value_or(o.report_bytes);
  o.report_id = table.integer("report_id", 1, 255);
  o.button_byte = table.integer("button_byte", 0, 1023).value_or(o.button_byte);
  o.button_mask = table.integer("button_mask", 1, 255).value_or(o.button_mask);
  o.pressed_when_clear = table.flag("pressed_when_clear").value_or(o.pressed_when_clear);
  if (const auto report = table.numbers("lamp_report", 0, 255)) o.lamp = read_hid_lamp(table, *report);
  o.timing = read_timing(table);
  table.refuse_unknown_keys();
  if (const std::string fault = o.problem(); !fault.empty()) table.fail("vendor", fault);
  return o;
}

}  // namespace

OperatorConfig read_operator_config(const toml::table& root, const std::string& file) {
  OperatorConfig config;
  if (root.contains("button") && root.contains("hid_button"))
    throw InputError(file, "hid_button", "stands beside [button]: the rig has one button, remove one of the tables");
  if (root.contains("button")) config.button = read_button(ConfigTable(root, "button", file));
  if (root.contains("hid_button")) config.hid_button = read_hid_button(ConfigTable(root, "hid_button", file));
  ConfigTable lamp(root, "lamp", file);
  config.led = lamp.text("led").value_or("");
  lamp.refuse_unknown_keys();
  return config;
}

}  // namespace mf
