// SPDX-License-Identifier: Apache-2.0
#include "common/json_fault.h"

#include <gtest/gtest.h>

#include "tests/support/expect_input_error.h"

namespace mf {
namespace {

using test::contains;

TEST(JsonFault, NothingIsWrongWithJson) {
  EXPECT_FALSE(find_json_fault(R"([{"a": 1, "b": [1, 2.5e3, null, true, "NaN"]}, {}])"));
}

TEST(JsonFault, NamesTheValueTheLineAndTheColumn) {
  const auto fault = find_json_fault("[\n {\"frame\": \"a\", \"exposure_s\": 1},\n {\"exposure_s\": NaN}\n]");
  ASSERT_TRUE(fault);
  EXPECT_EQ(fault->field, "[1].exposure_s");
  EXPECT_EQ(fault->problem, "is NaN (line 3, column 17): give a finite number");
}

TEST(JsonFault, TellsNumbersThatAreNoneFromSyntax) {
  for (const char* number : {"NaN", "nan", "Infinity", "-Infinity", "inf", "1e999"}) {
    const auto fault = find_json_fault(std::string("{\"camera\": {\"gain\": ") + number + "}}");
    ASSERT_TRUE(fault) << number;
    EXPECT_EQ(fault->field, "camera.gain");
    EXPECT_TRUE(contains(fault->problem, "give a finite number")) << number;
  }
  const auto fault = find_json_fault("{\"a\": [1, 2, x]}");
  ASSERT_TRUE(fault);
  EXPECT_EQ(fault->field, "a[2]");
  EXPECT_TRUE(contains(fault->problem, "line 1, column 14, near 'x'"));
}

TEST(JsonFault, EveryTruncationIsAFault) {
  const std::string whole = R"([{"frame": "00000.png", "exposure_s": 0.01, "deep": {"list": [1, 2]}}])";
  for (std::size_t size = 0; size < whole.size(); ++size) EXPECT_TRUE(find_json_fault(whole.substr(0, size))) << size;
}

}  // namespace
}  // namespace mf
