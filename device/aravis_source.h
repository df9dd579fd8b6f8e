// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "device/camera_source.h"

namespace mf {

// A GigE Vision or USB3 Vision camera, through Aravis. Opens and sets it; it takes no frames before start().
// Throws InputError: no camera there, a setting that it refuses, a pixel format that we cannot unpack.
[[nodiscard]] std::unique_ptr<CameraSource> open_aravis_source(const CameraSettings&);

[[nodiscard]] std::vector<FoundCamera> find_aravis_cameras();

}  // namespace mf
