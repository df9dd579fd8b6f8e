// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <umockdev.h>

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "common/image.h"
#include "device/camera_source.h"
#include "hw-sim/v4l2_camera.h"

namespace mf::test {

// The code that the simulated camera sees at a pixel of the sensor in a frame, before it is cut to the format's bits.
[[nodiscard]] std::uint32_t sensor_code(std::uint64_t frame, int x, int y);

// Writes a region of the sensor in a V4L2 format, after the V4L2 documentation (and not with what reads it back).
void fill_pattern(std::uint64_t frame, const sim::V4l2Mode&, std::span<std::uint8_t> payload);

// How many pixels differ from what the sensor saw; `x`, `y` is where the region begins.
[[nodiscard]] int wrong_pixels(const ImageU16& codes, int bits, std::uint64_t frame, int x = 0, int y = 0);

struct TestbedRelease {
  void operator()(UMockdevTestbed* testbed) const { g_object_unref(testbed); }
};

// A testbed with one camera of 64 × 48 pixels that shows the pattern.
struct V4l2Rig {
  explicit V4l2Rig(const sim::V4l2CameraOptions&);
  std::unique_ptr<UMockdevTestbed, TestbedRelease> testbed;
  sim::V4l2Camera camera;
};

[[nodiscard]] sim::V4l2CameraOptions pattern_camera(std::uint32_t fourcc);
[[nodiscard]] CameraSettings settings_for_rig();

}  // namespace mf::test
