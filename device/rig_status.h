// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/image.h"
#include "common/tag_detector.h"

namespace mf {

enum class RigState {
  idle,       // waits for the button
  metering,   // chooses exposure and response
  recording,  // from the first durable frame on
  done,       // the last recording was closed, everything in it is durable
  error,      // see problem
};

// A patch of the hemisphere of directions over the light-field plane, in the plane's frame.
struct CoveragePatch {
  double azimuth_deg = 0;    // from the plane's x towards its y; the patch's centre
  double elevation_deg = 0;  // above the plane
  double weight = 0;         // share of the plane's light that comes from here; all patches together 1
  double covered = 0;        // share of the plane's cells that enough views saw in this direction, 0 to 1
};

// Where the mirror is wanted next.
struct CaptureAdvice {
  double azimuth_deg = 0, elevation_deg = 0;  // of the direction that is missing most, in the plane's frame
  std::string text;                           // for the operator, one short line: "tilt the mirror's left edge down"
};

struct CoverageStatus {
  double covered = 0;  // of the light, 0 to 1
  bool done = false;
  std::vector<CoveragePatch> patches;
  std::optional<CaptureAdvice> advice;
};

// The latest picture that was looked at, small, with a display curve applied.
struct RigPreview {
  ImageU8 grey;                     // one channel
  double frame_px_per_preview = 1;  // the frame is so many times larger
  std::vector<TagDetection> tags;   // in pixels of the frame
  bool posed = false;               // the mirror's pose is known from them
};

// What the rig tells of itself, several times a second.
struct RigStatus {
  RigState state = RigState::idle;
  std::string problem;  // one line with the remedy; empty: none. Losses in a running recording are one, too
  std::string session;  // the current or last recording's folder; empty: none yet
  double seconds = 0;   // of that recording
  std::int64_t durable_frames = 0;
  std::int64_t lost_frames = 0;
  std::int64_t gaps = 0;
  int queued = 0, queue_frames = 0;
  double frame_rate_hz = 0;             // of the last second
  std::int64_t free_bytes = 0;          // where sessions go
  std::optional<double> temperature_c;  // of the board
  std::string camera;                   // vendor, model, serial
  double exposure_s = 0;
  std::optional<RigPreview> preview;
  std::optional<CoverageStatus> coverage;
};

}  // namespace mf
