// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace mf {

// Appends `values`, the lower byte first, as one zlib stream (RFC 1950) of one block: literals only, in a Huffman code
// made for them (RFC 1951, 3.2.7). Sensor noise hardly repeats itself: to look for repetitions, as append_deflated()
// does, takes three times as long and makes it a twelfth smaller. A byte costs at least one bit, so what does repeat
// itself is better left to append_deflated().
//
// The code is made from every eighth stretch of the values: where these mislead, a byte costs at most 13 bits. Safe in
// many threads.
void append_deflated_literals(std::span<const std::uint16_t> values, std::string& out);

}  // namespace mf
