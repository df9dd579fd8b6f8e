// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "device/rig_status.h"

namespace mf {

// A RigStatus as one line of JSON (docs/status.md describes it for who reads the socket with another program):
//
//   {"state": "recording", "problem": "", "session": "/var/…", "seconds": 12.5, "durable_frames": 460,
//    "lost_frames": 0, "gaps": 0, "queued": 2, "queue_frames": 48, "frame_rate_hz": 37.0, "free_bytes": 31000000000,
//    "temperature_c": 51.0, "camera": "…", "exposure_s": 0.004,
//    "preview": {"width": 256, "height": 256, "grey": BASE64, "frame_px_per_preview": 4.0, "posed": true,
//                "tags": [{"id": 3, "corners_px": [[x, y], …four], "corrected_bits": 0, "decision_margin": 61.0}]},
//    "coverage": {"covered": 0.43, "done": false, "patches": [[azimuth_deg, elevation_deg, weight, covered], …],
//                 "advice": {"azimuth_deg": 210, "elevation_deg": 35, "text": "…"}}}
//
// temperature_c, preview, coverage and advice are absent when unknown; a number that is not finite is null. The
// preview's bytes stand there as they are, row by row, because a canvas takes them as they are: no picture format, no
// encoder here and no decoder there, and deflate would save little of a noisy picture of 60 kB.
[[nodiscard]] nlohmann::json rig_status_to_json(const RigStatus&);

// Bounds of what is believed: a line that breaks one is refused.
inline constexpr int most_preview_px = 1024;  // an edge
inline constexpr std::size_t most_status_tags = 1024;
inline constexpr std::size_t most_status_patches = 16384;

// Throws InputError(source, field): a value is missing, of another type, or out of bounds. Unknown keys are passed
// over, so that a newer daemon can be read.
[[nodiscard]] RigStatus rig_status_from_json(const nlohmann::json&, const std::string& source);

[[nodiscard]] std::string_view rig_state_name(RigState);

// The picture so many times smaller (a whole number, by means) that no edge is longer than most_px (≥ 1); the same
// when it is small enough.
[[nodiscard]] RigPreview shrunk_preview(const RigPreview&, int most_px);

}  // namespace mf
