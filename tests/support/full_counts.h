// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>

namespace mf::test {

// How often a test that repeats itself does so: `quick`, or `full` in the tests labelled long (mf_add_long_test).
inline int repetitions(int quick, int full) {
  return std::getenv("MIRRORFIELD_FULL_COUNTS") == nullptr ? quick : full;
}

}  // namespace mf::test
