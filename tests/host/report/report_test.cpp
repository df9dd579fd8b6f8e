// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "host/report/charts.h"
#include "host/report/field_pictures.h"
#include "host/report/html.h"

namespace mf {
namespace {

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + part.size())) ++n;
  return n;
}

// Light of constant radiance from every direction, seen fully where `seen` says so.
template <typename Seen>
LightField field_of(const Seen& seen) {
  LightField field;
  field.plane.min_m = {-0.1, -0.1};
  field.plane.max_m = {0.1, 0.1};
  field.directions = geodesic_hemisphere(400);
  field.resolution = 4;
  for (const Eigen::Vector3f& d : field.directions.directions)
    for (std::size_t i = 0; i < field.texel_count(); ++i)
      field.rgbc.push_back(seen(d) ? Eigen::Vector4f(1, 2, 3, 1) : Eigen::Vector4f::Zero());
  return field;
}

TEST(FieldPictures, ConstantLightGivesPiTimesItsRadiance) {
  const ImageF map = plane_irradiance(field_of([](const auto&) { return true; }));
  ASSERT_EQ(map.width, 4);
  for (std::size_t i = 0; i < map.data.size(); ++i)
    EXPECT_NEAR(map.data[i], std::numbers::pi * static_cast<double>(1 + i % 3), 0.01 * std::numbers::pi * 3);
}

TEST(FieldPictures, DiscShowsWhereLightWasSeen) {
  const LightField field = field_of([](const Eigen::Vector3f& d) { return d.x() > 0; });
  const HemisphereDisc disc = draw_hemisphere(field, 64);
  EXPECT_FLOAT_EQ(disc.confidence.at(56, 32), 1);  // +x is right
  EXPECT_FLOAT_EQ(disc.confidence.at(8, 32), 0);
  EXPECT_FLOAT_EQ(disc.radiance.at(56, 32, 1), 2);
  EXPECT_FLOAT_EQ(disc.radiance.at(0, 0, 1), 0);  // outside the disc
  EXPECT_NEAR(covered_share(field), 0.5, 0.05);
}

TEST(FieldPictures, DiscHasPlusYUp) {
  const HemisphereDisc disc = draw_hemisphere(field_of([](const Eigen::Vector3f& d) { return d.y() > 0.2F; }), 64);
  EXPECT_FLOAT_EQ(disc.confidence.at(32, 6), 1);
  EXPECT_FLOAT_EQ(disc.confidence.at(32, 58), 0);
}

TEST(Html, EscapesWhatCouldEndATagOrAnAttribute) {
  EXPECT_EQ(html_escaped("<script>\"a\" & 'b'"), "&lt;script&gt;&quot;a&quot; &amp; &#39;b&#39;");
}

TEST(Html, PngDataUriStartsLikeAPng) {
  const std::string uri = png_data_uri(ImageU8(3, 2, 3, 77));
  EXPECT_TRUE(uri.starts_with("data:image/png;base64,iVBORw0KGgo")) << uri;  // the signature's eight bytes
  EXPECT_EQ((uri.size() - std::string("data:image/png;base64,").size()) % 4, 0U);
}

TEST(Charts, LogarithmicAxisLeavesOutZero) {
  const std::string svg = line_chart({{"ink", {{0, 0}, {1, 0.01}, {2, 1}}}}, {"code", "exposure", false, true});
  const std::size_t start = svg.find("points=\"") + 8;
  EXPECT_EQ(count(svg.substr(start, svg.find('"', start) - start), ","), 2U);
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(svg.find("inf"), std::string::npos);
}

TEST(Charts, BarsKeepTheirProportion) {
  const std::string svg = bar_chart({{0.1, true, "a"}, {0.2, true, "b"}, {0, false, "grazing"}}, "frame", "px", 0.15);
  EXPECT_EQ(count(svg, "<rect class=\"bar\""), 2U);
  EXPECT_EQ(count(svg, "<rect class=\"missing\""), 1U);
  EXPECT_NE(svg.find("grazing"), std::string::npos);
  const auto bar_height = [&](std::size_t from) {
    const std::size_t at = svg.find("height=\"", svg.find("<rect", from)) + 8;
    return std::stod(svg.substr(at));
  };
  const std::size_t first = svg.find("<rect");
  EXPECT_NEAR(bar_height(first + 1) / bar_height(first), 2, 0.01);
}

}  // namespace
}  // namespace mf
