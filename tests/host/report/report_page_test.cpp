// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <filesystem>
#include <regex>

#include "host/report/report.h"

namespace mf {
namespace {

namespace fs = std::filesystem;

// A recording of two tiny frames; the report only draws what it is given.
class ReportPage : public testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(folder_);
    SessionHeader header;
    header.format = {PixelLayout::bayer_rg, 12, false};
    header.width = header.height = 32;
    header.target.family = "tag36h11";
    header.target.opening_m = {0.2, 0.1};
    header.target.tags = {{0, 0.02, {0.13, 0}}};
    SessionWriter writer(folder_, header, {SessionWriter::Durability::batches});
    for (const char* name : {"a.png", "b<script>.png"}) {
      Frame frame;
      frame.info.name = name;
      frame.info.exposure_s = 0.01;
      frame.pixels = ImageU16(32, 32, 1, 300);
      writer.append(frame);
    }
    writer.finish();

    calibration_.camera = {32, 32, {40, 40, 16, 16, 0, 0, 0, 0, 0}};
    calibration_.rms_px = 0.21;
    MirrorPose posed;
    posed.name = "a.png";
    posed.used = true;
    posed.rms_px = 0.2;
    posed.cam_from_mirror = {Eigen::Quaterniond(0, 1, 0, 0), {0, 0, 1}};
    MirrorPose grazing;
    grazing.name = "b<script>.png";
    grazing.why_not = "seen too flat";
    calibration_.frames = {posed, grazing};

    field_.plane.min_m = {-0.1, -0.1};
    field_.plane.max_m = {0.1, 0.1};
    field_.directions = geodesic_hemisphere(60);
    field_.resolution = 2;
    field_.rgbc.assign(field_.directions.size() * 4, {1, 1, 1, 1});
  }
  void TearDown() override { fs::remove_all(folder_); }

  [[nodiscard]] std::string page() const {
    const SessionReader session(folder_);
    const ResponseCurve response = linear_response(12, 64, 1, 3);
    const ImageF probe(16, 8, 3, 0.5F);
    return report_html(
        {"desk & lamp", session, response, calibration_, field_, probe, {0, 0, 0.1}, {{"calibrate", 1.5}}}, {});
  }

  fs::path folder_ = fs::temp_directory_path() / "mirrorfield_report_test";
  Calibration calibration_;
  LightField field_;
};

TEST_F(ReportPage, FetchesNothing) {
  const std::string html = page();
  const std::regex reference(R"re((src|href)="([^"]{0,22}))re");
  int pictures = 0;
  for (std::sregex_iterator it(html.begin(), html.end(), reference), end; it != end; ++it, ++pictures)
    EXPECT_EQ((*it)[2], "data:image/png;base64,");
  EXPECT_EQ(pictures, 5);  // probe, irradiance, coverage, light, one posed frame
  EXPECT_EQ(html.find("http"), std::string::npos);
  EXPECT_EQ(html.find("<script"), std::string::npos);  // nor a frame's name that looks like one
}

TEST_F(ReportPage, ListsWhatWasNotUsedAndWhy) {
  const std::string html = page();
  EXPECT_NE(html.find("<td>b&lt;script&gt;.png</td><td>seen too flat</td>"), std::string::npos);
  EXPECT_EQ(html.find("<td>a.png</td>"), std::string::npos);
  EXPECT_NE(html.find("1 / 2"), std::string::npos);
  EXPECT_NE(html.find("desk &amp; lamp"), std::string::npos);
}

TEST_F(ReportPage, EveryElementIsClosed) {
  const std::string html = page();
  std::vector<std::string> open;
  for (std::size_t at = html.find('<'); at != std::string::npos; at = html.find('<', at + 1)) {
    const std::string tag = html.substr(at + 1, html.find('>', at) - at - 1);  // no attribute holds a '>'
    const bool closes = tag.starts_with("/");
    const std::string name = tag.substr(closes ? 1 : 0, tag.find_first_of(" /", 1) - (closes ? 1 : 0));
    if (name == "!DOCTYPE" || name == "meta" || name == "img" || tag.ends_with("/")) continue;
    if (!closes) {
      open.push_back(name);
      continue;
    }
    ASSERT_FALSE(open.empty()) << tag;
    EXPECT_EQ(open.back(), name);
    open.pop_back();
  }
  EXPECT_TRUE(open.empty());
}

TEST_F(ReportPage, IsTheSameEveryTime) {
  EXPECT_EQ(page(), page());
}

}  // namespace
}  // namespace mf
