// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

namespace mf {

// For std::unique_ptr over a C library's handle: std::unique_ptr<udev, FreeWith<udev_unref>>.
template <auto free>
struct FreeWith {
  template <typename T>
  void operator()(T* handle) const {
    free(handle);
  }
};

}  // namespace mf
