// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <optional>
#include <utility>
#include <variant>

#include "host/gl/egl_context.h"

namespace mf::test {

// Tests that draw: each with a context of its own, and skipped where there is no OpenGL.
class GlTest : public testing::Test {
 protected:
  void SetUp() override {
    auto opened = EglContext::open();
    if (const auto* missing = std::get_if<GlUnavailable>(&opened)) GTEST_SKIP() << "no OpenGL: " << missing->reason;
    context_.emplace(std::get<EglContext>(std::move(opened)));
  }

  std::optional<EglContext> context_;
};

}  // namespace mf::test
