// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "common/progress.h"
#include "host/light_field/resample.h"

namespace mf {

// Session folder (with response.json and calibration.json) → light field file; the result's field has no texels. Throws
// InputError.
[[nodiscard]] ResampleResult run_resample(const std::filesystem::path& session, const std::filesystem::path& output,
                                          const ResampleOptions&, Team&, const Progress&);

}  // namespace mf
