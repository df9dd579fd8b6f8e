// SPDX-License-Identifier: Apache-2.0
// The real program on bad input: exactly one line on standard error that names the file and the field, exit code 1, and
// nothing left behind.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <limits>

#include "common/file_bytes.h"
#include "common/json_file.h"
#include "common/session.h"
#include "common/tiff_image.h"
#include "host/io/exr.h"
#include "tests/host/import/small_recording.h"
#include "tests/support/expect_input_error.h"
#include "tests/support/foreign_png.h"
#include "tests/support/pictures.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_folder.h"

namespace mf {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::contains;
using test::SmallRecording;

const char* const program = MF_BINARY_DIR "/mirrorfield";

struct BadInput {
  const char* name;
  const char* line;  // a part of the one line
  std::function<void(SmallRecording&)> before = {};
  std::function<void(const fs::path& folder)> after = {};
  PixelFormat format = {PixelLayout::bayer_rg, 12, false};
};

void PrintTo(const BadInput& bad, std::ostream* out) {
  *out << bad.name;
}

class ImportRefuses : public testing::TestWithParam<BadInput> {};

TEST_P(ImportRefuses, WithOneLineAndNothingLeft) {
  const test::TemporaryFolder folder;
  SmallRecording recording(GetParam().format);
  if (GetParam().before) GetParam().before(recording);
  recording.write(folder / "in");
  if (GetParam().after) GetParam().after(folder / "in");
  const auto outcome = test::run_command({program, "import", folder / "in", "-o", folder / "S"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_TRUE(contains(outcome.err, GetParam().line));
  EXPECT_EQ(outcome.error_lines(), 1) << outcome.err;
  EXPECT_TRUE(outcome.out.empty()) << outcome.out;
  EXPECT_FALSE(fs::exists(folder / "S"));
  EXPECT_FALSE(fs::exists(folder / "S.partial"));
}

void replace_text(const fs::path& file, const std::string& from, const std::string& to) {
  std::string text = read_file_bytes(file);
  const std::size_t at = text.find(from);
  ASSERT_NE(at, std::string::npos) << from;
  test::write_bytes(file, text.replace(at, from.size(), to));
}

std::function<void(const fs::path&)> remove(const char* name) {
  return [name](const fs::path& folder) { fs::remove_all(folder / name); };
}

std::function<void(const fs::path&)> text(const char* file, const char* from, const char* to) {
  return [=](const fs::path& folder) { replace_text(folder / file, from, to); };
}

std::function<void(const fs::path&)> picture(const char* name, const FramePixels& pixels, int bits = 16) {
  return [=](const fs::path& folder) { test::write_picture(folder / name, pixels, bits); };
}

void truncate_frame(const fs::path& folder) {
  fs::resize_file(folder / "frames/00002.png", fs::file_size(folder / "frames/00002.png") / 2);
}

void damage_frame(const fs::path& folder) {
  std::string bytes = read_file_bytes(folder / "frames/00002.png");
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 0x40);
  test::write_bytes(folder / "frames/00002.png", bytes);
}

ImageU16 codes_with(int code) {
  ImageU16 image(40, 30, 1, 100);
  image.at(7, 5) = static_cast<std::uint16_t>(code);
  return image;
}

FramePixels with_infinity() {
  ImageF image(40, 30, 3, 1.0F);
  image.at(3, 4, 1) = std::numeric_limits<float>::infinity();
  return image;
}

constexpr PixelFormat rgb_float{PixelLayout::rgb, 16, true};

const std::vector<BadInput> bad_pictures{
    {"missing_frame", "frames/00002.png: cannot be read (No such file", {}, remove("frames/00002.png")},
    {"missing_first_frame", "frames/00000.png: cannot be read", {}, remove("frames/00000.png")},
    {"truncated_frame", "frames/00002.png: is truncated or damaged", {}, truncate_frame},
    {"damaged_frame", "frames/00002.png: is truncated or damaged", {}, damage_frame},
    {"empty_frame",
     "frames/00002.png: is empty",
     {},
     [](const fs::path& folder) { test::write_bytes(folder / "frames/00002.png", ""); }},
    {"no_picture",
     "frames/00002.png: is no PNG, TIFF or EXR",
     {},
     [](const fs::path& folder) { test::write_bytes(folder / "frames/00002.png", "hello, this is text"); }},
    {"folder_as_frame",
     "frames/00002.png: is a folder",
     {},
     [](const fs::path& folder) {
       fs::remove(folder / "frames/00002.png");
       fs::create_directory(folder / "frames/00002.png");
     }},
    {"other_size",
     "frames/00002.png: has 32 x 30 pixels, the first frame (00000.png) 40 x 30",
     {},
     picture("frames/00002.png", test::random_codes(32, 30, 1, 12))},
    {"other_size_in_sweep",
     "sweep/nd1.png: has 40 x 31 pixels",
     {},
     picture("sweep/nd1.png", test::random_codes(40, 31, 1, 12))},
    {"other_size_of_scene",
     "scene.png: has 41 x 30 pixels",
     {},
     picture("scene.png", test::random_codes(41, 30, 1, 12))},
    {"code_above_bits",
     "frames/00002.png: pixel (7, 5): has code 4096, but 12 bits end at 4095: correct pixel_format",
     {},
     picture("frames/00002.png", codes_with(4096))},
    {"codes_in_high_bits",
     "frames/00002.png: pixel (33, 22): has code 65520, but 12 bits end at 4095: the codes lie "
     "in the high bits, shift them right by 4",
     {},
     [](const fs::path& folder) {
       ImageU16 codes = test::random_codes(40, 30, 1, 12);
       for (std::uint16_t& code : codes.data) code = static_cast<std::uint16_t>(code << 4U);
       test::write_picture(folder / "frames/00002.png", codes, 16);
     }},
    {"eight_bits_for_twelve",
     "frames/00002.png: stores 8 bits, but pixel_format BayerRG12",
     {},
     picture("frames/00002.png", test::random_codes(40, 30, 1, 8), 8)},
    {"colour_for_mosaic",
     "frames/00002.png: has 3 channels, but pixel_format BayerRG12 in camera.json needs 1",
     {},
     picture("frames/00002.png", test::random_codes(40, 30, 3, 12))},
    {"float_for_codes",
     "frames/00002.png: holds floating point values, but pixel_format in camera.json is BayerRG12",
     {},
     [](const fs::path& folder) { write_exr(folder / "frames/00002.png", ImageF(40, 30, 1, 1.0F)); }},
    {"codes_for_float",
     "frames/00002.exr: holds integer codes, but pixel_format in camera.json is RGBFloat",
     {},
     [](const fs::path& folder) {
       test::write_bytes(folder / "frames/00002.exr", encode_tiff(test::random_codes(40, 30, 3, 12)));
     },
     rgb_float},
    {"infinite_value",
     "frames/00002.exr: pixel (3, 4), channel 1: is infinite",
     {},
     picture("frames/00002.exr", with_infinity()),
     rgb_float},
};

const std::vector<BadInput> bad_documents{
    {"exposure_zero", "frames.json: [2].exposure_s: is 0: give a number above 0",
     [](SmallRecording& r) { r.frames[2]["exposure_s"] = 0; }},
    {"exposure_negative",
     "frames.json: [2].exposure_s: is -1:", [](SmallRecording& r) { r.frames[2]["exposure_s"] = -1; }},
    {"exposure_nan", "frames.json: [2].exposure_s: is NaN (line ",
     [](SmallRecording& r) { r.frames[2]["exposure_s"] = 0.015625; }, text("frames.json", "0.015625", "NaN")},
    {"exposure_null", "frames.json: [2].exposure_s: is null: give a finite number",
     [](SmallRecording& r) { r.frames[2]["exposure_s"] = nullptr; }},
    {"exposure_text", "frames.json: [2].exposure_s: is \"1/100\": give a finite number",
     [](SmallRecording& r) { r.frames[2]["exposure_s"] = "1/100"; }},
    {"exposure_missing", "frames.json: [2].exposure_s: is missing: add it",
     [](SmallRecording& r) { r.frames[2].erase("exposure_s"); }},
    {"sweep_exposure_zero", "sweep.json: [1].exposure_s: is 0",
     [](SmallRecording& r) { r.sweep[1]["exposure_s"] = 0; }},
    {"density_negative", "sweep.json: [1].nd_density: is -0.3",
     [](SmallRecording& r) { r.sweep[1]["nd_density"] = -0.3; }},
    {"name_repeated", "frames.json: [2].frame: '00001.png' is listed twice",
     [](SmallRecording& r) { r.frames[2]["frame"] = "00001.png"; }},
    {"name_with_path", "frames.json: [2].frame: '../scene.png' is no file name",
     [](SmallRecording& r) { r.frames[2]["frame"] = "../scene.png"; }},
    {"name_missing", "frames.json: [2].frame: is missing", [](SmallRecording& r) { r.frames[2].erase("frame"); }},
    {"frame_key_unknown", "frames.json: [2].exposure: is no key of this file",
     [](SmallRecording& r) { r.frames[2]["exposure"] = 1; }},
    {"frames_empty", "frames.json: is no list of frames", [](SmallRecording& r) { r.frames = json::array(); }},
    {"frame_no_object", "frames.json: [2]: is no JSON object", [](SmallRecording& r) { r.frames[2] = "00002.png"; }},
    {"frames_syntax", "frames.json: [0]: is no valid JSON at line ", {}, text("frames.json", "{", "{{")},
    {"frames_cut", "frames.json: ", {}, [](const fs::path& folder) { fs::resize_file(folder / "frames.json", 100); }},
    {"frames_missing", "frames.json: cannot be read", {}, remove("frames.json")},
    {"camera_missing", "camera.json: cannot be read", {}, remove("camera.json")},
    {"format_unknown", "camera.json: pixel_format: 'BayerXY12' is unknown",
     [](SmallRecording& r) { r.camera["pixel_format"] = "BayerXY12"; }},
    {"format_missing", "camera.json: pixel_format: is missing",
     [](SmallRecording& r) { r.camera.erase("pixel_format"); }},
    {"bits_contradict", "camera.json: bits: is 10, but pixel_format BayerRG12 has 12",
     [](SmallRecording& r) { r.camera["bits"] = 10; }},
    {"camera_key_unknown", "camera.json: black_level: is no key of this file",
     [](SmallRecording& r) { r.camera["black_level"] = 64; }},
    {"black_level_too_high", "camera.json: black_level_hint: is 4096",
     [](SmallRecording& r) { r.camera["black_level_hint"] = 4096; }},
    {"reflectance_above_one", "camera.json: mirror_reflectance: is 92",
     [](SmallRecording& r) { r.camera["mirror_reflectance"] = 92; }},
    {"family_unknown", "target.json: family: 'tag99h9' is no tag family known here",
     [](SmallRecording& r) { r.target["family"] = "tag99h9"; }},
    {"world_family_unknown", "world.json: family: 'chessboard'",
     [](SmallRecording& r) { r.world["family"] = "chessboard"; }},
    {"tags_overlap", "target.json: tags[1]: tags 0 and 1 overlap",
     [](SmallRecording& r) {
       r.target["tags"][1]["centre_m"] = {-0.19, 0.13};
     }},
    {"tag_on_mirror", "target.json: tags[1]: tag 1 overlaps the mirror's opening",
     [](SmallRecording& r) {
       r.target["tags"][1]["centre_m"] = {0.1, 0.05};
     }},
    {"tag_repeated", "target.json: tags[1].id: tag 0 is listed twice",
     [](SmallRecording& r) { r.target["tags"][1]["id"] = 0; }},
    {"target_key_unknown", "target.json: tags[1].center_m: is no key",
     [](SmallRecording& r) {
       r.target["tags"][1]["center_m"] = {0, 0};
     }},
    {"target_missing", "target.json: cannot be read", {}, remove("target.json")},
    {"world_tags_overlap", "world.json: tags[1]: tags 100 and 101 overlap",
     [](SmallRecording& r) {
       r.world["tags"][1]["centre_in_world_m"] = {-0.15, 0.01, 0};
     }},
    {"tag_in_both", "world.json: tags[0].id: tag 1 is in target.json too",
     [](SmallRecording& r) { r.world["tags"][0]["id"] = 1; }},
    {"reference_outside", "reference.json: pixel: (39, 15.5) with radius 3 reaches outside of the 40 x 30 picture",
     [](SmallRecording& r) {
       r.reference["pixel"] = {39, 15.5};
     }},
    {"reference_of_no_scene", "reference.json: frame: '00000.png' is no scene picture",
     [](SmallRecording& r) { r.reference["frame"] = "00000.png"; }},
    {"reference_channels", "reference.json: radiance_rgb: needs 3 finite numbers",
     [](SmallRecording& r) {
       r.reference["radiance_rgb"] = {1, 2};
     }},
    {"reference_dark", "reference.json: radiance_rgb: has 0",
     [](SmallRecording& r) {
       r.reference["radiance_rgb"] = {1, 0, 1};
     }},
    {"sweep_without_list", "sweep.json: is missing, but there is a folder sweep",
     [](SmallRecording& r) { r.sweep = nullptr; }},
    {"two_scenes",
     "scene.tif: is a second scene picture beside scene.png",
     {},
     picture("scene.tif", test::random_codes(40, 30, 1, 12))},
};

const auto name_of = [](const testing::TestParamInfo<BadInput>& info) { return std::string(info.param.name); };
INSTANTIATE_TEST_SUITE_P(Pictures, ImportRefuses, testing::ValuesIn(bad_pictures), name_of);
INSTANTIATE_TEST_SUITE_P(Documents, ImportRefuses, testing::ValuesIn(bad_documents), name_of);

TEST(ImportCommand, PrintsASummaryForPeopleAndForPrograms) {
  const test::TemporaryFolder folder;
  SmallRecording().write(folder / "in");
  const auto text_outcome = test::run_command({program, "import", folder / "in", "-o", folder / "S"});
  EXPECT_EQ(text_outcome.exit_code, 0) << text_outcome.err;
  EXPECT_TRUE(contains(text_outcome.out, "4 mirror frames, 1 scene, 3 sweep; 40 x 30 BayerRG12"));
  const auto outcome = test::run_command({program, "import", folder / "in", "-o", folder / "T", "--json"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  const json summary = json::parse(outcome.out);
  EXPECT_EQ(summary["mirror_frames"], 4);
  EXPECT_EQ(summary["scene_exposure_s"], 0.01);
  EXPECT_TRUE(outcome.err.empty()) << outcome.err;
}

TEST(ImportCommand, UsageErrorsExitWithTwo) {
  EXPECT_EQ(test::run_command({program, "import"}).exit_code, 2);
  EXPECT_EQ(test::run_command({program, "import", "somewhere"}).exit_code, 2);
  const auto missing = test::run_command({program, "import", "/nonexistent", "-o", "/nonexistent_out"});
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_TRUE(contains(missing.err, "/nonexistent: is no folder"));
}

// A disk that fills up at the index, at the first frame, in the middle, at the end: a small tmpfs in a namespace of its
// own, so that nothing stays mounted.
TEST(ImportCommand, AFullDiskIsOneLineAndNothingIsLeft) {
  const test::TemporaryFolder folder;
  fs::create_directory(folder / "disk");
  const std::string mount = fmt::format("mount -t tmpfs -o size=16k tmpfs '{}'", (folder / "disk").string());
  if (test::run_command({"unshare", "-m", "sh", "-c", mount}).exit_code != 0)
    GTEST_SKIP() << "no right to mount a small file system here";
  SmallRecording().write(folder / "in");
  int full = 0;
  for (int kib = 4; kib <= 96; kib += 8) {
    const std::string script = fmt::format(
        "mount -t tmpfs -o size={}k tmpfs '{}/disk' && {} import '{}/in' -o '{}/disk/S'; code=$?; ls -A '{}/disk'; "
        "exit $code",
        kib, folder.path().string(), program, folder.path().string(), folder.path().string(), folder.path().string());
    const auto outcome = test::run_command({"unshare", "-m", "sh", "-c", script});
    if (outcome.exit_code == 0) continue;  // large enough
    ++full;
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_EQ(outcome.error_lines(), 1) << outcome.err;
    EXPECT_TRUE(contains(outcome.err, "free space") || contains(outcome.err, "free some space")) << outcome.err;
    EXPECT_TRUE(outcome.out.empty()) << kib << " KiB left: " << outcome.out;
  }
  EXPECT_GE(full, 4);
}

}  // namespace
}  // namespace mf
