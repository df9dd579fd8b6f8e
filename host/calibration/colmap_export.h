// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "common/mirror_target.h"
#include "common/progress.h"
#include "common/response_curve.h"
#include "common/session.h"
#include "host/calibration/calibration.h"

namespace mf {

// What COLMAP calls a mirror view: the picture flipped left to right, and the camera that took it.
//
//   view_from_world = diag(−1, 1, 1) · S · cam_from_world,   c_x → W − c_x,   p₂ → −p₂
//
// S is the reflection of VirtualView. Without world tags the world is the camera's frame. This is the camera's part.
[[nodiscard]] CameraModel flipped_camera(const CameraModel&);

struct ColmapSummary {
  int images = 0;  // mirror views and scene pictures
};

// Writes a COLMAP text model: `cameras.txt` (1: the camera, for scene pictures; 2: flipped, for mirror views),
// `images.txt`, an empty `points3D.txt` (as COLMAP's known-pose workflow wants it), the pictures as sRGB PNG in
// `images/` and, in `masks/`, which pixels of a mirror view are mirror. Only used frames. The folder is made; what it
// holds under these names is replaced. Throws InputError naming the file.
ColmapSummary export_colmap(const std::filesystem::path& folder, const Calibration&, const SessionReader&,
                            const ResponseCurve&, const Progress&);

}  // namespace mf
