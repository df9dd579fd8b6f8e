// SPDX-License-Identifier: Apache-2.0
#include "common/literal_deflate.h"

#include <isa-l/igzip_lib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstring>
#include <numeric>
#include <vector>

#include "common/check.h"

namespace mf {

namespace {

static_assert(std::endian::native == std::endian::little, "values and bits are stored as they lie in memory");

constexpr std::size_t symbols = 257;  // 256 literals and the end of the block
constexpr std::size_t end_of_block = 256;
constexpr int longest_code = 13;  // four of them, and the seven bits that wait, fit the 64 bits of BitSink

using Counts = std::array<std::uint32_t, symbols>;
using CodeLengths = std::array<std::uint8_t, symbols>;

struct Code {
  std::uint16_t bits = 0;  // the first one lowest, as deflate wants it
  std::uint16_t length = 0;
};
using Codes = std::array<Code, symbols>;

// How often each byte comes, from a stretch of every eight; none is left out, as each needs a code.
Counts sampled_counts(std::span<const std::uint16_t> values) {
  constexpr std::size_t stretch = 256, each = 8;
  std::array<Counts, 4> counts{};  // four: equal bytes in a row would wait for each other's count
  for (std::size_t begin = 0; begin < values.size(); begin += each * stretch) {
    const std::size_t end = std::min(begin + stretch, values.size());
    for (std::size_t i = begin; i + 1 < end; i += 2) {
      ++counts[0][values[i] & 0xFFU];
      ++counts[1][values[i] >> 8U];
      ++counts[2][values[i + 1] & 0xFFU];
      ++counts[3][values[i + 1] >> 8U];
    }
  }
  Counts sum;
  for (std::size_t s = 0; s < symbols; ++s)
    sum[s] = 1 + static_cast<std::uint32_t>(each) * (counts[0][s] + counts[1][s] + counts[2][s] + counts[3][s]);
  return sum;
}

// The lengths of Huffman's code, in two queues of which each is sorted: the symbols, and the sums made so far.
CodeLengths huffman_lengths(const Counts& counts) {
  std::array<std::uint16_t, symbols> leaves;
  std::iota(leaves.begin(), leaves.end(), std::uint16_t{0});
  std::sort(leaves.begin(), leaves.end(), [&](auto a, auto b) { return counts[a] < counts[b]; });
  std::array<std::uint64_t, 2 * symbols - 1> weights{};
  std::copy(counts.begin(), counts.end(), weights.begin());
  std::array<std::size_t, 2 * symbols - 1> parents{};
  std::size_t leaf = 0, inner = symbols;
  for (std::size_t made = symbols; made < weights.size(); ++made)
    for (int child = 0; child < 2; ++child) {
      const bool sum_is_less = inner < made && (leaf == symbols || weights[inner] < weights[leaves[leaf]]);
      const std::size_t least = sum_is_less ? inner++ : leaves[leaf++];
      weights[made] += weights[least];
      parents[least] = made;
    }
  std::array<std::uint8_t, 2 * symbols - 1> depths{};  // the root is the last
  for (std::size_t node = depths.size() - 1; node-- > 0;)
    depths[node] = static_cast<std::uint8_t>(depths[parents[node]] + 1);
  CodeLengths lengths;
  std::copy_n(depths.begin(), symbols, lengths.begin());
  return lengths;
}

// Counts halved often enough are all 1, and need nine bits.
CodeLengths limited_lengths(Counts counts) {
  CodeLengths lengths = huffman_lengths(counts);
  while (*std::max_element(lengths.begin(), lengths.end()) > longest_code) {
    for (std::uint32_t& count : counts) count = (count + 1) / 2;
    lengths = huffman_lengths(counts);
  }
  return lengths;
}

unsigned reversed(unsigned bits, int length) {
  unsigned turned = 0;
  for (int i = 0; i < length; ++i) turned = turned << 1U | (bits >> static_cast<unsigned>(i) & 1U);
  return turned;
}

// RFC 1951, 3.2.2: among codes of one length those of lower symbols come first.
Codes canonical_codes(const CodeLengths& lengths) {
  Codes codes;
  unsigned next = 0;
  for (int length = 1; length <= longest_code; ++length, next <<= 1U)
    for (std::size_t s = 0; s < symbols; ++s)
      if (lengths[s] == length)
        codes[s] = {static_cast<std::uint16_t>(reversed(next++, length)), static_cast<std::uint16_t>(length)};
  return codes;
}

// Bits into memory, the lowest first. Writes up to seven bytes beyond what it has put.
class BitSink {
 public:
  explicit BitSink(char* to) : to_(to) {}
  void add(unsigned bits, unsigned length) {
    waiting_ |= std::uint64_t{bits} << length_;
    length_ += length;
  }
  // Before more than 64 bits wait.
  void flush() {
    std::memcpy(to_, &waiting_, sizeof waiting_);
    to_ += length_ >> 3U;
    waiting_ >>= length_ & 56U;
    length_ &= 7U;
  }
  void put(unsigned bits, unsigned length) {
    add(bits, length);
    flush();
  }
  [[nodiscard]] char* finish() { return length_ > 0 ? to_ + 1 : to_; }

