// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "device/camera_features.h"

typedef struct _ArvDevice ArvDevice;  // NOLINT(bugprone-reserved-identifier,modernize-use-using): Aravis' own name

namespace mf {

// GenICam features by name, through Aravis. Writing any number to a command executes it.
class AravisFeatures final : public FeatureAccess {
 public:
  // The device stays the caller's and must outlive this. `camera` names it in errors.
  AravisFeatures(std::string camera, ArvDevice* device) : camera_(std::move(camera)), device_(device) {}

  [[nodiscard]] bool has(const std::string& feature) const override;
  [[nodiscard]] double number(const std::string& feature) const override;
  void set_number(const std::string& feature, double value) override;
  [[nodiscard]] std::string choice(const std::string& feature) const override;
  void set_choice(const std::string& feature, const std::string& entry) override;

 private:
  std::string camera_;
  ArvDevice* device_;
};

}  // namespace mf
