// SPDX-License-Identifier: Apache-2.0
// A target's seeds, whole and mutated, without libFuzzer. It finds less, but runs everywhere and always.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "tests/fuzz/fuzz_target.h"
#include "tests/support/full_counts.h"

namespace mf::fuzz {
namespace {

void run(const std::string& input) {
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(input.data());
  ASSERT_NO_THROW(fuzz_target().run({bytes, input.size()}));
}

std::size_t below(std::size_t end, std::mt19937& random) {
  return std::uniform_int_distribution<std::size_t>(0, end - 1)(random);
}

// One change of the kinds that damage and hostile input make.
void mutate(std::string& input, std::mt19937& random) {
  if (input.empty()) return;
  const std::size_t at = below(input.size(), random);
  const std::size_t length = 1 + below(std::min<std::size_t>(input.size() - at, 64), random);
  switch (below(6, random)) {
    case 0:
      input[at] = static_cast<char>(input[at] ^ 1 << below(8, random));
      return;
    case 1:
      input[at] = static_cast<char>(below(256, random));
      return;
    case 2:
      std::fill_n(input.begin() + static_cast<std::ptrdiff_t>(at), length, below(2, random) == 0 ? '\0' : '\xFF');
      return;
    case 3:
      input.erase(at, length);
      return;
    case 4:
      input.insert(at, input.substr(below(input.size(), random), length));
      return;
    default:
      input.resize(at);
  }
}

TEST(Fuzz, SeedsAreReadAndMutationsSurvived) {
  const std::vector<std::string> seeds = fuzz_target().seeds();
  ASSERT_FALSE(seeds.empty());
  for (const std::string& seed : seeds) run(seed);
  std::mt19937 random(1);
  const int inputs = test::repetitions(1500, 100'000);
  for (int i = 0; i < inputs && !HasFatalFailure(); ++i) {
    std::string input = seeds[below(seeds.size(), random)];
    for (std::size_t changes = 1 + below(4, random); changes > 0; --changes) mutate(input, random);
    run(input);
  }
}

}  // namespace
}  // namespace mf::fuzz
