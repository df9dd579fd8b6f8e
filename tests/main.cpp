// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

// As gtest_main, but a program whose tests were all skipped exits with 77, which ctest shows as skipped.
int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  const int failed = RUN_ALL_TESTS();
  const testing::UnitTest& all = *testing::UnitTest::GetInstance();
  const bool only_skips = all.skipped_test_count() > 0 && all.successful_test_count() == 0;
  return failed == 0 && only_skips ? 77 : failed;
}
