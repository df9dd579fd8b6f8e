// SPDX-License-Identifier: Apache-2.0
#include "hw-sim/gige_block.h"

#include <algorithm>
#include <bit>

#include "hw-sim/gige_registers.h"

namespace mf::sim {

// GVSP §23: packet 0 is the leader, then the data, then the trailer.
Bytes packet_of(const GigeBlock& block, std::uint32_t packet) {
  const std::uint32_t last_data = block.data_packets();
  const std::uint32_t kind = packet == 0 ? 1 : packet <= last_data ? 3 : 2;
  Bytes out;
  out.reserve(block.data_per_packet + 64);
  put16(out, 0);
  put16(out, block.number);
  put32(out, kind << 24 | packet);
  if (kind == 1) {
    put32(out, block.chunks ? 0x4001 : 0x0001);  // an image, with chunks behind it
    put32(out, static_cast<std::uint32_t>(block.timestamp_ns >> 32));
    put32(out, static_cast<std::uint32_t>(block.timestamp_ns));
    put32(out, block.pfnc);
    put32(out, static_cast<std::uint32_t>(block.width));
    put32(out, static_cast<std::uint32_t>(block.height));
    for (int i = 0; i < 3; ++i) put32(out, 0);  // offsets, paddings
  } else if (kind == 3) {
    const std::size_t begin = (packet - 1) * block.data_per_packet;
    const std::size_t end = std::min(begin + block.data_per_packet, block.payload.size());
    out.insert(out.end(), block.payload.begin() + static_cast<std::ptrdiff_t>(begin),
               block.payload.begin() + static_cast<std::ptrdiff_t>(end));
  } else {
    put32(out, block.chunks ? 0x4001 : 0x0001);
    put32(out, static_cast<std::uint32_t>(block.height));
  }
  return out;
}

// GVSP §24: each chunk is its data, its identity, its length; the picture is the first.
void append_chunks(GigeBlock& block, std::size_t picture_bytes, double exposure_s) {
  Bytes chunks;
  const auto end_chunk = [&](std::uint32_t identity, std::size_t size) {
    put32(chunks, identity);
    put32(chunks, static_cast<std::uint32_t>(size));
  };
  const auto put64 = [&](std::uint64_t value) {
    put32(chunks, static_cast<std::uint32_t>(value >> 32));
    put32(chunks, static_cast<std::uint32_t>(value));
  };
  end_chunk(gige_chunk::image, picture_bytes);
  put64(block.timestamp_ns);
  end_chunk(gige_chunk::timestamp, 8);
  put64(std::bit_cast<std::uint64_t>(1e6 * exposure_s));
  end_chunk(gige_chunk::exposure_us, 8);
  std::copy(chunks.begin(), chunks.end(), block.payload.begin() + static_cast<std::ptrdiff_t>(picture_bytes));
}

}  // namespace mf::sim
