// SPDX-License-Identifier: Apache-2.0
#include "common/sensor_response.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mf {
namespace {

const MultiSlopeSensor two_knees{{{0.9, 0.5}, {0.99, 0.75}}};
const LinLogSensor constant_voltage{0.5, 0.5, 1, 1};
const LinLogSensor three_phases{0.7, 0.5, 0.85, 0.97};

// The pixel's own equation in small steps, which knows nothing of the closed form.
double integrated_linlog(const LinLogSensor& sensor, double light) {
  constexpr int steps = 200'000;
  double q = 0;
  for (int i = 0; i < steps; ++i) {
    const double t = (i + 0.5) / steps;
    const double value = t < sensor.time_1 ? sensor.value_1 : t < sensor.time_2 ? sensor.value_2 : 0;
    const double leak = value > 0 ? std::exp(-(1 - 0.95 * value) / 0.03) * (std::exp(q / 0.03) - 1) : 0;
    q += (light - leak) / steps;
  }
  return std::min(q, 1.0);
}

TEST(SensorResponse, MultiSlopeIsThePolygonOfItsKnees) {
  // Slopes of charge over light: 1, then 1 − t₁ above light = s₁/t₁, then 1 − t₂ above (s₂ − s₁)/(t₂ − t₁).
  EXPECT_NEAR(charge_of(two_knees, 0.5), 0.5, 1e-12);
  EXPECT_NEAR(charge_of(two_knees, 0.5 / 0.9), 0.5 / 0.9, 1e-12);
  EXPECT_NEAR(charge_of(two_knees, 2), 0.5 + 2 * 0.1, 1e-12);
  EXPECT_NEAR(charge_of(two_knees, 0.25 / 0.09), 0.5 + 0.1 * 0.25 / 0.09, 1e-12);
  EXPECT_NEAR(charge_of(two_knees, 10), 0.75 + 10 * 0.01, 1e-12);
  EXPECT_NEAR(charge_of(two_knees, 25), 1, 1e-12);
  EXPECT_NEAR(charge_of(two_knees, 1e6), 1, 0);
}

TEST(SensorResponse, LinLogSolvesThePixelsEquation) {
  for (const LinLogSensor& sensor : {constant_voltage, three_phases, LinLogSensor{0.8, 0.6, 0.9, 1}})
    for (const double light : {0.01, 0.3, 1.0, 5.0, 60.0})
      EXPECT_NEAR(charge_of(sensor, light), integrated_linlog(sensor, light), 2e-4) << light;
}

TEST(SensorResponse, LinLogIsLinearInTheDarkAndLogarithmicInTheLight) {
  EXPECT_NEAR(charge_of(constant_voltage, 0.2) / 0.2, 1, 1e-3);
  // Equal ratios of light are equal steps of charge: s · ln 10.
  EXPECT_NEAR(charge_of(constant_voltage, 1e4) - charge_of(constant_voltage, 1e3), 0.03 * std::log(10), 1e-4);
  EXPECT_NEAR(charge_of(constant_voltage, 1e3) - charge_of(constant_voltage, 1e2), 0.03 * std::log(10), 1e-4);
}

TEST(SensorResponse, ChargeNeverFallsAndLightOfInvertsIt) {
  for (const SensorResponse& sensor : {SensorResponse{LinearSensor{}}, SensorResponse{two_knees},
                                       SensorResponse{constant_voltage}, SensorResponse{three_phases}}) {
    double before = 0;
    for (double light = 1e-6; light < 1e7; light *= 1.3) {
      const double charge = charge_of(sensor, light);
      EXPECT_GE(charge, before);
      if (charge < 0.999 && charge > before) {
        EXPECT_NEAR(light_of(sensor, charge) / light, 1, 1e-6);
      }
      before = charge;
    }
  }
}

TEST(SensorResponse, CurvesInvertTheModelAndShareTheDarkPart) {
  const ResponseCurve line = linear_response(12, 64, 0.5, 3);
  for (const SensorResponse& sensor :
       {SensorResponse{two_knees}, SensorResponse{constant_voltage}, SensorResponse{three_phases}}) {
    const ResponseCurve curve = sensor_response(sensor, 12, 64, 0.5, 3);
    ASSERT_EQ(curve.channels.size(), 3U);
    EXPECT_NEAR(curve.code_of(1, 0.05), line.code_of(1, 0.05), 0.3);
    for (double light = 1e-3; light < 1e7; light *= 1.7) {
      const double code = 64 + 4031 * charge_of(sensor, light);
      if (code < curve.saturation_code - 1) {
        EXPECT_NEAR(curve.code_of(2, 0.5 * light), code, 0.3) << light;
      }
    }
  }
}

TEST(SensorResponse, CodesThatNoLightReachesAreSaturated) {
  const ResponseCurve curve = sensor_response(LinLogSensor{1, 1, 1, 1}, 12, 64, 1, 1);
  EXPECT_LT(curve.saturation_code, 3000);  // 0.05 + 0.03 · ln 1e8 = 0.60 of the range
  EXPECT_GT(curve.saturation_code, 2000);
  for (std::size_t code = 1; code < 4096; ++code)
    ASSERT_GE(curve.channels[0].exposure[code], curve.channels[0].exposure[code - 1]);
}

TEST(SensorResponse, FaultsAreNamed) {
  EXPECT_EQ(fault_of(two_knees), "");
  EXPECT_NE(fault_of(MultiSlopeSensor{}), "");
  EXPECT_NE(fault_of(MultiSlopeSensor{{{0.9, 0.5}, {0.8, 0.7}}}), "");
  EXPECT_NE(fault_of(MultiSlopeSensor{{{0.9, 0.5}, {0.95, 0.4}}}), "");
  EXPECT_NE(fault_of(MultiSlopeSensor{{{1.0, 0.5}}}), "");
  EXPECT_NE(fault_of(LinLogSensor{1.2, 0, 1, 1}), "");
  EXPECT_NE(fault_of(LinLogSensor{0.5, 0.5, 1, 0.9}), "");
  EXPECT_NE(fault_of(LinLogSensor{std::nan(""), 0, 1, 1}), "");
}

}  // namespace
}  // namespace mf
