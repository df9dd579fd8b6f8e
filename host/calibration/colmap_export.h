// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "common/progress.h"
#include "common/response_curve.h"
#include "common/session.h"
#include "host/calibration/calibration.h"

namespace mf {

struct ColmapSummary {
  int images = 0;  // mirror views and scene pictures
};

// Writes a COLMAP text model: `cameras.txt` (1: the camera, for scene pictures; 2: flipped, for mirror views),
// `images.txt`, an empty `points3D.txt` (as COLMAP's known-pose workflow wants it), the pictures as sRGB PNG in
// `images/` and, in `masks/`, which pixels of a mirror view are mirror. A mirror view is its frame as mirror_picture.h
// has it; without world tags the world is the camera's frame. Only used frames. The folder is made; what it holds under
// these names is replaced. Throws InputError naming the file.
ColmapSummary export_colmap(const std::filesystem::path& folder, const Calibration&, const SessionReader&,
                            const ResponseCurve&, const Progress&);

}  // namespace mf
