// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string_view>

namespace mf {

// How long work reports: the stage's name and the fraction done, 0 to 1. May be empty; is called from one thread at a
// time, and often: whoever shows it limits the rate.
using Progress = std::function<void(std::string_view stage, double fraction)>;

inline void report_progress(const Progress& progress, std::string_view stage, double fraction) {
  if (progress) progress(stage, fraction);
}

}  // namespace mf
