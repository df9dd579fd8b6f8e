// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "device/camera_source.h"

namespace mf {

// A UVC or sensor camera through V4L2 (single-planar capture with mapped buffers). settings.address is /dev/videoN, a
// symlink to one (udev's /dev/v4l/by-id/... stay when a camera is plugged in elsewhere), or empty for the first that is
// found. Opens and sets it; it takes no frames before start().
//
// Arrivals: the driver's sequence number from 1 on, and its time stamp as device_ns, which is CLOCK_MONOTONIC where the
// driver says so. features() are the controls as v4l2-ctl names them.
//
// Throws InputError: no such device, no permission, another program has it, no capture device, a setting that it
// refuses, a pixel format that we cannot unpack.
[[nodiscard]] std::unique_ptr<CameraSource> open_v4l2_source(const CameraSettings&);

// Capture devices with a format that we can record, whether they are in use or not.
[[nodiscard]] std::vector<FoundCamera> find_v4l2_cameras();

}  // namespace mf
