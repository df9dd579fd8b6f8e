// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "common/progress.h"
#include "common/response_curve.h"
#include "common/session.h"
#include "host/calibration/calibration.h"
#include "host/lumigraph/posed_photo.h"

namespace mf {

struct SessionPhotoOptions {
  double scale = 1;               // of the frames' size, 0 to 1
  bool scene = false;             // the scene pictures too, which the camera took without the mirror
  double inset_px = 2;            // frame pixels of the mirror kept clear of the tags: demosaicing reaches over edges
  double border_fraction = 0.12;  // of the opening's shorter side, 0 to 0.5: width of the smooth border inside of that

  [[nodiscard]] std::optional<std::string> validate() const;
};

// What a calibrated session saw in the mirror, as photos from behind it (mirror_picture.h): linear radiance, divided by
// the mirror's reflectance. Each is cut to the box about the mirror's opening; its mask is 0 on the tag frame and rises
// smoothly to 255 inside. World: the session's; without world tags the camera's frame. Frames that calibration does not
// use are left out, and those whose opening shows less than 16 pixels of a side. Times are the recording's.
// Throws InputError when fewer than two are left.
[[nodiscard]] PhotoSet photos_of_session(const SessionReader&, const ResponseCurve&, const Calibration&,
                                         const SessionPhotoOptions&, const Progress&);

}  // namespace mf
