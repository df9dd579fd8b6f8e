// SPDX-License-Identifier: Apache-2.0
// The descriptions of real cameras: each is read through Aravis and mapped by the table, or refused in one line.
#include <arv.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "device/aravis_features.h"
#include "device/ptp.h"
#include "device/response_table.h"
#include "device/steady_settings.h"
#include "tests/device/xml_device.h"

namespace mf {
namespace {

namespace fs = std::filesystem;

std::string text_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

struct Mapping {
  bool readable = false;
  ResponseCapability response;
  PtpReport ptp;
  std::size_t steady = 0;
};

Mapping mapping_of(const std::string& xml, std::uint8_t blank) {
  const test::XmlDevice device(xml, blank);
  if (device.get() == nullptr) return {};
  AravisFeatures features("camera", device.get());
  Mapping mapping{true, probe_response(features), read_ptp(features), hold_steady(features).readings.size()};
  const ResponseSetting setting = apply_response(features, ResponseRequest{LinearSensor{}}, 0.01);
  for (const std::string& remark : setting.remarks) EXPECT_EQ(remark.find('\n'), std::string::npos) << remark;
  return mapping;
}

// By the file's name: the scheme where the camera says that it has what the description offers, and where it says no.
struct Expected {
  bool readable;
  const char* full;
  const char* bare;
  bool ptp;
};
const std::map<std::string, Expected> expected_by_file{
    {"AVT_Manta_G235B.xml", {true, "Allied Vision piecewise linear", "linear", true}},
    {"Allied_Vision_1800_U-811m.xml", {false, "linear", "linear", false}},  // text before the description
    {"Basler-a2A2600-20gmBAS.xml", {true, "linear", "linear", true}},
    {"Basler-acA1300-75gm.xml", {true, "linear", "linear", true}},
    {"FLIR_ORX_10G_245S8M.xml", {true, "linear", "linear", true}},
    {"PGR_GS3_U3_23S6M.xml", {true, "linear", "linear", false}},
};

TEST(GenicamXml, RealCamerasAreMappedOrRefused) {
  const fs::path folder = fs::path(MF_SHARED_DATA) / "genicam";
  if (!fs::exists(folder)) GTEST_SKIP() << "no descriptions of real cameras beside the checkout";
  int seen = 0;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() != ".xml") continue;
    const std::string name = entry.path().filename().string();
    const Mapping full = mapping_of(text_of(entry.path()), 0xFF), bare = mapping_of(text_of(entry.path()), 0);
    std::printf("%-30s %-10s full: %s (%zu features), PTP %d, %zu held steady; bare: %s, PTP %d, %zu\n", name.c_str(),
                full.readable ? "read" : "refused", full.response.scheme.c_str(), full.response.features.size(),
                full.ptp.available ? 1 : 0, full.steady, bare.response.scheme.c_str(), bare.ptp.available ? 1 : 0,
                bare.steady);
    const auto expected = expected_by_file.find(name);
    if (expected == expected_by_file.end()) continue;
    ++seen;
    EXPECT_EQ(full.readable, expected->second.readable) << name;
    EXPECT_EQ(full.response.scheme, expected->second.full) << name;
    EXPECT_EQ(bare.response.scheme, expected->second.bare) << name;
    EXPECT_EQ(full.ptp.available, expected->second.ptp) << name;
  }
  EXPECT_EQ(seen, static_cast<int>(expected_by_file.size()));
}

// The whole way on a real description: mode, time in µs, threshold, and off again.
TEST(GenicamXml, AMantasKneeIsWrittenThroughItsOwnDescription) {
  const fs::path file = fs::path(MF_SHARED_DATA) / "genicam/AVT_Manta_G235B.xml";
  if (!fs::exists(file)) GTEST_SKIP() << "no descriptions of real cameras beside the checkout";
  const test::XmlDevice device(text_of(file), 0xFF);
  ASSERT_NE(device.get(), nullptr);
  AravisFeatures features("camera", device.get());
  const ResponseSetting setting = apply_response(features, ResponseRequest{MultiSlopeSensor{{{0.98, 0.5}}}}, 0.01);
  for (const FeatureReading& r : setting.readings) std::printf("%s = %s\n", r.feature.c_str(), r.value.c_str());
  for (const std::string& r : setting.remarks) std::printf("remark: %s\n", r.c_str());
  ASSERT_TRUE(std::holds_alternative<MultiSlopeSensor>(setting.in_force));
  EXPECT_NEAR(std::get<MultiSlopeSensor>(setting.in_force).knees.at(0).time, 0.98, 1e-6);
  EXPECT_NEAR(std::get<MultiSlopeSensor>(setting.in_force).knees.at(0).level, 32.0 / 63, 1e-9);
}

}  // namespace
}  // namespace mf
