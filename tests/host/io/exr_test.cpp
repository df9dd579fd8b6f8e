// SPDX-License-Identifier: Apache-2.0
#include "host/io/exr.h"

#include <OpenEXR/ImfRgbaFile.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/file_bytes.h"
#include "tests/support/expect_input_error.h"
#include "tests/support/foreign_png.h"
#include "tests/support/pictures.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_folder.h"

namespace mf {
namespace {

using test::contains;
using test::input_error_of;

TEST(Exr, FloatRoundTripsBitForBit) {
  const test::TemporaryFolder folder;
  for (const int channels : {1, 3}) {
    const ImageF image = test::random_radiances(37, 23, channels);
    write_exr(folder / "f.exr", image, {.half = false});
    const ImageF read = read_exr(folder / "f.exr");
    EXPECT_EQ(read.width, 37);
    EXPECT_EQ(read.height, 23);
    EXPECT_EQ(read.channels, channels);
    EXPECT_EQ(read.data, image.data);
  }
}

TEST(Exr, HalfRoundTripsWithinItsPrecision) {
  const test::TemporaryFolder folder;
  const ImageF image = test::random_radiances(37, 23, 3);
  write_exr(folder / "h.exr", image);
  const ImageF read = read_exr(folder / "h.exr");
  for (std::size_t i = 0; i < image.data.size(); ++i)  // 11 significant bits
    EXPECT_NEAR(read.data[i], image.data[i], std::abs(image.data[i]) / 2048);
}

// OpenEXR's own reader for pictures, which no code of ours goes through, sees the same colours in the same places.
TEST(Exr, OpenExrsPictureReaderAgrees) {
  const test::TemporaryFolder folder;
  ImageF image(5, 4, 3);
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 5; ++x)
      for (int c = 0; c < 3; ++c) image.at(x, y, c) = static_cast<float>(100 * c + 10 * y + x);
  write_exr(folder / "f.exr", image);
  Imf::RgbaInputFile input((folder / "f.exr").c_str());
  std::vector<Imf::Rgba> pixels(20);
  input.setFrameBuffer(pixels.data(), 1, 5);
  input.readPixels(0, 3);
  EXPECT_EQ(static_cast<float>(pixels[5 * 2 + 3].r), 23);
  EXPECT_EQ(static_cast<float>(pixels[5 * 2 + 3].g), 123);
  EXPECT_EQ(static_cast<float>(pixels[5 * 2 + 3].b), 223);
}

TEST(Exr, AlphaIsWrittenAndLeftUnread) {
  const test::TemporaryFolder folder;
  const ImageF image = test::random_radiances(8, 8, 4);
  write_exr(folder / "a.exr", image, {.half = false});
  const ImageF read = read_exr(folder / "a.exr");
  ASSERT_EQ(read.channels, 3);
  EXPECT_EQ(read.at(5, 6, 2), image.at(5, 6, 2));
}

TEST(Exr, AttributesAreWhatExrheaderPrints) {
  if (!test::has_program("exrheader")) GTEST_SKIP() << "no exrheader (Debian package openexr)";
  const test::TemporaryFolder folder;
  write_exr(folder / "l.exr", ImageF(8, 4, 3, 1.0F), {.latlong = true, .attributes = {{"orientation", "blender"}}});
  const std::string header = test::run_command({"exrheader", (folder / "l.exr").string()}).out;
  EXPECT_TRUE(contains(header, "chromaticities"));
  for (const char* primary : {"red   (0.64 0.33)", "green (0.3 0.6)", "blue  (0.15 0.06)", "white (0.3127 0.329)"})
    EXPECT_TRUE(contains(header, primary));
  EXPECT_TRUE(contains(header, "latitude-longitude"));
  EXPECT_TRUE(contains(header, "orientation (type string): \"blender\""));
  EXPECT_TRUE(contains(header, "R, 16-bit floating-point"));
}

TEST(Exr, BadFilesAreOneLineThatNamesThem) {
  const test::TemporaryFolder folder;
  const auto error = [&](const char* name) { return input_error_of([&] { (void)read_exr(folder / name); }); };
  EXPECT_TRUE(contains(error("none.exr"), "none.exr: cannot be read"));
  write_exr(folder / "whole.exr", test::random_radiances(40, 40, 3));
  const std::string whole = read_file_bytes(folder / "whole.exr");
  for (std::size_t size = 0; size < whole.size(); size += 211) {
    test::write_bytes(folder / "cut.exr", whole.substr(0, size));
    EXPECT_TRUE(contains(error("cut.exr"), "cut.exr: ")) << size;
  }
  ImageF image(6, 5, 3, 1.0F);
  image.at(4, 2, 1) = std::numeric_limits<float>::quiet_NaN();
  write_exr(folder / "nan.exr", image);
  EXPECT_TRUE(contains(error("nan.exr"), "nan.exr: pixel (4, 2), channel 1: is not a number"));
  image.at(4, 2, 1) = std::numeric_limits<float>::infinity();
  write_exr(folder / "inf.exr", image);
  EXPECT_TRUE(contains(error("inf.exr"), "inf.exr: pixel (4, 2), channel 1: is infinite"));
}

TEST(Exr, AFailedWriteLeavesNothing) {
  const test::TemporaryFolder folder;
  EXPECT_TRUE(contains(input_error_of([&] { write_exr(folder / "none/f.exr", ImageF(4, 4, 1)); }), "f.exr"));
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace mf
