// SPDX-License-Identifier: Apache-2.0
#include "device/rig_status_json.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>

#include "device/base64.h"
#include "tests/device/status_examples.h"
#include "tests/support/expect_input_error.h"

namespace mf {
namespace {

using Json = nlohmann::json;

std::vector<std::uint8_t> bytes_of(std::string_view text) {
  return {text.begin(), text.end()};
}

TEST(Base64, HoldsTheVectorsOfRfc4648) {
  const std::vector<std::pair<std::string, std::string>> vectors{{"", ""},
                                                                 {"f", "Zg=="},
                                                                 {"fo", "Zm8="},
                                                                 {"foo", "Zm9v"},
                                                                 {"foob", "Zm9vYg=="},
                                                                 {"fooba", "Zm9vYmE="},
                                                                 {"foobar", "Zm9vYmFy"}};
  for (const auto& [bytes, text] : vectors) {
    EXPECT_EQ(to_base64(bytes_of(bytes)), text);
    EXPECT_EQ(from_base64(text), bytes_of(bytes));
  }
}

TEST(Base64, RefusesWhatItDoesNotWrite) {
  for (const char* text :
       {"Z", "Zg", "Zg=", "Zg===", "====", "Zh==", "Zm9=", "Zm9v\n", "Z!9v", "=Zg=", "Zg==Zg==", "Zm=v"})
    EXPECT_FALSE(from_base64(text)) << text;
}

TEST(Base64, EveryByteComesBack) {
  std::vector<std::uint8_t> bytes(1000);
  std::mt19937 random(1);
  for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
  for (std::size_t size = 990; size <= bytes.size(); ++size) {
    bytes.resize(size);
    EXPECT_EQ(from_base64(to_base64(bytes)), bytes);
  }
}

TEST(RigStatusJson, EveryValueComesBack) {
  RigStatus s = test::recording_status();
  s.problem = "the disk is \"full\"\nalmost";
  s.preview->tags.front().corrected_bits = 1;
  const Json once = rig_status_to_json(s);
  const RigStatus back = rig_status_from_json(Json::parse(once.dump()), "test");
  EXPECT_EQ(rig_status_to_json(back), once);
  // What both directions might leave out:
  EXPECT_EQ(back.state, s.state);
  EXPECT_EQ(back.problem, s.problem);
  EXPECT_EQ(back.session, s.session);
  EXPECT_EQ(back.seconds, s.seconds);
  EXPECT_EQ(back.durable_frames, s.durable_frames);
  EXPECT_EQ(back.lost_frames, s.lost_frames);
  EXPECT_EQ(back.gaps, s.gaps);
  EXPECT_EQ(back.queued, s.queued);
  EXPECT_EQ(back.queue_frames, s.queue_frames);
  EXPECT_EQ(back.frame_rate_hz, s.frame_rate_hz);
  EXPECT_EQ(back.free_bytes, s.free_bytes);
  EXPECT_EQ(back.temperature_c, s.temperature_c);
  EXPECT_EQ(back.camera, s.camera);
  EXPECT_EQ(back.exposure_s, s.exposure_s);
  EXPECT_EQ(back.preview->grey.data, s.preview->grey.data);
  EXPECT_EQ(back.preview->frame_px_per_preview, s.preview->frame_px_per_preview);
  EXPECT_EQ(back.preview->posed, s.preview->posed);
  ASSERT_EQ(back.preview->tags.size(), s.preview->tags.size());
  EXPECT_EQ(back.preview->tags.front().corners_px, s.preview->tags.front().corners_px);
  EXPECT_EQ(back.preview->tags.front().corrected_bits, 1);
  ASSERT_EQ(back.coverage->patches.size(), s.coverage->patches.size());
  EXPECT_EQ(back.coverage->patches.back().weight, s.coverage->patches.back().weight);
  EXPECT_EQ(back.coverage->advice->text, s.coverage->advice->text);
}

TEST(RigStatusJson, WhatIsUnknownStaysUnknown) {
  RigStatus s;
  s.frame_rate_hz = std::numeric_limits<double>::quiet_NaN();
  const RigStatus back = rig_status_from_json(Json::parse(rig_status_to_json(s).dump()), "test");
  EXPECT_TRUE(std::isnan(back.frame_rate_hz));
  EXPECT_FALSE(back.temperature_c);
  EXPECT_FALSE(back.preview);
  EXPECT_FALSE(back.coverage);
}

TEST(RigStatusJson, EveryStateHasItsName) {
  for (const RigState state :
       {RigState::idle, RigState::metering, RigState::recording, RigState::done, RigState::error}) {
    RigStatus s;
    s.state = state;
    EXPECT_EQ(rig_status_from_json(rig_status_to_json(s), "test").state, state);
  }
  EXPECT_EQ(rig_state_name(RigState::metering), "metering");
}

TEST(RigStatusJson, AFaultNamesItsValue) {
  const Json good = rig_status_to_json(test::recording_status());
  const auto expect = [&](const char* where, const Json& value, const std::string& name) {
    Json bad = good;
    bad[Json::json_pointer(where)] = value;
    EXPECT_TRUE(
        test::contains(test::input_error_of([&] { (void)rig_status_from_json(bad, "socket"); }), "socket: " + name));
  };
  expect("/state", "sleeping", "state");
  expect("/state", 3, "state");
  expect("/durable_frames", -1, "durable_frames");
  expect("/durable_frames", 1e30, "durable_frames");
  expect("/durable_frames", 18446744073709551615U, "durable_frames");
  expect("/queued", 3'000'000'000, "queued");
  expect("/seconds", "12", "seconds");
  expect("/preview", Json::array(), "preview");
  expect("/preview/width", 1 << 20, "preview.width");
  expect("/preview/grey", "AAAA", "preview.grey");
  expect("/preview/grey", "no base64!", "preview.grey");
  expect("/preview/frame_px_per_preview", 0, "preview.frame_px_per_preview");
  expect("/preview/tags", Json::array({Json::object()}), "preview.tags.id");
  expect("/preview/tags", std::vector<int>(2000), "preview.tags");
  expect("/preview/tags/0/corners_px", Json::array({1, 2, 3, 4}), "preview.tags.corners_px");
  expect("/coverage/patches", Json::array({Json::array({1, 2, 3})}), "coverage.patches");
  expect("/coverage/advice/text", nullptr, "coverage.advice.text");
  for (const auto& [key, value] : good.items()) {
    if (key == "temperature_c" || key == "preview" || key == "coverage") continue;
    Json bad = good;
    bad.erase(key);
    EXPECT_TRUE(test::contains(test::input_error_of([&] { (void)rig_status_from_json(bad, "socket"); }), key));
  }
  EXPECT_TRUE(test::contains(test::input_error_of([] { (void)rig_status_from_json(Json(3), "socket"); }), "socket"));
}

TEST(RigStatusJson, ANewerDaemonMaySayMore) {
  Json more = rig_status_to_json(RigStatus{});
  more["wind_m_per_s"] = 3;
  EXPECT_EQ(rig_status_from_json(more, "test").state, RigState::idle);
}

TEST(ShrunkPreview, IsTheMeanAndKeepsTheTagsWhereTheyAre) {
  RigPreview preview;
  preview.grey = ImageU8(6, 4, 1);
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 6; ++x) preview.grey.at(x, y) = static_cast<std::uint8_t>(10 * x + y);
  preview.frame_px_per_preview = 4;
  preview.tags = {{7, {{{1, 2}, {3, 4}, {5, 6}, {7, 8}}}, 0, 1}};
  const RigPreview small = shrunk_preview(preview, 3);
  EXPECT_EQ(small.grey.width, 3);
  EXPECT_EQ(small.grey.height, 2);
  EXPECT_EQ(small.grey.at(0, 0), 6);   // of 0, 10, 1, 11: 5.5
  EXPECT_EQ(small.grey.at(2, 1), 48);  // of 42, 52, 43, 53: 47.5
  EXPECT_EQ(small.frame_px_per_preview, 8);
  EXPECT_EQ(small.tags.front().corners_px, preview.tags.front().corners_px);
  EXPECT_EQ(shrunk_preview(preview, 6).grey.data, preview.grey.data);
}

}  // namespace
}  // namespace mf
