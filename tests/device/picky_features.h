// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "common/error.h"
#include "device/camera_features.h"

namespace mf::test {

// Features with the ways of real cameras: limits that refuse or clip, steps, what can only be read, what one of them
// selects, what is there only in a mode.
class PickyFeatures final : public FeatureAccess {
 public:
  struct Number {
    double value = 0;
    double low = -std::numeric_limits<double>::infinity(), high = std::numeric_limits<double>::infinity();
    bool clips = false;  // otherwise it refuses
    bool whole = false;  // an integer
    bool read_only = false;
    std::string selector{};  // the number is one of many, by this feature's value
  };
  struct Choice {
    std::string value;
    std::set<std::string> entries;
  };
  std::map<std::string, Number> numbers;
  std::map<std::string, Choice> choices;
  std::set<std::string> unreadable;
  std::vector<std::string> written;  // in order

  [[nodiscard]] bool has(const std::string& f) const override { return numbers.contains(f) || choices.contains(f); }
  [[nodiscard]] double number(const std::string& f) const override {
    const auto found = numbers.find(f);
    if (found == numbers.end() || unreadable.contains(f)) throw InputError("picky", f, "the camera does not tell it");
    const auto selected = selected_.find(key(f));
    return selected != selected_.end() ? selected->second : found->second.value;
  }
  void set_number(const std::string& f, double value) override {
    written.push_back(f);
    const auto found = numbers.find(f);
    if (found == numbers.end() || found->second.read_only) throw InputError("picky", f, "the camera refuses it");
    const Number& n = found->second;
    if (!n.clips && !(value >= n.low && value <= n.high)) throw InputError("picky", f, "out of range");
    const double kept = std::clamp(n.whole ? std::round(value) : value, n.low, n.high);
    selected_[key(f)] = kept;
  }
  [[nodiscard]] std::string choice(const std::string& f) const override {
    const auto found = choices.find(f);
    if (found == choices.end() || unreadable.contains(f)) throw InputError("picky", f, "the camera does not tell it");
    return found->second.value;
  }
  void set_choice(const std::string& f, const std::string& entry) override {
    written.push_back(f);
    const auto found = choices.find(f);
    if (found == choices.end() || !found->second.entries.contains(entry))
      throw InputError("picky", f, "choose one that the camera has");
    found->second.value = entry;
  }

 private:
  [[nodiscard]] std::string key(const std::string& f) const {
    const auto found = numbers.find(f);
    if (found == numbers.end() || found->second.selector.empty()) return f;
    return f + "/" + std::to_string(number(found->second.selector));
  }
  std::map<std::string, double> selected_;
};

}  // namespace mf::test
