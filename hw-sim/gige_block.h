// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace mf::sim {

using Bytes = std::vector<std::uint8_t>;

// GigE Vision's byte order is the network's.
inline void put16(Bytes& out, std::uint32_t value) {
  out.push_back(static_cast<std::uint8_t>(value >> 8));
  out.push_back(static_cast<std::uint8_t>(value));
}
inline void put32(Bytes& out, std::uint32_t value) {
  put16(out, value >> 16);
  put16(out, value & 0xFFFF);
}
inline std::uint16_t get16(std::span<const std::uint8_t> in, std::size_t at) {
  return static_cast<std::uint16_t>(in[at] << 8 | in[at + 1]);
}
inline std::uint32_t get32(std::span<const std::uint8_t> in, std::size_t at) {
  return std::uint32_t{get16(in, at)} << 16 | get16(in, at + 2);
}

// One frame on its way: what a resend needs.
struct GigeBlock {
  std::uint16_t number = 0;
  std::uint64_t timestamp_ns = 0;
  std::size_t data_per_packet = 0;
  std::uint32_t pfnc = 0;
  int width = 0, height = 0;
  bool chunks = false;
  Bytes payload;

  [[nodiscard]] std::uint32_t data_packets() const {
    return static_cast<std::uint32_t>((payload.size() + data_per_packet - 1) / data_per_packet);
  }
};

// One packet of a block as GVSP has it: 0 is the leader, then the data, then the trailer.
[[nodiscard]] Bytes packet_of(const GigeBlock&, std::uint32_t packet);

// Timestamp and exposure time behind the picture. Precondition: the payload has gige_chunk::bytes for them.
void append_chunks(GigeBlock&, std::size_t picture_bytes, double exposure_s);

}  // namespace mf::sim
