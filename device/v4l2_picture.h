// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "device/camera_source.h"
#include "device/v4l2_device.h"
#include "device/v4l2_formats.h"

namespace mf {

// What a V4L2 camera's frames are: how a buffer's bytes lie.
struct V4l2Picture {
  V4l2Format format;
  int width = 0, height = 0;       // pixels
  std::size_t bytes_per_line = 0;  // from one row to the next

  // Up to the last row's last pixel.
  [[nodiscard]] std::size_t bytes() const;
};

// Sets pixel format and region, and reads back what the camera took. Without pixel_format the camera's own stays when
// we can record it, else the best that it has is set. A region is a crop of the sensor; a camera that cannot crop takes
// one at (0, 0) as the choice of its picture size. Throws InputError naming the camera and the field.
[[nodiscard]] V4l2Picture set_v4l2_picture(const V4l2Device&, const CameraSettings&);

// Throws InputError when the camera does not make that rate, to 1 %.
void set_v4l2_frame_rate(const V4l2Device&, double hz);
// 0 when the camera does not tell.
[[nodiscard]] double v4l2_frame_rate_hz(const V4l2Device&);

// The recordable formats that it has, best first.
[[nodiscard]] std::vector<V4l2Format> v4l2_formats_of(const V4l2Device&);

}  // namespace mf
