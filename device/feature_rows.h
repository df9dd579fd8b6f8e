// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "device/camera_features.h"

namespace mf {

// A feature by the names that cameras give it, the first that is there counts.
using FeatureNames = std::vector<std::string_view>;

// A number in a camera's unit, of which one of ours has `units`: 100 where the camera counts in percent.
struct FeatureRow {
  FeatureNames names{};
  double units = 1;
};

// An enumeration by its entries (the first that the camera takes), or a boolean when there are none.
struct SwitchRow {
  FeatureNames names{};
  FeatureNames on{}, off{};
};
enum class SwitchState { on, off, other };  // other: an entry of neither list, or not readable

[[nodiscard]] std::optional<std::string> find_feature(const FeatureAccess&, const FeatureNames&);

// Writes and reads features for good or ill: what happened is in `readings` and `remarks`, nothing is thrown.
// `index`, where not empty, stands behind the feature's name in both: "[2]".
class FeatureNotes {
 public:
  explicit FeatureNotes(FeatureAccess& access) : access_(access) {}

  // In our unit; false when it could not be written.
  bool write(const FeatureRow&, double value, const std::string& index = {});
  bool choose(const FeatureNames&, const FeatureNames& entries);  // the first entry that the camera takes
  // In our unit, noted; nothing when it is not there or cannot be read.
  [[nodiscard]] std::optional<double> read(const FeatureRow&, const std::string& index = {});
  [[nodiscard]] std::optional<std::string> read_choice(const FeatureNames&);
  bool turn(const SwitchRow&, bool on);
  [[nodiscard]] SwitchState read_switch(const SwitchRow&, std::string& entry);
  void remark(std::string line) { remarks.push_back(std::move(line)); }

  std::vector<FeatureReading> readings;
  std::vector<std::string> remarks;

 private:
  FeatureAccess& access_;
};

}  // namespace mf
