// SPDX-License-Identifier: Apache-2.0
#include "device/response_table.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "device/ptp.h"
#include "device/steady_settings.h"
#include "tests/device/picky_features.h"
#include "tests/support/expect_input_error.h"

namespace mf {
namespace {

using test::PickyFeatures;

const PixelFormat mono12{PixelLayout::mono, 12};

void give_multi_slope(PickyFeatures& f, bool with_levels = true) {
  f.choices["MultiSlopeMode"] = {"Off", {"Off", "Manual", "PresetSoft"}};
  f.numbers["MultiSlopeKneePointCount"] = {.value = 1, .low = 1, .high = 2, .clips = true, .whole = true};
  f.numbers["MultiSlopeKneePointSelector"] = {.value = 1, .low = 1, .high = 2, .whole = true};
  f.numbers["MultiSlopeExposureLimit"] = {
      .value = 50, .low = 0, .high = 100, .selector = "MultiSlopeKneePointSelector"};
  if (with_levels)
    f.numbers["MultiSlopeSaturationThreshold"] = {
        .value = 50, .low = 0, .high = 95, .clips = true, .selector = "MultiSlopeKneePointSelector"};
}

void give_linlog(PickyFeatures& f) {
  f.choices["LinLog_Mode"] = {"Off", {"Off", "LowCompression", "NormalCompression", "HighCompression", "UserDefined"}};
  for (const char* value : {"LinLog_Value1", "LinLog_Value2"})
    f.numbers[value] = {.value = 0, .low = 0, .high = 200, .whole = true};
  for (const char* time : {"LinLog_Time1", "LinLog_Time2"})
    f.numbers[time] = {.value = 1000, .low = 0, .high = 1000, .whole = true};
}

std::string reading(const ResponseSetting& setting, const std::string& feature) {
  for (const FeatureReading& r : setting.readings)
    if (r.feature == feature) return r.value;
  return "not read";
}

TEST(ResponseTable, ThePlainSensorIsLinear) {
  PickyFeatures f;
  EXPECT_EQ(probe_response(f).kind, ResponseKind::linear);
  const ResponseSetting setting = apply_response(f, ResponseRequest{LinearSensor{}}, 0.01);
  EXPECT_EQ(setting.scheme, "linear");
  EXPECT_TRUE(setting.remarks.empty());
  EXPECT_NEAR(response_curve_of(setting, mono12, 64)->code_of(0, 0.5), 64 + 0.5 * 4031, 1e-6);
}

TEST(ResponseTable, MultiSlopeIsWrittenKneeByKneeAndReadBack) {
  PickyFeatures f;
  give_multi_slope(f);
  const ResponseCapability capability = probe_response(f);
  EXPECT_EQ(capability.kind, ResponseKind::multi_slope);
  EXPECT_EQ(capability.features.size(), 5U);
  const MultiSlopeSensor wanted{{{0.9, 0.5}, {0.99, 0.75}}};
  const ResponseSetting setting = apply_response(f, ResponseRequest{wanted}, 0.01);
  EXPECT_TRUE(setting.remarks.empty()) << setting.remarks.front();
  const auto& knees = std::get<MultiSlopeSensor>(setting.in_force).knees;
  ASSERT_EQ(knees.size(), 2U);
  EXPECT_NEAR(knees[1].time, 0.99, 1e-9);
  EXPECT_NEAR(knees[1].level, 0.75, 1e-9);
  EXPECT_EQ(reading(setting, "MultiSlopeExposureLimit[1]"), "90");
  EXPECT_EQ(reading(setting, "MultiSlopeSaturationThreshold[2]"), "75");
  EXPECT_EQ(reading(setting, "MultiSlopeMode"), "Manual");
  EXPECT_NEAR(response_curve_of(setting, mono12, 64)->code_of(0, 10), 64 + 4031 * 0.85, 0.1);
  EXPECT_EQ(to_json(setting)["multi_slope"].size(), 2U);
}

TEST(ResponseTable, WhatTheCameraClipsIsOneRemarkAndTheCurveFollowsTheCamera) {
  PickyFeatures f;
  give_multi_slope(f);
  const ResponseSetting setting = apply_response(f, ResponseRequest{MultiSlopeSensor{{{0.9, 0.98}}}}, 0.01);
  ASSERT_EQ(setting.remarks.size(), 1U);
  EXPECT_TRUE(test::contains(setting.remarks[0], "MultiSlopeSaturationThreshold[1]"));
  EXPECT_TRUE(test::contains(setting.remarks[0], "asked for 98, the camera has 95"));
  EXPECT_NEAR(std::get<MultiSlopeSensor>(setting.in_force).knees.at(0).level, 0.95, 1e-9);
}

TEST(ResponseTable, LevelsComeFromGradientsOrIntensitiesWhereTheyAreNotTold) {
  const MultiSlopeSensor truth{{{0.9, 0.5}, {0.99, 0.75}}};
  PickyFeatures f;
  give_multi_slope(f, false);
  f.choices["MultiSlopeMode"].value = "Manual";
  f.set_number("MultiSlopeKneePointCount", 2);
  f.numbers["MultiSlopeExposureGradient"] = {.selector = "MultiSlopeKneePointSelector"};
  f.numbers["MultiSlopeIntensityLimit"] = {.selector = "MultiSlopeKneePointSelector"};
  const double full = 0.25 / 0.01;  // light that fills the pixel
  for (std::size_t i = 0; i < 2; ++i) {
    f.set_number("MultiSlopeKneePointSelector", static_cast<double>(i + 1));
    f.set_number("MultiSlopeExposureLimit", 100 * truth.knees[i].time);
    f.set_number("MultiSlopeExposureGradient", i == 0 ? 0.25 / 0.09 : full);
    f.set_number("MultiSlopeIntensityLimit", 100 * (i == 0 ? 0.5 / 0.9 : 0.25 / 0.09) / full);
  }
  for (const char* without : {"", "MultiSlopeExposureGradient"}) {
    f.numbers.erase(without);
    const ResponseSetting setting = apply_response(f, std::nullopt, 0.01);
    const auto& knees = std::get<MultiSlopeSensor>(setting.in_force).knees;
    for (std::size_t i = 0; i < 2; ++i) EXPECT_NEAR(knees.at(i).level, truth.knees[i].level, 1e-9) << without;
  }
}

TEST(ResponseTable, LinLogByItsOwnUnits) {
  PickyFeatures f;
  give_linlog(f);
  EXPECT_EQ(probe_response(f).kind, ResponseKind::lin_log);
  const ResponseSetting setting = apply_response(f, ResponseRequest{LinLogSensor{0.7, 0.5, 0.85, 0.97}}, 0.01);
  EXPECT_TRUE(setting.remarks.empty()) << setting.remarks.front();
  EXPECT_EQ(std::get<LinLogSensor>(setting.in_force), (LinLogSensor{0.7, 0.5, 0.85, 0.97}));
  EXPECT_EQ(reading(setting, "LinLog_Value1"), "140");
  EXPECT_EQ(reading(setting, "LinLog_Time2"), "970");
}

TEST(ResponseTable, APresetHasACurveThatNobodyTells) {
  PickyFeatures f;
  give_linlog(f);
  f.choices["LinLog_Mode"].value = "HighCompression";
  const ResponseSetting setting = apply_response(f, std::nullopt, 0.01);
  EXPECT_EQ(setting.scheme, "Photonfocus LinLog");
  EXPECT_FALSE(response_curve_of(setting, mono12, 64).has_value());
  ASSERT_EQ(setting.remarks.size(), 1U);
  EXPECT_TRUE(test::contains(setting.remarks[0], "HighCompression"));
  EXPECT_NEAR(approximate_response_curve(setting, mono12, 0).code_of(0, 0.5), 0.5 * 4095, 1e-6);
}

TEST(ResponseTable, ARenamedFeatureIsFoundAndAMissingOneSaid) {
  PickyFeatures f;
  give_linlog(f);
  f.numbers["LinLogValue1"] = f.numbers["LinLog_Value1"];
  f.numbers.erase("LinLog_Value1");
  f.numbers.erase("LinLog_Time2");
  const ResponseSetting setting = apply_response(f, ResponseRequest{LinLogSensor{0.5, 0.5, 1, 1}}, 0.01);
  EXPECT_EQ(reading(setting, "LinLogValue1"), "100");
  EXPECT_TRUE(std::holds_alternative<UnknownResponse>(setting.in_force));
  ASSERT_EQ(setting.remarks.size(), 2U);
  EXPECT_TRUE(test::contains(setting.remarks[0], "LinLog_Time2"));
}

TEST(ResponseTable, ReadOnlyAndUnreadableFeaturesAreRemarks) {
  PickyFeatures f;
  give_multi_slope(f);
  f.numbers["MultiSlopeExposureLimit"].read_only = true;
  ResponseSetting setting = apply_response(f, ResponseRequest{MultiSlopeSensor{{{0.9, 0.4}}}}, 0.01);
  ASSERT_EQ(setting.remarks.size(), 1U);
  EXPECT_TRUE(test::contains(setting.remarks[0], "MultiSlopeExposureLimit[1]"));
  EXPECT_NEAR(std::get<MultiSlopeSensor>(setting.in_force).knees.at(0).time, 0.5, 1e-9);  // what it has
  f.unreadable.insert("MultiSlopeExposureLimit");
  setting = apply_response(f, std::nullopt, 0.01);
  EXPECT_TRUE(std::holds_alternative<UnknownResponse>(setting.in_force));
}

TEST(ResponseTable, AlliedVisionsTimesAreWhatIsLeft) {
  PickyFeatures f;
  f.choices["ExposureMode"] = {"Timed", {"Timed", "TriggerWidth", "PieceWiseLinearHDR"}};
  EXPECT_EQ(probe_response(f).kind, ResponseKind::linear);  // every camera has an exposure mode
  for (const char* time : {"CmvExposureTimePWL1", "CmvExposureTimePWL2"}) f.numbers[time] = {.low = 1, .high = 1e6};
  for (const char* level : {"CmvPWLThreshold1", "CmvPWLThreshold2"})
    f.numbers[level] = {.value = 63, .low = 0, .high = 63, .whole = true};
  EXPECT_EQ(probe_response(f).scheme, "Allied Vision piecewise linear");
  const ResponseSetting setting = apply_response(f, ResponseRequest{MultiSlopeSensor{{{0.98, 0.5}}}}, 0.01);
  EXPECT_EQ(reading(setting, "CmvExposureTimePWL1"), "200");  // µs of 10 ms
  EXPECT_EQ(f.number("CmvPWLThreshold2"), f.number("CmvPWLThreshold1"));
  EXPECT_NEAR(std::get<MultiSlopeSensor>(setting.in_force).knees.at(0).level, 32.0 / 63, 1e-9);
  EXPECT_TRUE(std::holds_alternative<LinearSensor>(apply_response(f, ResponseRequest{LinearSensor{}}, 0.01).in_force));
  EXPECT_EQ(f.choice("ExposureMode"), "Timed");
}

TEST(ResponseTable, WideDynamicRangeIsSaidToBeUnknown) {
  PickyFeatures f;
  f.numbers["wide_dynamic_range"] = {.value = 0, .low = 0, .high = 1, .whole = true};
  EXPECT_EQ(probe_response(f).kind, ResponseKind::wide_dynamic_range);
  const ResponseSetting on = apply_response(f, ResponseRequest{WideDynamicRange{}}, 0.01);
  EXPECT_FALSE(response_curve_of(on, mono12, 64).has_value());
  EXPECT_EQ(reading(on, "wide_dynamic_range"), "1");
  ASSERT_EQ(on.remarks.size(), 1U);
  EXPECT_TRUE(test::contains(on.remarks[0], "taken as linear for now"));
  EXPECT_TRUE(response_curve_of(apply_response(f, ResponseRequest{LinearSensor{}}, 0.01), mono12, 64).has_value());
}

TEST(ResponseTable, WhatTheCameraCannotDoIsRefusedInOneLine) {
  PickyFeatures f;
  give_linlog(f);
  std::string error = test::input_error_of([&] {
    (void)apply_response(f, ResponseRequest{MultiSlopeSensor{{{0.9, 0.5}}}}, 0.01);
  });
  EXPECT_TRUE(test::contains(error, "no multi_slope"));
  EXPECT_TRUE(test::contains(error, "lin_log"));
  error = test::input_error_of([&] { (void)apply_response(f, ResponseRequest{LinLogSensor{2, 0, 1, 1}}, 0.01); });
  EXPECT_TRUE(test::contains(error, "values must lie from 0 to 1"));
  EXPECT_TRUE(f.written.empty());
}

TEST(ResponseTable, OnlyOneWayIsOnAtATime) {
  PickyFeatures f;
  give_linlog(f);
  give_multi_slope(f);
  f.choices["LinLog_Mode"].value = "UserDefined";
  const ResponseSetting setting = apply_response(f, ResponseRequest{MultiSlopeSensor{{{0.9, 0.5}}}}, 0.01);
  EXPECT_EQ(setting.scheme, "SFNC MultiSlope");
  EXPECT_EQ(reading(setting, "LinLog_Mode"), "Off");
}

TEST(SteadySettings, SwitchesOffWhatWouldChangeAndTouchesNothingElse) {
  PickyFeatures f;
  f.choices["ExposureAuto"] = {"Continuous", {"Off", "Once", "Continuous"}};
  f.choices["GainAuto"] = {"Off", {"Off", "Continuous"}};
  f.choices["BalanceWhiteAuto"] = {"Continuous", {"Continuous"}};
  f.numbers["GammaEnable"] = {.value = 1, .low = 0, .high = 1, .whole = true};
  const SteadySettings steady = hold_steady(f);
  EXPECT_EQ(f.choice("ExposureAuto"), "Off");
  EXPECT_EQ(f.number("GammaEnable"), 0);
  EXPECT_EQ(std::count(f.written.begin(), f.written.end(), "GainAuto"), 0);
  EXPECT_EQ(steady.readings.size(), 4U);
  ASSERT_EQ(steady.remarks.size(), 1U);
  EXPECT_TRUE(test::contains(steady.remarks[0], "BalanceWhiteAuto"));
}

TEST(Ptp, EachFamilyOfNamesIsUsed) {
  PickyFeatures none;
  EXPECT_FALSE(set_ptp(none, true).available);
  PickyFeatures sfnc;
  sfnc.numbers["PtpEnable"] = {.value = 0, .low = 0, .high = 1, .whole = true};
  sfnc.choices["PtpStatus"] = {"Slave", {}};
  sfnc.numbers["PtpOffsetFromMaster"] = {.value = -120};
  sfnc.numbers["PtpDataSetLatch"] = {};
  PtpReport report = set_ptp(sfnc, true);
  EXPECT_TRUE(report.enabled);
  EXPECT_EQ(report.status, "Slave");
  EXPECT_EQ(report.offset_ns, -120);
  EXPECT_EQ(sfnc.written, (std::vector<std::string>{"PtpEnable", "PtpDataSetLatch"}));
  PickyFeatures older;
  older.numbers["GevIEEE1588"] = {.value = 1};
  older.choices["GevIEEE1588Status"] = {"Listening", {}};
  report = read_ptp(older);
  EXPECT_TRUE(report.enabled);
  EXPECT_EQ(report.status, "Listening");
  EXPECT_FALSE(report.offset_ns.has_value());
  EXPECT_TRUE(older.written.empty());
  PickyFeatures allied;
  allied.choices["PtpMode"] = {"Off", {"Off", "Slave"}};
  EXPECT_TRUE(set_ptp(allied, true).enabled);
  EXPECT_FALSE(set_ptp(allied, false).enabled);
}

}  // namespace
}  // namespace mf
