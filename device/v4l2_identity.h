// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "device/camera_source.h"
#include "device/v4l2_device.h"

namespace mf {

// What the driver and udev say a device is. The name is udev's /dev/v4l/by-id/ link where there is one, which stays
// when the camera is plugged in elsewhere. Throws InputError when it is no V4L2 device, or none that captures frames
// into buffers that can be mapped.
[[nodiscard]] FoundCamera identify_v4l2_camera(const V4l2Device&);

// /dev/video* as udev knows them, in the kernel's order.
[[nodiscard]] std::vector<std::string> v4l2_nodes();

}  // namespace mf
