// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arv.h>
#include <fmt/format.h>

#include <memory>
#include <string>
#include <utility>

#include "common/error.h"

namespace mf {

struct ObjectRelease {
  void operator()(void* object) const { g_object_unref(object); }
};
template <typename T>
using GObjectPointer = std::unique_ptr<T, ObjectRelease>;

// Receives Aravis' error and turns it into ours.
class Failure {
 public:
  Failure(std::string camera, std::string field) : camera_(std::move(camera)), field_(std::move(field)) {}
  Failure(const Failure&) = delete;
  Failure& operator=(const Failure&) = delete;
  ~Failure() { g_clear_error(&error_); }
  operator GError**() { return &error_; }  // NOLINT(google-explicit-constructor): stands where Aravis wants a GError**

  void raise_if_any(const std::string& remedy) const {
    if (error_ != nullptr) throw InputError(camera_, field_, fmt::format("{}: {}", error_->message, remedy));
  }

 private:
  std::string camera_;
  std::string field_;
  GError* error_ = nullptr;
};

[[nodiscard]] inline std::string text_or_empty(const char* text) {
  return text == nullptr ? std::string() : std::string(text);
}

}  // namespace mf
