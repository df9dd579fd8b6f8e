// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

namespace mf::test {

// The desk capture through the programs as a user runs them, once for all tests: import, photometry, calibrate,
// resample. Skips where the capture is absent.
class DeskRun : public testing::Test {
 protected:
  void SetUp() override;

  [[nodiscard]] static const std::filesystem::path& session();
  [[nodiscard]] static const std::filesystem::path& light_field();
  [[nodiscard]] static const nlohmann::json& summary(const std::string& command);  // what its --json printed
};

}  // namespace mf::test
