// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <linux/videodev2.h>

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "device/camera_features.h"
#include "device/v4l2_device.h"

namespace mf {

// A V4L2 device's controls by the names that v4l2-ctl shows (wide_dynamic_range, hdr_sensor_mode), whatever this
// machine's headers know of them. Enumerations are menus. A control that is there but inactive just now is had not.
// Values are in the driver's own steps.
class V4l2Controls final : public FeatureAccess {
 public:
  explicit V4l2Controls(const V4l2Device&);  // which must outlive it

  [[nodiscard]] bool has(const std::string& feature) const override;
  [[nodiscard]] double number(const std::string& feature) const override;
  void set_number(const std::string& feature, double value) override;
  [[nodiscard]] std::string choice(const std::string& feature) const override;
  void set_choice(const std::string& feature, const std::string& entry) override;

  // By id. Nothing when the camera has no such control.
  [[nodiscard]] std::optional<std::string> name_of(std::uint32_t id) const;
  [[nodiscard]] std::optional<std::int64_t> value(std::uint32_t id) const;
  // As the driver says it now: range, step, flags.
  [[nodiscard]] std::optional<v4l2_query_ext_ctrl> description(std::uint32_t id) const;

 private:
  [[nodiscard]] v4l2_query_ext_ctrl demand(const std::string& feature) const;
  [[nodiscard]] std::int64_t read(const v4l2_query_ext_ctrl&, const std::string& feature) const;
  void write(const v4l2_query_ext_ctrl&, const std::string& feature, std::int64_t value) const;
  [[nodiscard]] std::optional<std::string> entry(const v4l2_query_ext_ctrl&, std::int64_t index) const;

  const V4l2Device* device_;
  std::map<std::string, std::uint32_t> ids_;
};

// "White Balance, Auto" → "white_balance_auto".
[[nodiscard]] std::string v4l2_control_name(const std::string& title);

}  // namespace mf
