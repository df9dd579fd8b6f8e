// SPDX-License-Identifier: Apache-2.0
#include "hw-sim/v4l2_sim_controls.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>

namespace mf::sim {

namespace {

constexpr double exposure_step_s = 100e-6;

void copy_name(void* target, std::size_t size, const std::string& name) {
  std::memset(target, 0, size);
  std::memcpy(target, name.data(), std::min(name.size(), size - 1));
}

}  // namespace

V4l2SimControls::V4l2SimControls(double exposure_s) {
  const auto steps = static_cast<std::int32_t>(std::lround(exposure_s / exposure_step_s));
  controls_ = {
      {V4L2_CID_GAIN, V4L2_CTRL_TYPE_INTEGER, "Gain", 0, 240, 0, {}},
      {V4L2_CID_EXPOSURE_AUTO,
       V4L2_CTRL_TYPE_MENU,
       "Auto Exposure",
       0,
       3,
       V4L2_EXPOSURE_APERTURE_PRIORITY,
       {"", "Manual Mode", "", "Aperture Priority Mode"}},
      {V4L2_CID_EXPOSURE_ABSOLUTE, V4L2_CTRL_TYPE_INTEGER, "Exposure Time, Absolute", 1, 10000, steps, {}},
      {V4L2_CID_WIDE_DYNAMIC_RANGE, V4L2_CTRL_TYPE_BOOLEAN, "Wide Dynamic Range", 0, 1, 0, {}},
      {V4L2_CID_HDR_SENSOR_MODE, V4L2_CTRL_TYPE_MENU, "HDR Sensor Mode", 0, 2, 0, {"Off", "Two Slopes", "DOL"}},
  };
  std::sort(controls_.begin(), controls_.end(), [](const Control& a, const Control& b) { return a.id < b.id; });
  for (Control& control : controls_) control.value = control.initial;
}

const V4l2SimControls::Control* V4l2SimControls::find(std::uint32_t id) const {
  const auto found = std::find_if(controls_.begin(), controls_.end(), [&](const Control& c) { return c.id == id; });
  return found == controls_.end() ? nullptr : &*found;
}

bool V4l2SimControls::inactive(const Control& control) const {
  return control.id == V4L2_CID_EXPOSURE_ABSOLUTE && value(V4L2_CID_EXPOSURE_AUTO) != V4L2_EXPOSURE_MANUAL;
}

int V4l2SimControls::query(v4l2_query_ext_ctrl& q) const {
  constexpr std::uint32_t next = V4L2_CTRL_FLAG_NEXT_CTRL | V4L2_CTRL_FLAG_NEXT_COMPOUND;
  const Control* control = find(q.id);
  if ((q.id & next) != 0) {
    const std::uint32_t after = q.id & ~next;
    const auto found = std::find_if(controls_.begin(), controls_.end(), [&](const Control& c) { return c.id > after; });
    control = found == controls_.end() ? nullptr : &*found;
  }
  if (control == nullptr) return EINVAL;
  q = {};
  q.id = control->id;
  q.type = control->type;
  copy_name(q.name, sizeof q.name, control->name);
  q.minimum = control->minimum;
  q.maximum = control->maximum;
  q.step = 1;
  q.default_value = control->initial;
  q.flags = inactive(*control) ? V4L2_CTRL_FLAG_INACTIVE : 0;
  q.elem_size = sizeof(std::int32_t);
  q.elems = 1;
  return 0;
}

int V4l2SimControls::query(v4l2_queryctrl& q) const {
  v4l2_query_ext_ctrl wide{};
  wide.id = q.id;
  if (const int error = query(wide); error != 0) return error;
  q = {};
  q.id = wide.id;
  q.type = wide.type;
  std::memcpy(q.name, wide.name, sizeof q.name);
  q.minimum = static_cast<std::int32_t>(wide.minimum);
  q.maximum = static_cast<std::int32_t>(wide.maximum);
  q.step = 1;
  q.default_value = static_cast<std::int32_t>(wide.default_value);
  q.flags = wide.flags;
  return 0;
}

int V4l2SimControls::query_menu(v4l2_querymenu& item) const {
  const Control* control = find(item.id);
  if (control == nullptr || item.index >= control->entries.size() || control->entries[item.index].empty())
    return EINVAL;
  copy_name(item.name, sizeof item.name, control->entries[item.index]);
  return 0;
}

int V4l2SimControls::check(const Control& control, std::int32_t value) const {
  if (value < control.minimum || value > control.maximum) return ERANGE;
  const bool hole = !control.entries.empty() && control.entries[static_cast<std::size_t>(value)].empty();
  if (hole) return EINVAL;
  return inactive(control) ? EACCES : 0;
}

int V4l2SimControls::get(v4l2_control& c) const {
  const Control* control = find(c.id);
  if (control == nullptr) return EINVAL;
  c.value = control->value;
  return 0;
}

int V4l2SimControls::set(v4l2_control& c) {
  v4l2_ext_control one{};
  one.id = c.id;
  one.value = c.value;
  v4l2_ext_controls list{};
  list.count = 1;
  list.controls = &one;
  return set(list, true);
}

int V4l2SimControls::get(v4l2_ext_controls& list) const {
  for (std::uint32_t i = 0; i < list.count; ++i) {
    const Control* control = find(list.controls[i].id);
    list.error_idx = i;
    if (control == nullptr) return EINVAL;
    list.controls[i].value = list.which == V4L2_CTRL_WHICH_DEF_VAL ? control->initial : control->value;
  }
  return 0;
}

int V4l2SimControls::set(v4l2_ext_controls& list, bool keep) {
  for (std::uint32_t i = 0; i < list.count; ++i) {
    const auto found =
        std::find_if(controls_.begin(), controls_.end(), [&](const Control& c) { return c.id == list.controls[i].id; });
    list.error_idx = i;
    if (found == controls_.end()) return EINVAL;
    if (const int error = check(*found, list.controls[i].value); error != 0) return error;
    if (keep) found->value = list.controls[i].value;
  }
  return 0;
}

double V4l2SimControls::exposure_s() const {
  return value(V4L2_CID_EXPOSURE_ABSOLUTE) * exposure_step_s;
}

std::int32_t V4l2SimControls::value(std::uint32_t id) const {
  const Control* control = find(id);
  return control == nullptr ? 0 : control->value;
}

}  // namespace mf::sim
