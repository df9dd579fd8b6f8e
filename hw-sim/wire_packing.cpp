// SPDX-License-Identifier: Apache-2.0
#include "hw-sim/wire_packing.h"

#include <algorithm>

#include "common/check.h"

namespace mf::sim {

namespace {

// A stream of codes, least significant bit first.
void pack_stream(std::span<const std::uint16_t> codes, unsigned bits, std::span<std::uint8_t> bytes) {
  std::uint32_t waiting = 0;
  unsigned waiting_bits = 0;
  std::size_t at = 0;
  for (const std::uint16_t code : codes) {
    waiting |= static_cast<std::uint32_t>(code) << waiting_bits;
    for (waiting_bits += bits; waiting_bits >= 8; waiting_bits -= 8, waiting >>= 8)
      bytes[at++] = static_cast<std::uint8_t>(waiting);
  }
  if (waiting_bits > 0) bytes[at] = static_cast<std::uint8_t>(waiting);
}

// Three bytes hold two codes: the high eight bits of each outside, the low ones in the middle.
void pack_gige(std::span<const std::uint16_t> codes, unsigned low_bits, std::span<std::uint8_t> bytes) {
  const unsigned mask = (1U << low_bits) - 1;
  for (std::size_t i = 0; i < codes.size(); i += 2) {
    const unsigned first = codes[i], second = i + 1 < codes.size() ? codes[i + 1] : 0U;
    std::uint8_t* group = bytes.data() + i / 2 * 3;
    group[0] = static_cast<std::uint8_t>(first >> low_bits);
    group[1] = static_cast<std::uint8_t>((first & mask) | (second & mask) << 4);
    if (i + 1 < codes.size()) group[2] = static_cast<std::uint8_t>(second >> low_bits);
  }
}

}  // namespace

void pack(const WireFormat& format, std::span<const std::uint16_t> codes, std::span<std::uint8_t> bytes) {
  switch (format.packing) {
    case Packing::bytes:
      std::transform(codes.begin(), codes.end(), bytes.begin(),
                     [](unsigned c) { return static_cast<std::uint8_t>(c); });
      return;
    case Packing::words:
      for (std::size_t i = 0; i < codes.size(); ++i) {
        bytes[2 * i] = static_cast<std::uint8_t>(codes[i]);
        bytes[2 * i + 1] = static_cast<std::uint8_t>(codes[i] >> 8);
      }
      return;
    case Packing::lsb_10p:
      return pack_stream(codes, 10, bytes);
    case Packing::lsb_12p:
      return pack_stream(codes, 12, bytes);
    case Packing::gige_10:
      return pack_gige(codes, 2, bytes);
    case Packing::gige_12:
      return pack_gige(codes, 4, bytes);
    default:
      check(false, "a packing that GigE cameras use");
  }
}

}  // namespace mf::sim
