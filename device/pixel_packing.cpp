// SPDX-License-Identifier: Apache-2.0
#include "device/pixel_packing.h"

#include <algorithm>
#include <array>

#include "common/check.h"

namespace mf {

namespace {

using L = PixelLayout;
using P = Packing;

constexpr std::array formats{
    WireFormat{0x01080001, "Mono8", {L::mono, 8}, P::bytes},
    WireFormat{0x01100003, "Mono10", {L::mono, 10}, P::words},
    WireFormat{0x010A0046, "Mono10p", {L::mono, 10}, P::lsb_10p},
    WireFormat{0x010C0004, "Mono10Packed", {L::mono, 10}, P::gige_10},
    WireFormat{0x01100005, "Mono12", {L::mono, 12}, P::words},
    WireFormat{0x010C0047, "Mono12p", {L::mono, 12}, P::lsb_12p},
    WireFormat{0x010C0006, "Mono12Packed", {L::mono, 12}, P::gige_12},
    WireFormat{0x01100007, "Mono16", {L::mono, 16}, P::words},
    WireFormat{0x01080008, "BayerGR8", {L::bayer_gr, 8}, P::bytes},
    WireFormat{0x01080009, "BayerRG8", {L::bayer_rg, 8}, P::bytes},
    WireFormat{0x0108000A, "BayerGB8", {L::bayer_gb, 8}, P::bytes},
    WireFormat{0x0108000B, "BayerBG8", {L::bayer_bg, 8}, P::bytes},
    WireFormat{0x0110000C, "BayerGR10", {L::bayer_gr, 10}, P::words},
    WireFormat{0x0110000D, "BayerRG10", {L::bayer_rg, 10}, P::words},
    WireFormat{0x0110000E, "BayerGB10", {L::bayer_gb, 10}, P::words},
    WireFormat{0x0110000F, "BayerBG10", {L::bayer_bg, 10}, P::words},
    WireFormat{0x010A0056, "BayerGR10p", {L::bayer_gr, 10}, P::lsb_10p},
    WireFormat{0x010A0058, "BayerRG10p", {L::bayer_rg, 10}, P::lsb_10p},
    WireFormat{0x010A0054, "BayerGB10p", {L::bayer_gb, 10}, P::lsb_10p},
    WireFormat{0x010A0052, "BayerBG10p", {L::bayer_bg, 10}, P::lsb_10p},
    WireFormat{0x01100010, "BayerGR12", {L::bayer_gr, 12}, P::words},
    WireFormat{0x01100011, "BayerRG12", {L::bayer_rg, 12}, P::words},
    WireFormat{0x01100012, "BayerGB12", {L::bayer_gb, 12}, P::words},
    WireFormat{0x01100013, "BayerBG12", {L::bayer_bg, 12}, P::words},
    WireFormat{0x010C0057, "BayerGR12p", {L::bayer_gr, 12}, P::lsb_12p},
    WireFormat{0x010C0059, "BayerRG12p", {L::bayer_rg, 12}, P::lsb_12p},
    WireFormat{0x010C0055, "BayerGB12p", {L::bayer_gb, 12}, P::lsb_12p},
    WireFormat{0x010C0053, "BayerBG12p", {L::bayer_bg, 12}, P::lsb_12p},
    WireFormat{0x010C002A, "BayerGR12Packed", {L::bayer_gr, 12}, P::gige_12},
    WireFormat{0x010C002B, "BayerRG12Packed", {L::bayer_rg, 12}, P::gige_12},
    WireFormat{0x010C002C, "BayerGB12Packed", {L::bayer_gb, 12}, P::gige_12},
    WireFormat{0x010C002D, "BayerBG12Packed", {L::bayer_bg, 12}, P::gige_12},
    WireFormat{0x0110002E, "BayerGR16", {L::bayer_gr, 16}, P::words},
    WireFormat{0x0110002F, "BayerRG16", {L::bayer_rg, 16}, P::words},
    WireFormat{0x01100030, "BayerGB16", {L::bayer_gb, 16}, P::words},
    WireFormat{0x01100031, "BayerBG16", {L::bayer_bg, 16}, P::words},
};

std::uint16_t code(unsigned value) {
  return static_cast<std::uint16_t>(value);
}

// Bit i of code n is bit n·bits + i of the stream; a code of 10 or 12 bits spans two bytes.
void unpack_stream(std::span<const std::uint8_t> bytes, std::size_t bits, std::span<std::uint16_t> codes) {
  const unsigned mask = (1U << bits) - 1;
  for (std::size_t n = 0; n < codes.size(); ++n) {
    const std::size_t at = n * bits / 8, shift = n * bits % 8;
    const unsigned pair = bytes[at] | static_cast<unsigned>(bytes[at + 1]) << 8;
    codes[n] = code(pair >> shift & mask);
  }
}

// High eight bits in bytes 0 and 2, what is left of both codes in the nibbles of byte 1.
void unpack_gige(std::span<const std::uint8_t> bytes, unsigned low_bits, std::span<std::uint16_t> codes) {
  const unsigned mask = (1U << low_bits) - 1;
  for (std::size_t n = 0; n < codes.size(); ++n) {
    const std::uint8_t* triple = bytes.data() + n / 2 * 3;
    const unsigned high = n % 2 == 0 ? triple[0] : triple[2];
    const unsigned low = n % 2 == 0 ? triple[1] : static_cast<unsigned>(triple[1]) >> 4;
    codes[n] = code(high << low_bits | (low & mask));
  }
}

// Groups of `per_group` codes: their high eight bits a byte each, then one byte with what is left of all of them.
void unpack_mipi(std::span<const std::uint8_t> bytes, std::size_t per_group, std::span<std::uint16_t> codes) {
  const auto low_bits = static_cast<unsigned>(8 / per_group);
  const unsigned mask = (1U << low_bits) - 1;
  for (std::size_t n = 0; n < codes.size(); ++n) {
    const std::uint8_t* group = bytes.data() + n / per_group * (per_group + 1);
    const std::size_t i = n % per_group;
    const unsigned low = static_cast<unsigned>(group[per_group]) >> (low_bits * i) & mask;
    codes[n] = code(static_cast<unsigned>(group[i]) << low_bits | low);
  }
}

void unpack_words(std::span<const std::uint8_t> bytes, int bits, std::span<std::uint16_t> codes) {
  const unsigned mask = (1U << bits) - 1;
  for (std::size_t n = 0; n < codes.size(); ++n)
    codes[n] = code((bytes[2 * n] | static_cast<unsigned>(bytes[2 * n + 1]) << 8) & mask);
}

}  // namespace

std::size_t WireFormat::bytes_for(std::size_t pixels) const {
  switch (packing) {
    case Packing::bytes:
      return pixels;
    case Packing::words:
      return 2 * pixels;
    case Packing::lsb_10p:
      return (10 * pixels + 7) / 8;
    case Packing::lsb_12p:
      return (12 * pixels + 7) / 8;
    case Packing::gige_10:
    case Packing::gige_12:
      return (3 * pixels + 1) / 2;
    case Packing::mipi_10:
      return (pixels + 3) / 4 * 5;
    case Packing::mipi_12:
      return (pixels + 1) / 2 * 3;
    case Packing::luma_of_yuyv:
      return 2 * pixels;
  }
  return 0;
}

std::span<const WireFormat> wire_formats() {
  return formats;
}

std::optional<WireFormat> wire_format(std::uint32_t pfnc) {
  const auto* found = std::find_if(formats.begin(), formats.end(), [&](const WireFormat& f) { return f.pfnc == pfnc; });
  return found == formats.end() ? std::nullopt : std::optional(*found);
}

std::optional<WireFormat> wire_format(std::string_view name) {
  const auto* found = std::find_if(formats.begin(), formats.end(), [&](const WireFormat& f) { return f.name == name; });
  return found == formats.end() ? std::nullopt : std::optional(*found);
}

void unpack(const WireFormat& format, std::span<const std::uint8_t> bytes, std::span<std::uint16_t> codes) {
  check(bytes.size() >= format.bytes_for(codes.size()), "the bytes hold all pixels");
  switch (format.packing) {
    case Packing::bytes:
      std::copy_n(bytes.begin(), codes.size(), codes.begin());
      return;
    case Packing::words:
      return unpack_words(bytes, format.format.bits, codes);
    case Packing::lsb_10p:
      return unpack_stream(bytes, 10, codes);
    case Packing::lsb_12p:
      return unpack_stream(bytes, 12, codes);
    case Packing::gige_10:
      return unpack_gige(bytes, 2, codes);
    case Packing::gige_12:
      return unpack_gige(bytes, 4, codes);
    case Packing::mipi_10:
      return unpack_mipi(bytes, 4, codes);
    case Packing::mipi_12:
      return unpack_mipi(bytes, 2, codes);
    case Packing::luma_of_yuyv:
      for (std::size_t n = 0; n < codes.size(); ++n) codes[n] = bytes[2 * n];
      return;
  }
}

}  // namespace mf
