// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "device/pixel_packing.h"

namespace mf {

// A V4L2 pixel format that we can record. `wire.name` is the GenICam-style name by which it is asked for; formats that
// carry the same codes packed differently have names of their own (BayerRG12, BayerRG12p). `wire.pfnc` is 0.
struct V4l2Format {
  std::uint32_t fourcc = 0;
  WireFormat wire;
};

// GREY, Y10, Y12, Y16 and MIPI-packed Y10P; Bayer 8, 10, 12, 14, 16 and MIPI-packed 10, 12 in all four orders; YUYV,
// of which only the luma is taken, as Mono8. From better to worse where a camera has several: more bits first, packed
// ones after unpacked ones of the same bits, YUYV last.
[[nodiscard]] std::span<const V4l2Format> v4l2_formats();
[[nodiscard]] std::optional<V4l2Format> known_v4l2_format(std::uint32_t fourcc);

// "RG12"; trailing blanks are left out.
[[nodiscard]] std::string fourcc_name(std::uint32_t fourcc);

}  // namespace mf
