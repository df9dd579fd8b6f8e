// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace mf::fuzz {

// What reads bytes from outside. Each target is one source file that defines fuzz_target(); mf_add_fuzz_target makes
// two programs of it: test_fuzz_NAME mutates the seeds with any compiler, fuzz_NAME (preset fuzz, clang) is libFuzzer.
struct FuzzTarget {
  // Input that is refused as it should be returns; whatever else goes wrong must throw, abort or be a sanitizer's.
  void (*run)(std::span<const std::uint8_t>);
  // Good input to start from, made when the program runs.
  std::vector<std::string> (*seeds)();
};

[[nodiscard]] FuzzTarget fuzz_target();

}  // namespace mf::fuzz
