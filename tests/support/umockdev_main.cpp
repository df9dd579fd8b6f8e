// SPDX-License-Identifier: Apache-2.0
// As tests/main.cpp, for programs with simulated devices: starts itself again with umockdev's preload library. Where
// that is missing the tests find has_umockdev() false and skip.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

namespace {

void start_again_with_umockdev(char** argv) {
  constexpr const char* library = "libumockdev-preload.so.0";
  const char* given = std::getenv("LD_PRELOAD");
  const std::string before = given == nullptr ? "" : given;
  if (before.find(library) != std::string::npos) return;  // it has, or in vain
  ::setenv("LD_PRELOAD", before.empty() ? library : (before + ":" + library).c_str(), 1);
  ::setenv("ASAN_OPTIONS", "verify_asan_link_order=0", 0);  // the sanitizer wants to be first
  ::execv("/proc/self/exe", argv);
}

}  // namespace

int main(int argc, char** argv) {
  start_again_with_umockdev(argv);
  testing::InitGoogleTest(&argc, argv);
  const int failed = RUN_ALL_TESTS();
  const testing::UnitTest& all = *testing::UnitTest::GetInstance();
  const bool only_skips = all.skipped_test_count() > 0 && all.successful_test_count() == 0;
  return failed == 0 && only_skips ? 77 : failed;
}
