// SPDX-License-Identifier: Apache-2.0
#include "common/sensor_response.h"

#include <algorithm>
#include <cmath>

#include "common/check.h"

namespace mf {

namespace {

constexpr double linlog_charge_per_e = 0.03;        // s
constexpr double linlog_strongest_lowering = 0.95;  // of the level, at value 1: some of the dark part stays linear

double charge_after(const LinearSensor& /*sensor*/, double light) {
  return std::min(light, 1.0);
}

double charge_after(const MultiSlopeSensor& sensor, double light) {
  double charge = 0, time = 0;
  for (const SlopeKnee& knee : sensor.knees) {
    charge = std::min(charge + light * (knee.time - time), knee.level);
    time = knee.time;
  }
  return std::min(charge + light * (1 - time), 1.0);
}

// With w = exp(−q / s) the pixel's equation is linear: dw/dt = (a − (light + a) w) / s.
double leak(double charge, double light, double value, double duration) {
  if (!(value > 0)) return std::min(charge + light * duration, 1.0);
  const double s = linlog_charge_per_e;
  const double a = std::exp(-(1 - linlog_strongest_lowering * value) / s);
  const double decay = (light + a) * duration / s;
  const double w = std::exp(-charge / s) * std::exp(-decay) - a / (light + a) * std::expm1(-decay);
  return std::clamp(-s * std::log(w), 0.0, 1.0);
}

double charge_after(const LinLogSensor& sensor, double light) {
  double charge = leak(0, light, sensor.value_1, sensor.time_1);
  charge = leak(charge, light, sensor.value_2, sensor.time_2 - sensor.time_1);
  return leak(charge, light, 0, 1 - sensor.time_2);
}

std::string fault_in(const LinearSensor& /*sensor*/) {
  return {};
}

std::string fault_in(const MultiSlopeSensor& sensor) {
  if (sensor.knees.empty()) return "has no knee";
  double time = 0, level = 0;
  for (const SlopeKnee& knee : sensor.knees) {
    if (!(knee.time > time && knee.time < 1)) return "the knees' times must rise within the exposure";
    if (!(knee.level > level && knee.level < 1)) return "the knees' levels must rise below a full pixel";
    time = knee.time;
    level = knee.level;
  }
  return {};
}

std::string fault_in(const LinLogSensor& sensor) {
  const auto is_share = [](double v) { return v >= 0 && v <= 1; };
  if (!is_share(sensor.value_1) || !is_share(sensor.value_2)) return "the values must lie from 0 to 1";
  if (!is_share(sensor.time_1) || !is_share(sensor.time_2) || sensor.time_1 > sensor.time_2)
    return "the times must rise within the exposure";
  return {};
}

double light_above(const SensorResponse& sensor, double charge, double low) {
  double high = std::max(1.01 * low, 1e-9);
  while (high < brightest_light && charge_of(sensor, high) < charge) high *= 2;
  high = std::min(high, brightest_light);
  constexpr int halvings = 50;  // of a factor of 2: to the last bits of a double
  for (int i = 0; i < halvings; ++i) {
    const double middle = 0.5 * (low + high);
    (charge_of(sensor, middle) < charge ? low : high) = middle;
  }
  return high;
}

}  // namespace

std::string fault_of(const SensorResponse& sensor) {
  return std::visit([](const auto& s) { return fault_in(s); }, sensor);
}

double charge_of(const SensorResponse& sensor, double light) {
  return std::visit([&](const auto& s) { return charge_after(s, light); }, sensor);
}

double light_of(const SensorResponse& sensor, double charge) {
  return charge > 0 ? light_above(sensor, charge, 0) : 0;
}

ResponseCurve sensor_response(const SensorResponse& sensor, int bits, double black_level, double full_pixel,
                              int channels) {
  ResponseCurve curve = linear_response(bits, black_level, full_pixel, channels);
  if (std::holds_alternative<LinearSensor>(sensor)) return curve;
  check(fault_of(sensor).empty(), "a sensor's response has no fault");
  const double range = std::exp2(bits) - 1 - black_level;
  std::vector<double> exposure(curve.channels.front().exposure.size());
  double light = 0;
  for (std::size_t code = 0; code < exposure.size(); ++code) {
    const double charge = (static_cast<double>(code) - black_level) / range;
    if (charge > 0 && light < brightest_light) light = light_above(sensor, charge, light);
    exposure[code] = light * full_pixel;
  }
  for (ResponseChannel& channel : curve.channels) channel.exposure = exposure;
  curve.saturation_code =
      std::min(curve.saturation_code, std::floor(black_level + range * charge_of(sensor, brightest_light)));
  return curve;
}

}  // namespace mf
