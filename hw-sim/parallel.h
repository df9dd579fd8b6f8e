// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

namespace mf::sim {

// body(i) for every i in [first, last), on every core, in any order. The body must not throw.
template <typename Body>
void parallel_for(int first, int last, const Body& body) {
  std::atomic<int> next = first;
  const auto work = [&] {
    for (int i = next++; i < last; i = next++) body(i);
  };
  std::vector<std::jthread> others;
  for (unsigned t = 1; t < std::max(1U, std::thread::hardware_concurrency()); ++t) others.emplace_back(work);
  work();
}

}  // namespace mf::sim
