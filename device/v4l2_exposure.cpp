// SPDX-License-Identifier: Apache-2.0
#include "device/v4l2_exposure.h"

#include <fmt/format.h>

#include <cmath>

#include "common/error.h"

namespace mf {

namespace {

struct ExposureControl {
  std::uint32_t id = 0;
  std::string name;
  double step_s = 0;
};

ExposureControl exposure_control(const V4l2Controls& controls, const std::string& camera, int line_px) {
  if (const auto name = controls.name_of(V4L2_CID_EXPOSURE_ABSOLUTE))
    return {V4L2_CID_EXPOSURE_ABSOLUTE, *name, 100e-6};
  const auto name = controls.name_of(V4L2_CID_EXPOSURE);
  const auto rate = controls.value(V4L2_CID_PIXEL_RATE), blanking = controls.value(V4L2_CID_HBLANK);
  if (name && rate.value_or(0) > 0 && blanking)
    return {V4L2_CID_EXPOSURE, *name, static_cast<double>(line_px + *blanking) / static_cast<double>(*rate)};
  throw InputError(camera, "exposure_s",
                   name ? "its control exposure has no unit (it tells no pixel_rate and horizontal_blanking): "
                          "its frames could not be compared; choose another camera or driver"
                        : "it has no control of its exposure time: its frames could not be compared; choose another "
                          "camera");
}

std::optional<std::string> gain_control(const V4l2Controls& controls) {
  for (const std::uint32_t id : {V4L2_CID_ANALOGUE_GAIN, V4L2_CID_GAIN})
    if (auto name = controls.name_of(id)) return name;
  return std::nullopt;
}

}  // namespace

void set_v4l2_exposure(V4l2Controls& controls, const std::string& camera, double exposure_s, int line_px) {
  if (const auto automatic = controls.name_of(V4L2_CID_EXPOSURE_AUTO))
    controls.set_number(*automatic, V4L2_EXPOSURE_MANUAL);
  const ExposureControl control = exposure_control(controls, camera, line_px);
  const auto range = controls.description(control.id);
  const double steps = exposure_s / control.step_s;
  // Half a step is what rounding may change.
  if (range &&
      !(steps >= static_cast<double>(range->minimum) - 0.5 && steps <= static_cast<double>(range->maximum) + 0.5))
    throw InputError(camera, "exposure_s",
                     fmt::format("{} s lies outside of what the camera takes, {:g} to {:g} s: choose another",
                                 exposure_s, static_cast<double>(range->minimum) * control.step_s,
                                 static_cast<double>(range->maximum) * control.step_s));
  controls.set_number(control.name, std::round(steps));
}

double v4l2_exposure_s(const V4l2Controls& controls, const std::string& camera, int line_px) {
  const ExposureControl control = exposure_control(controls, camera, line_px);
  const double exposure_s = controls.number(control.name) * control.step_s;
  if (!(exposure_s > 0)) throw InputError(camera, "exposure_s", "the camera tells none: set it");
  return exposure_s;
}

void set_v4l2_gain(V4l2Controls& controls, const std::string& camera, double gain_db,
                   const std::optional<double>& step_db) {
  const auto name = gain_control(controls);
  if (!name) throw InputError(camera, "gain_db", "the camera has no gain: leave it out");
  if (!step_db)
    throw InputError(camera, "gain_step_db",
                     fmt::format("is missing: V4L2 does not tell how many decibels a step of {} is; the camera's "
                                 "description does",
                                 *name));
  if (const auto automatic = controls.name_of(V4L2_CID_AUTOGAIN)) controls.set_number(*automatic, 0);
  controls.set_number(*name, std::round(gain_db / *step_db));
}

double v4l2_gain_db(const V4l2Controls& controls, const std::optional<double>& step_db) {
  const auto name = gain_control(controls);
  return name && step_db ? controls.number(*name) * *step_db : 0;
}

}  // namespace mf
