// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "common/frame.h"

namespace mf {

// How a camera packs codes into bytes.
enum class Packing {
  bytes,    // one byte a code
  words,    // 16-bit little-endian, code in the low bits
  lsb_10p,  // a stream of 10-bit codes, least significant bit first (PFNC "10p")
  lsb_12p,  // the same with 12 bits (PFNC "12p")
  gige_10,  // GigE Vision's "10Packed": three bytes hold two codes, the high eight bits in the outer ones
  gige_12,  // GigE Vision's "12Packed"
  mipi_10,  // MIPI CSI-2 RAW10: five bytes hold four codes, the high eight bits first, their low two in the last byte
  mipi_12,  // MIPI CSI-2 RAW12: three bytes hold two codes, the high eight bits first
  luma_of_yuyv,  // every second byte; the colour differences are passed over
};

// A pixel format as it crosses the wire. Numbers and names are those of the GenICam Pixel Format Naming Convention
// (PFNC 2.4), which GigE Vision and USB3 Vision share.
struct WireFormat {
  std::uint32_t pfnc = 0;
  std::string_view name;
  PixelFormat format;
  Packing packing = Packing::bytes;

  // Bytes that so many pixels take, the last byte (of MIPI's: the last group) rounded up.
  [[nodiscard]] std::size_t bytes_for(std::size_t pixels) const;
};

// Mono 8, 10, 12 (10p, 12p, 10Packed, 12Packed), 16; Bayer 8, 10, 12 and their packed forms, 16, in all four orders.
[[nodiscard]] std::span<const WireFormat> wire_formats();
[[nodiscard]] std::optional<WireFormat> wire_format(std::uint32_t pfnc);
[[nodiscard]] std::optional<WireFormat> wire_format(std::string_view name);

// Precondition: `bytes` holds at least bytes_for(codes.size()). Bits above the format's own are cleared.
void unpack(const WireFormat&, std::span<const std::uint8_t> bytes, std::span<std::uint16_t> codes);

}  // namespace mf
