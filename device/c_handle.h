// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <unistd.h>

#include <memory>
#include <utility>

namespace mf {

// For std::unique_ptr over a C library's handle: std::unique_ptr<udev, FreeWith<udev_unref>>.
template <auto free>
struct FreeWith {
  template <typename T>
  void operator()(T* handle) const {
    free(handle);
  }
};

// An open file descriptor, or none (-1).
class OwnedFile {
 public:
  explicit OwnedFile(int file = -1) : file_(file) {}
  OwnedFile(OwnedFile&& other) noexcept : file_(std::exchange(other.file_, -1)) {}
  OwnedFile& operator=(OwnedFile&& other) noexcept {
    std::swap(file_, other.file_);
    return *this;
  }
  ~OwnedFile() {
    if (file_ >= 0) ::close(file_);
  }
  [[nodiscard]] int get() const { return file_; }

 private:
  int file_;
};

}  // namespace mf
