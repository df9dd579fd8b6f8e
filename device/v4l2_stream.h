// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <linux/videodev2.h>

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "device/v4l2_device.h"

namespace mf {

// The buffers that a V4L2 driver fills and we map. One thread at a time.
class V4l2Stream {
 public:
  // Takes the camera for us. Throws InputError: another program has it, too little memory.
  explicit V4l2Stream(const V4l2Device&);  // which must outlive it
  V4l2Stream(const V4l2Stream&) = delete;
  V4l2Stream& operator=(const V4l2Stream&) = delete;
  ~V4l2Stream();

  void start();  // throws InputError

  enum class Wait { filled, nothing, lost };
  // Until a buffer is filled, which then is filled(). The one before goes back to the driver first. After `lost`
  // nothing is asked of the driver any more.
  [[nodiscard]] Wait wait(std::chrono::milliseconds at_most);
  [[nodiscard]] const v4l2_buffer& filled() const { return *filled_; }
  [[nodiscard]] std::span<const std::uint8_t> bytes() const;  // of filled(), as many as the driver used

  // Gives filled() back early, so that the driver has it while nobody waits.
  void release();

 private:
  struct Mapping {
    void* address = nullptr;
    std::size_t length = 0;
  };
  void map(std::uint32_t index);
  [[nodiscard]] int queue(std::uint32_t index) const;  // 0 or errno
  [[nodiscard]] int take();                            // 0 or errno

  const V4l2Device* device_;
  std::vector<Mapping> mappings_;
  std::optional<v4l2_buffer> filled_;
  bool started_ = false;
  bool lost_ = false;
};

}  // namespace mf
