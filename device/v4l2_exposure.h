// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "device/camera_source.h"
#include "device/v4l2_controls.h"

namespace mf {

// Exposure time and gain of a V4L2 camera, in seconds and decibels. Each throws InputError naming the camera and the
// field.

// Switches automatic exposure off first. The time is one of the camera's steps: 100 µs (exposure_time_absolute), or
// lines of the sensor (exposure, where the camera tells pixel_rate and horizontal_blanking). `line_px`: the width that
// the sensor sends.
void set_v4l2_exposure(V4l2Controls&, const std::string& camera, double exposure_s, int line_px);
[[nodiscard]] double v4l2_exposure_s(const V4l2Controls&, const std::string& camera, int line_px);

// analogue_gain or gain, whichever there is; automatic gain is switched off first. 0 dB is step 0: V4L2 tells nothing
// of what a gain's steps are, so `step_db` must.
void set_v4l2_gain(V4l2Controls&, const std::string& camera, double gain_db, const std::optional<double>& step_db);
// 0 when there is no gain, or nobody has told what its steps are.
[[nodiscard]] double v4l2_gain_db(const V4l2Controls&, const std::optional<double>& step_db);

}  // namespace mf