 private:
  char* to_;
  std::uint64_t waiting_ = 0;
  unsigned length_ = 0;
};

// RFC 1951, 3.2.7. The lengths are given as they are, in four bits each: they are 130 bytes.
void put_block_header(BitSink& sink, const CodeLengths& lengths) {
  sink.put(1, 1);  // the last block
  sink.put(2, 2);  // with codes of its own
  sink.put(symbols - 257, 5);
  sink.put(2 - 1, 5);  // two distances of one bit each, unused: not every inflater takes none
  constexpr std::array<int, 19> order{16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15};
  sink.put(order.size() - 4, 4);
  for (const int length : order) sink.put(length < 16 ? 4 : 0, 3);
  for (const std::uint8_t length : lengths) sink.put(reversed(length, 4), 4);
  for (int distance = 0; distance < 2; ++distance) sink.put(reversed(1, 4), 4);
}

void put_literals(BitSink& into, std::span<const std::uint16_t> values, const Codes& codes) {
  BitSink sink = into;  // in registers
  const auto add = [&](std::uint16_t value) {
    const Code low = codes[value & 0xFFU], high = codes[value >> 8U];
    sink.add(low.bits, low.length);
    sink.add(high.bits, high.length);
  };
  std::size_t i = 0;
  for (; i + 1 < values.size(); i += 2) {
    add(values[i]);
    add(values[i + 1]);
    sink.flush();
  }
  if (i < values.size()) {
    add(values[i]);
    sink.flush();
  }
  into = sink;
}

}  // namespace

void append_deflated_literals(std::span<const std::uint16_t> values, std::string& out) {
  constexpr std::size_t beside_literals = 256;  // header and end, and where BitSink writes beyond
  thread_local std::vector<char> workspace;     // as long as the worst case, and never cleared
  workspace.resize(std::max(workspace.size(), values.size_bytes() * longest_code / 8 + beside_literals));
  const CodeLengths lengths = limited_lengths(sampled_counts(values));
  const Codes codes = canonical_codes(lengths);
  BitSink sink(workspace.data());
  sink.put(0x0178, 16);  // RFC 1950: deflate, a window of 32 KB, made fast
  put_block_header(sink, lengths);
  put_literals(sink, values, codes);
  sink.put(codes[end_of_block].bits, codes[end_of_block].length);
  out.append(workspace.data(), sink.finish());
  const std::uint32_t sum = isal_adler32(1, reinterpret_cast<const unsigned char*>(values.data()), values.size_bytes());
  for (const unsigned shift : {24U, 16U, 8U, 0U}) out.push_back(static_cast<char>(sum >> shift));
}

}  // namespace mf
