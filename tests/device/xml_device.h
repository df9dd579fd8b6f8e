// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>

typedef struct _ArvDevice ArvDevice;  // NOLINT(bugprone-reserved-identifier,modernize-use-using): Aravis' own name

namespace mf::test {

// A camera that is nothing but its GenICam description and memory: what is written is kept, all other bytes are
// `blank`. (Aravis' own fake device reads beyond its memory where a description points there.)
class XmlDevice {
 public:
  XmlDevice(std::string_view xml, std::uint8_t blank);
  ~XmlDevice();
  // nullptr when Aravis can't read the description.
  [[nodiscard]] ArvDevice* get() const { return device_; }

 private:
  ArvDevice* device_ = nullptr;
};

}  // namespace mf::test
