// SPDX-License-Identifier: Apache-2.0
#include "host/blending/ray_penalty.h"

namespace mf {

std::optional<std::string> PenaltyOptions::validate() const {
  if (k < 1 || k > 64) return "k: must be between 1 and 64 views";
  if (!(angle >= 0) || !std::isfinite(angle)) return "angle: must be a number ≥ 0";
  if (!(resolution >= 0) || !std::isfinite(resolution)) return "resolution: must be a number ≥ 0";
  if (!(angle + resolution > 0)) return "angle: and resolution must not both be 0";
  if (!(border > 0) || !std::isfinite(border)) return "border: must be a number > 0";
  return std::nullopt;
}

}  // namespace mf
