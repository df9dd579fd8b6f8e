// SPDX-License-Identifier: Apache-2.0
#include "tests/hw-sim/v4l2_rig.h"

#include <linux/videodev2.h>

namespace mf::test {

namespace {

void put_word(std::span<std::uint8_t> line, std::size_t at, std::uint32_t code) {
  line[at] = static_cast<std::uint8_t>(code);
  line[at + 1] = static_cast<std::uint8_t>(code >> 8);
}

// "Each pair of pixels is three bytes: the high bits of the first, of the second, then the low four bits of both."
void put_raw12(std::span<std::uint8_t> line, std::size_t n, std::uint32_t code) {
  const std::size_t group = n / 2 * 3;
  line[group + n % 2] = static_cast<std::uint8_t>(code >> 4);
  line[group + 2] = static_cast<std::uint8_t>(line[group + 2] | (code & 0xFU) << (n % 2 == 0 ? 0 : 4));
}

// "Four pixels are five bytes: the high bits of each, then the low two bits of all, the first in the lowest."
void put_raw10(std::span<std::uint8_t> line, std::size_t n, std::uint32_t code) {
  const std::size_t group = n / 4 * 5;
  line[group + n % 4] = static_cast<std::uint8_t>(code >> 2);
  line[group + 4] = static_cast<std::uint8_t>(line[group + 4] | (code & 3U) << (2 * (n % 4)));
}

void put(std::uint32_t fourcc, std::span<std::uint8_t> line, std::size_t n, std::uint32_t code) {
  switch (fourcc) {
    case V4L2_PIX_FMT_GREY:
    case V4L2_PIX_FMT_SRGGB8:
    case V4L2_PIX_FMT_SGRBG8:
    case V4L2_PIX_FMT_SGBRG8:
    case V4L2_PIX_FMT_SBGGR8:
      line[n] = static_cast<std::uint8_t>(code);
      return;
    case V4L2_PIX_FMT_YUYV:
      line[2 * n] = static_cast<std::uint8_t>(code);
      line[2 * n + 1] = 0x80;
      return;
    case V4L2_PIX_FMT_Y10:
    case V4L2_PIX_FMT_SRGGB10:
      return put_word(line, 2 * n, code & 0x3FFU);
    case V4L2_PIX_FMT_Y16:
      return put_word(line, 2 * n, code & 0xFFFFU);
    case V4L2_PIX_FMT_SRGGB12P:
      return put_raw12(line, n, code & 0xFFFU);
    case V4L2_PIX_FMT_SRGGB10P:
      return put_raw10(line, n, code & 0x3FFU);
    default:
      return put_word(line, 2 * n, code & 0xFFFU);  // Y12 and the unpacked 12-bit mosaics
  }
}

}  // namespace

std::uint32_t sensor_code(std::uint64_t frame, int x, int y) {
  auto value = static_cast<std::uint32_t>(frame * 0x9E3779B1U) ^ static_cast<std::uint32_t>(x) * 0x85EBCA77U ^
               static_cast<std::uint32_t>(y) * 0xC2B2AE3DU;
  value ^= value >> 15U;
  value *= 0x2C1B3C6DU;
  return value ^ value >> 13U;
}

void fill_pattern(std::uint64_t frame, const sim::V4l2Mode& mode, std::span<std::uint8_t> payload) {
  for (int y = 0; y < mode.height; ++y) {
    const auto line = payload.subspan(static_cast<std::size_t>(y) * mode.bytes_per_line, mode.bytes_per_line);
    std::fill(line.begin(), line.end(), std::uint8_t{0});
    for (int x = 0; x < mode.width; ++x)
      put(mode.fourcc, line, static_cast<std::size_t>(x), sensor_code(frame, mode.x + x, mode.y + y));
  }
}

int wrong_pixels(const ImageU16& codes, int bits, std::uint64_t frame, int x0, int y0) {
  const std::uint32_t mask = (1U << bits) - 1;
  int wrong = 0;
  for (int y = 0; y < codes.height; ++y)
    for (int x = 0; x < codes.width; ++x)
      wrong += codes.at(x, y) != (sensor_code(frame, x0 + x, y0 + y) & mask) ? 1 : 0;
  return wrong;
}

V4l2Rig::V4l2Rig(const sim::V4l2CameraOptions& options)
    : testbed(umockdev_testbed_new()), camera(testbed.get(), options, fill_pattern) {}

sim::V4l2CameraOptions pattern_camera(std::uint32_t fourcc) {
  sim::V4l2CameraOptions options;
  options.fourccs = {fourcc};
  options.width = 64;
  options.height = 48;
  options.frame_rate_hz = 100;
  return options;
}

CameraSettings settings_for_rig() {
  CameraSettings settings;
  settings.address = "/dev/video60";
  settings.exposure_s = 0.004;
  return settings;
}

}  // namespace mf::test
