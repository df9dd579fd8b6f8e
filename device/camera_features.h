// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace mf {

// A camera's own settings by name: GenICam features (Aravis), or V4L2 controls, named as v4l2-ctl names them
// (wide_dynamic_range). Everything but has() throws InputError naming the camera and the feature.
class FeatureAccess {
 public:
  FeatureAccess() = default;
  FeatureAccess(const FeatureAccess&) = delete;
  FeatureAccess& operator=(const FeatureAccess&) = delete;
  virtual ~FeatureAccess() = default;

  // Whether the camera has it, and has it switched on now.
  [[nodiscard]] virtual bool has(const std::string& feature) const = 0;
  // Integers, floats and booleans (0, 1).
  [[nodiscard]] virtual double number(const std::string& feature) const = 0;
  virtual void set_number(const std::string& feature, double value) = 0;
  // Enumerations (menus), by the entry's name.
  [[nodiscard]] virtual std::string choice(const std::string& feature) const = 0;
  virtual void set_choice(const std::string& feature, const std::string& entry) = 0;
};

// A feature as it was read back after writing.
struct FeatureReading {
  std::string feature;
  std::string value;
};

}  // namespace mf
