// SPDX-License-Identifier: Apache-2.0
#include "common/fast_deflate.h"

#include <isa-l/igzip_lib.h>

#include <limits>
#include <vector>

#include "common/check.h"

namespace mf {

namespace {

constexpr std::uint32_t isal_level = 3;  // on frames the fastest of ISA-L's four, though not in name

// A stored block of 65535 bytes costs five; a stream two at its begin and four at its end. That is its worst case.
std::size_t most_deflated(std::size_t bytes) {
  return bytes + 5 * (bytes / 65535 + 1) + 64;
}

}  // namespace

void append_deflated(std::span<const std::uint8_t> bytes, std::string& out) {
  check(bytes.size() < std::numeric_limits<std::uint32_t>::max() / 2, "ISA-L counts in 32 bits");
  thread_local std::vector<std::uint8_t> workspace(ISAL_DEF_LVL3_DEFAULT);
  const std::size_t before = out.size(), room = most_deflated(bytes.size());
  out.resize(before + room);
  isal_zstream stream;
  isal_deflate_init(&stream);
  stream.level = isal_level;
  stream.level_buf = workspace.data();
  stream.level_buf_size = static_cast<std::uint32_t>(workspace.size());
  stream.gzip_flag = IGZIP_ZLIB;
  stream.end_of_stream = 1;
  stream.next_in = const_cast<std::uint8_t*>(bytes.data());  // ISA-L only reads it
  stream.avail_in = static_cast<std::uint32_t>(bytes.size());
  stream.next_out = reinterpret_cast<std::uint8_t*>(out.data() + before);
  stream.avail_out = static_cast<std::uint32_t>(room);
  check(isal_deflate(&stream) == COMP_OK && stream.internal_state.state == ZSTATE_END,
        "deflate ends in its worst case");
  out.resize(before + stream.total_out);
}

}  // namespace mf
