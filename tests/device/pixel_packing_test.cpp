// SPDX-License-Identifier: Apache-2.0
#include "device/pixel_packing.h"

#include <gtest/gtest.h>

#include <array>
#include <random>
#include <vector>

namespace mf {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Codes = std::vector<std::uint16_t>;

Codes unpacked(std::string_view name, const Bytes& bytes, std::size_t pixels) {
  const std::optional<WireFormat> format = wire_format(name);
  EXPECT_TRUE(format.has_value()) << name;
  Codes codes(pixels);
  unpack(*format, bytes, codes);
  return codes;
}

// Bit by bit from the standards' figures, to try the shifts above against another way of saying it.
void set_bit(Bytes& bytes, std::size_t bit) {
  bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] | 1U << bit % 8);
}

// GenICam PFNC 2.4, "lsb packed": code n has its bit i at bit n·bits + i of the stream.
Bytes packed_lsb(const Codes& codes, std::size_t bits) {
  Bytes bytes((codes.size() * bits + 7) / 8);
  for (std::size_t n = 0; n < codes.size(); ++n)
    for (std::size_t i = 0; i < bits; ++i)
      if ((codes[n] >> i & 1) != 0) set_bit(bytes, n * bits + i);
  return bytes;
}

// GigE Vision 2.0, figures of Mono10Packed and Mono12Packed: bytes 0 and 2 hold the high bits, byte 1 the low ones.
Bytes packed_gige(const Codes& codes, std::size_t low_bits) {
  Bytes bytes((codes.size() * 3 + 1) / 2);
  for (std::size_t n = 0; n < codes.size(); ++n)
    for (std::size_t i = 0; i < low_bits + 8; ++i) {
      if ((codes[n] >> i & 1) == 0) continue;
      const std::size_t triple = n / 2 * 24;
      const std::size_t high = triple + (n % 2 == 0 ? 0 : 16), low = triple + 8 + (n % 2 == 0 ? 0 : 4);
      set_bit(bytes, i < low_bits ? low + i : high + i - low_bits);
    }
  return bytes;
}

Codes random_codes(std::size_t count, int bits) {
  std::mt19937 random(7);
  Codes codes(count);
  for (std::uint16_t& code : codes) code = static_cast<std::uint16_t>(random() & ((1U << bits) - 1));
  return codes;
}

TEST(PixelPacking, KnownBytes) {
  EXPECT_EQ(unpacked("Mono8", {0, 127, 255}, 3), (Codes{0, 127, 255}));
  EXPECT_EQ(unpacked("Mono12", {0xFF, 0x0F, 0x01, 0x00}, 2), (Codes{4095, 1}));
  EXPECT_EQ(unpacked("Mono16", {0x34, 0x12}, 1), (Codes{0x1234}));
  EXPECT_EQ(unpacked("Mono12p", {0xBC, 0x3A, 0x12}, 2), (Codes{0xABC, 0x123}));
  EXPECT_EQ(unpacked("Mono12Packed", {0xAB, 0x3C, 0x12}, 2), (Codes{0xABC, 0x123}));
}

TEST(PixelPacking, PackedFormatsGiveTheirCodesBack) {
  for (const std::size_t count : {1U, 2U, 3U, 4U, 5U, 640U}) {
    EXPECT_EQ(unpacked("Mono10p", packed_lsb(random_codes(count, 10), 10), count), random_codes(count, 10));
    EXPECT_EQ(unpacked("BayerRG12p", packed_lsb(random_codes(count, 12), 12), count), random_codes(count, 12));
    EXPECT_EQ(unpacked("Mono10Packed", packed_gige(random_codes(count, 10), 2), count), random_codes(count, 10));
    EXPECT_EQ(unpacked("BayerGB12Packed", packed_gige(random_codes(count, 12), 4), count), random_codes(count, 12));
  }
}

TEST(PixelPacking, BitsAboveTheFormatAreCleared) {
  EXPECT_EQ(unpacked("Mono10", {0xFF, 0xFF}, 1), (Codes{1023}));
}

TEST(PixelPacking, TheNumbersCarryTheirOwnSize) {
  // PFNC: bits 16 to 23 of a format's number are the bits that a pixel takes.
  for (const WireFormat& f : wire_formats()) {
    EXPECT_EQ(f.bytes_for(16), 16 * (f.pfnc >> 16 & 0xFF) / 8) << f.name;
    EXPECT_EQ(wire_format(f.pfnc)->name, f.name);
  }
  EXPECT_FALSE(wire_format("RGB8").has_value());
}

}  // namespace
}  // namespace mf
