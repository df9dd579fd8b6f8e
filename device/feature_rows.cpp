// SPDX-License-Identifier: Apache-2.0
#include "device/feature_rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/error.h"

namespace mf {

std::optional<std::string> find_feature(const FeatureAccess& access, const FeatureNames& names) {
  for (const std::string_view name : names)
    if (std::string found(name); access.has(found)) return found;
  return std::nullopt;
}

bool FeatureNotes::write(const FeatureRow& row, double value, const std::string& index) {
  const std::optional<std::string> feature = find_feature(access_, row.names);
  if (!feature) {
    remark(fmt::format("{}{}: the camera does not have it now", row.names.front(), index));
    return false;
  }
  const double wanted = value * row.units;
  try {
    access_.set_number(*feature, wanted);
    const double now = access_.number(*feature);
    const bool rounded = now == std::round(now) && std::abs(now - wanted) <= 0.5;  // the step of an integer
    if (!rounded && !(std::abs(now - wanted) <= 1e-3 * std::abs(wanted)))
      remark(fmt::format("{}{}: asked for {:.6g}, the camera has {:.6g}", *feature, index, wanted, now));
    return true;
  } catch (const InputError& e) {
    remark(fmt::format("{}{}: {:.6g} is refused ({})", *feature, index, wanted, e.what()));
    return false;
  }
}

bool FeatureNotes::choose(const FeatureNames& names, const FeatureNames& entries) {
  const std::optional<std::string> feature = find_feature(access_, names);
  if (!feature) {
    remark(fmt::format("{}: the camera does not have it now", names.front()));
    return false;
  }
  std::string tried;
  for (const std::string_view entry : entries) {
    tried += (tried.empty() ? "" : " or ") + std::string(entry);
    try {
      access_.set_choice(*feature, std::string(entry));
      if (access_.choice(*feature) == entry) return true;
    } catch (const InputError&) {  // not an entry of this camera's: the next
    }
  }
  remark(fmt::format("{}: the camera does not take {}", *feature, tried));
  return false;
}

std::optional<double> FeatureNotes::read(const FeatureRow& row, const std::string& index) {
  const std::optional<std::string> feature = find_feature(access_, row.names);
  if (!feature) return std::nullopt;
  try {
    const double value = access_.number(*feature);
    readings.push_back({*feature + index, fmt::format("{:.9g}", value)});
    return value / row.units;
  } catch (const InputError& e) {
    remark(fmt::format("{}{}: cannot be read ({})", *feature, index, e.what()));
    return std::nullopt;
  }
}

std::optional<std::string> FeatureNotes::read_choice(const FeatureNames& names) {
  const std::optional<std::string> feature = find_feature(access_, names);
  if (!feature) return std::nullopt;
  try {
    std::string entry = access_.choice(*feature);
    readings.push_back({*feature, entry});
    return entry;
  } catch (const InputError& e) {
    remark(fmt::format("{}: cannot be read ({})", *feature, e.what()));
    return std::nullopt;
  }
}

bool FeatureNotes::turn(const SwitchRow& row, bool on) {
  const FeatureNames& entries = on ? row.on : row.off;
  return entries.empty() ? write({row.names}, on ? 1 : 0) : choose(row.names, entries);
}

SwitchState FeatureNotes::read_switch(const SwitchRow& row, std::string& entry) {
  if (row.on.empty() && row.off.empty()) {
    const std::optional<double> value = read({row.names});
    entry = value ? fmt::format("{:g}", *value) : "unreadable";
    return !value ? SwitchState::other : *value != 0 ? SwitchState::on : SwitchState::off;
  }
  entry = read_choice(row.names).value_or("unreadable");
  const auto holds = [&](const FeatureNames& names) {
    return std::find(names.begin(), names.end(), entry) != names.end();
  };
  return holds(row.on) ? SwitchState::on : holds(row.off) ? SwitchState::off : SwitchState::other;
}

}  // namespace mf
