// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "common/session.h"
#include "host/import/import_session.h"
#include "tests/host/import/small_recording.h"
#include "tests/support/expect_input_error.h"
#include "tests/support/foreign_png.h"
#include "tests/support/pictures.h"
#include "tests/support/temporary_folder.h"

namespace mf {
namespace {

namespace fs = std::filesystem;
using test::contains;
using test::input_error_of;
using test::SmallRecording;

struct Case {
  const char* format;
  const char* extension;
};

class EveryImport : public testing::TestWithParam<Case> {};

TEST_P(EveryImport, KeepsEveryPixelBitForBit) {
  const test::TemporaryFolder folder;
  SmallRecording recording(parse_pixel_format(GetParam().format).value());
  const std::string old = "." + recording.extension;
  recording.extension = GetParam().extension;
  for (nlohmann::json* list : {&recording.frames, &recording.sweep})
    for (nlohmann::json& entry : *list) {
      const auto name = entry["frame"].get<std::string>();
      entry["frame"] = name.substr(0, name.size() - old.size()) + "." + recording.extension;
    }
  recording.reference["frame"] = "scene." + recording.extension;
  recording.write(folder / "in");
  const ImportResult result = import_session({folder / "in"}, {folder / "S"}, {});
  EXPECT_EQ(result.mirror_frames, 4);
  EXPECT_EQ(result.scene_frames, 1);
  EXPECT_EQ(result.sweep_frames, 3);
  const SessionReader reader(folder / "S");
  ASSERT_EQ(reader.header().format, recording.format);
  const std::vector<SessionFrame> mirror = reader.frames(FrameRole::mirror);
  for (int i = 0; i < 4; ++i) {
    const SessionFrame& frame = mirror.at(static_cast<std::size_t>(i));
    EXPECT_EQ(frame.id, i);
    EXPECT_EQ(frame.info.name, recording.frames[static_cast<std::size_t>(i)]["frame"]);
    EXPECT_TRUE(test::same_pixels(reader.read_frame(frame).pixels, test::small_pixels(recording.format, i)));
  }
}

INSTANTIATE_TEST_SUITE_P(Import, EveryImport,
                         testing::Values(Case{"Mono8", "png"}, Case{"Mono10", "tif"}, Case{"Mono16", "png"},
                                         Case{"BayerRG12", "png"}, Case{"BayerGR12", "tif"}, Case{"BayerGB8", "png"},
                                         Case{"BayerBG16", "tif"}, Case{"RGB8", "png"}, Case{"RGB12", "png"},
                                         Case{"RGB16", "tif"}, Case{"MonoFloat", "exr"}, Case{"MonoFloat", "tif"},
                                         Case{"RGBFloat", "exr"}, Case{"RGBFloat", "tif"}),
                         [](const auto& each) { return std::string(each.param.format) + "_" + each.param.extension; });

TEST(Import, KeepsWhatTheDocumentsSay) {
  const test::TemporaryFolder folder;
  SmallRecording recording;
  recording.frames[2]["time_s"] = -4.5;  // clocks jump: times are kept, not judged
  recording.write(folder / "in");
  (void)import_session({folder / "in"}, {folder / "S"}, {});
  const SessionReader reader(folder / "S");
  const SessionHeader& header = reader.header();
  EXPECT_EQ(header.width, 40);
  EXPECT_EQ(header.height, 30);
  EXPECT_EQ(header.black_level_hint, 16);
  EXPECT_EQ(header.mirror_reflectance, 0.9);
  EXPECT_EQ(header.target.tags.size(), 2U);
  EXPECT_EQ(header.world.value().tags.size(), 2U);
  EXPECT_EQ(header.reference.value().radiance, (std::vector<double>{0.7, 0.6, 0.5}));
  EXPECT_EQ(reader.frames().at(2).info.time_s, -4.5);
  const SessionFrame scene = reader.frames(FrameRole::scene).at(0);
  EXPECT_EQ(scene.info.name, "scene.png");
  const SessionFrame swept = reader.frames(FrameRole::sweep).at(2);
  EXPECT_EQ(swept.info.exposure_s, 0.014);
  EXPECT_EQ(swept.info.nd_density, 0.6);
}

TEST(Import, TheScenePictureTakesTheFramesExposureWhenTheyShareOne) {
  const test::TemporaryFolder folder;
  SmallRecording recording;
  recording.write(folder / "shared");
  EXPECT_EQ(import_session({folder / "shared"}, {folder / "a"}, {}).scene_exposure_s, 0.01);
  recording.camera["scene_exposure_s"] = 0.5;
  recording.write(folder / "said");
  EXPECT_EQ(import_session({folder / "said"}, {folder / "b"}, {}).scene_exposure_s, 0.5);
  recording.frames[1]["exposure_s"] = 0.02;
  recording.write(folder / "differ_said");
  EXPECT_EQ(import_session({folder / "differ_said"}, {folder / "c"}, {}).scene_exposure_s, 0.5);
  recording.camera.erase("scene_exposure_s");
  recording.write(folder / "differ");
  EXPECT_TRUE(contains(input_error_of([&] { (void)import_session({folder / "differ"}, {folder / "d"}, {}); }),
                       "camera.json: scene_exposure_s: is missing, and the frames' exposures differ"));
}

TEST(Import, OptionalFilesMayBeAbsent) {
  const test::TemporaryFolder folder;
  SmallRecording recording;
  recording.world = recording.sweep = recording.reference = nullptr;
  recording.camera = {{"pixel_format", "BayerRG12"}};
  recording.write(folder / "in");
  fs::remove_all(folder / "in/sweep");
  fs::remove(folder / "in/scene.png");
  const ImportResult result = import_session({folder / "in"}, {folder / "S"}, {});
  EXPECT_EQ(result.scene_frames + result.sweep_frames, 0);
  const SessionReader reader(folder / "S");
  EXPECT_FALSE(reader.header().world);
  EXPECT_FALSE(reader.header().reference);
  EXPECT_EQ(reader.header().mirror_reflectance, 1);
  EXPECT_EQ(reader.header().black_level_hint, 0);
}

TEST(Import, FilesThatAreNotListedAreCounted) {
  const test::TemporaryFolder folder;
  SmallRecording recording;
  recording.frames.erase(1);
  recording.write(folder / "in");
  EXPECT_EQ(import_session({folder / "in"}, {folder / "S"}, {}).unlisted_files, 1);
}

TEST(Import, ProgressRisesToOne) {
  const test::TemporaryFolder folder;
  SmallRecording().write(folder / "in");
  double last = 0;
  (void)import_session({folder / "in"}, {folder / "S"}, [&](std::string_view, double fraction) {
    EXPECT_GT(fraction, last);
    last = fraction;
  });
  EXPECT_EQ(last, 1);
}

TEST(Import, OverwriteReplacesASessionOnlyAndOnlyWhenItSucceeds) {
  const test::TemporaryFolder folder;
  SmallRecording recording;
  recording.write(folder / "in");
  (void)import_session({folder / "in"}, {folder / "S"}, {});
  recording.frames.erase(3);
  recording.write(folder / "in2");
  const auto frames_in = [&] { return SessionReader(folder / "S").frames(FrameRole::mirror).size(); };
  EXPECT_TRUE(contains(input_error_of([&] { (void)import_session({folder / "in2"}, {folder / "S"}, {}); }),
                       "exists already: choose another name, or replace it with --overwrite"));
  EXPECT_EQ(frames_in(), 4U);
  recording.camera["pixel_format"] = "Mono12";
  recording.camera["bits"] = 10;
  recording.write(folder / "bad");
  EXPECT_THROW((void)import_session({folder / "bad"}, {folder / "S", true}, {}), InputError);
  EXPECT_EQ(frames_in(), 4U);
  (void)import_session({folder / "in2"}, {folder / "S/", true}, {});  // a trailing slash means the same folder
  EXPECT_EQ(frames_in(), 3U);
  EXPECT_TRUE(contains(input_error_of([&] {
                         (void)import_session({folder / "in"}, {folder / "in2", true}, {});
                       }),
                       "exists and is no session"));
  EXPECT_TRUE(fs::exists(folder / "in2/frames.json"));
  EXPECT_FALSE(fs::exists(folder / "S.partial"));
}

TEST(Import, WhatAKilledRunLeftIsReplacedAndNothingElse) {
  const test::TemporaryFolder folder;
  SmallRecording().write(folder / "in");
  { const SessionWriter killed(folder / "S.partial", SessionHeader{{}, 8, 8, 0, 1, {"tag36h11", {}, {}}, {}, {}}, {}); }
  (void)import_session({folder / "in"}, {folder / "S"}, {});
  EXPECT_FALSE(fs::exists(folder / "S.partial"));
  fs::create_directory(folder / "T.partial");
  test::write_bytes(folder / "T.partial/thesis.txt", "precious");
  EXPECT_TRUE(contains(input_error_of([&] { (void)import_session({folder / "in"}, {folder / "T"}, {}); }),
                       "T.partial: is in the way"));
  EXPECT_TRUE(fs::exists(folder / "T.partial/thesis.txt"));
}

}  // namespace
}  // namespace mf
