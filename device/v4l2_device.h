// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <utility>

namespace mf {

// One open V4L2 device node, non-blocking. Owns the descriptor.
class V4l2Device {
 public:
  // `node` may be a link. Throws InputError naming the node and the remedy: no such device, no permission, another
  // program has it.
  explicit V4l2Device(const std::string& node);
  V4l2Device(const V4l2Device&) = delete;
  V4l2Device& operator=(const V4l2Device&) = delete;
  ~V4l2Device();

  [[nodiscard]] const std::string& node() const { return node_; }      // as it was asked for
  [[nodiscard]] const std::string& target() const { return target_; }  // what a link leads to, else the same
  [[nodiscard]] int descriptor() const { return descriptor_; }

  // 0 or errno. Goes on after signals.
  [[nodiscard]] int control(unsigned long request, void* argument) const;
  // The same, but an errno throws InputError(node, field, its text and the remedy).
  void demand(unsigned long request, void* argument, const std::string& field, const std::string& remedy) const;

 private:
  std::string node_, target_;
  int descriptor_;
};

}  // namespace mf
