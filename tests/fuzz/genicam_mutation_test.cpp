// SPDX-License-Identifier: Apache-2.0
// The description's target without libFuzzer.
#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <random>

#include "tests/fuzz/fuzz_target.h"

namespace mf::fuzz {
namespace {

using Bytes = std::vector<std::uint8_t>;

void mutate(Bytes& input, std::mt19937& random) {
  const auto below = [&](std::size_t end) { return std::uniform_int_distribution<std::size_t>(0, end - 1)(random); };
  const auto at = static_cast<std::ptrdiff_t>(below(input.size()));
  const auto length = std::min<std::ptrdiff_t>(1 + static_cast<std::ptrdiff_t>(below(40)), std::ssize(input) - at);
  switch (below(4)) {
    case 0:
      input[below(input.size())] ^= static_cast<std::uint8_t>(1U << below(8));
      return;
    case 1:
      if (length < std::ssize(input)) input.erase(input.begin() + at, input.begin() + at + length);
      return;
    case 2: {
      const Bytes copy(input.begin() + at, input.begin() + at + length);
      input.insert(input.begin() + static_cast<std::ptrdiff_t>(below(input.size())), copy.begin(), copy.end());
      return;
    }
    default:
      input[below(input.size())] = static_cast<std::uint8_t>('0' + below(10));
  }
}

TEST(FuzzGenicam, SeedsAndMutationsAreSurvived) {
  const FuzzTarget target = fuzz_target();
  const std::vector<std::string> seeds = target.seeds();
  const auto run = [&](const Bytes& input) {
    ASSERT_NO_THROW(target.run(input)) << std::string(input.begin(), input.end());
  };
  for (const std::string& seed : seeds) run({seed.begin(), seed.end()});
  std::mt19937 random(1);
  for (int i = 0; i < 400 && !HasFatalFailure(); ++i) {
    const std::string& seed = seeds[static_cast<std::size_t>(i) % seeds.size()];
    Bytes input(seed.begin(), seed.end());
    for (int changes = 1 + i % 4; changes > 0; --changes) mutate(input, random);
    run(input);
  }
}

}  // namespace
}  // namespace mf::fuzz
