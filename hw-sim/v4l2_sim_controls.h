// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <linux/videodev2.h>

#include <cstdint>
#include <string>
#include <vector>

// Newer than Debian 12's headers.
#ifndef V4L2_CID_HDR_SENSOR_MODE
#define V4L2_CID_HDR_SENSOR_MODE (V4L2_CID_CAMERA_CLASS_BASE + 36)
#endif

namespace mf::sim {

// The simulated camera's controls: exposure with its automatic, gain, wide dynamic range, HDR sensor mode.
class V4l2SimControls {
 public:
  explicit V4l2SimControls(double exposure_s);

  // Each returns 0 or errno.
  [[nodiscard]] int query(v4l2_query_ext_ctrl&) const;
  [[nodiscard]] int query(v4l2_queryctrl&) const;
  [[nodiscard]] int query_menu(v4l2_querymenu&) const;
  [[nodiscard]] int get(v4l2_control&) const;
  [[nodiscard]] int set(v4l2_control&);
  [[nodiscard]] int get(v4l2_ext_controls&) const;
  [[nodiscard]] int set(v4l2_ext_controls&, bool keep);

  [[nodiscard]] double exposure_s() const;
  [[nodiscard]] std::int32_t value(std::uint32_t id) const;

 private:
  struct Control {
    std::uint32_t id = 0;
    std::uint32_t type = V4L2_CTRL_TYPE_INTEGER;
    std::string name;
    std::int32_t minimum = 0, maximum = 1, initial = 0;
    std::vector<std::string> entries;  // of a menu; "" is a hole
    std::int32_t value = 0;
  };
  [[nodiscard]] const Control* find(std::uint32_t id) const;
  [[nodiscard]] int check(const Control&, std::int32_t value) const;
  [[nodiscard]] bool inactive(const Control&) const;

  std::vector<Control> controls_;  // by id
};

}  // namespace mf::sim
