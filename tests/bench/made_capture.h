// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace mf::bench {

struct MadeCaptureOptions {
  int frames = 2200;
  int size_px = 1024;
};

// A session as a rig records it — Bayer frames of 12 bits with shot noise, calibration.json, response.json — whose
// mirror poses are known and whose light is analytic: a textured room of 4 × 3.6 m, 2.4 m high above the plane, with a
// window and a small lamp. Only its light is simple; its size and files are a real capture's. Does nothing when the
// folder is there already.
void make_capture(const std::filesystem::path& session, const MadeCaptureOptions&);

}  // namespace mf::bench
