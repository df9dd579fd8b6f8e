// SPDX-License-Identifier: Apache-2.0
#include "host/io/image_file.h"

#include <gtest/gtest.h>

#include "common/file_bytes.h"
#include "host/io/exr.h"
#include "tests/support/expect_input_error.h"
#include "tests/support/foreign_png.h"
#include "tests/support/pictures.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_folder.h"

namespace mf {
namespace {

using test::contains;
using test::foreign_png;
using test::input_error_of;
using test::random_codes;
using test::write_bytes;

TEST(ImageFile, ReadsPngCodesAsTheyAre) {
  const test::TemporaryFolder folder;
  for (const int channels : {1, 3})
    for (const int bits : {8, 16}) {
      const ImageU16 codes = random_codes(31, 19, channels, bits);
      write_bytes(folder / "f.png", foreign_png(codes, bits));
      const StoredImage stored = read_stored_image(folder / "f.png");
      EXPECT_EQ(stored.bits_per_sample, bits);
      EXPECT_TRUE(test::same_pixels(stored.pixels, codes)) << channels << " channels, " << bits << " bits";
    }
}

TEST(ImageFile, DropsAlpha) {
  const test::TemporaryFolder folder;
  const ImageU16 codes = random_codes(9, 7, 4, 8);
  write_bytes(folder / "f.png", foreign_png(codes, 8));
  const ImageU16 read = std::get<ImageU16>(read_image(folder / "f.png"));
  ASSERT_EQ(read.channels, 3);
  for (int y = 0; y < 7; ++y)
    for (int x = 0; x < 9; ++x)
      for (int c = 0; c < 3; ++c) EXPECT_EQ(read.at(x, y, c), codes.at(x, y, c));
}

TEST(ImageFile, TheContentTellsTheKindNotTheName) {
  const test::TemporaryFolder folder;
  const ImageU16 codes = random_codes(9, 7, 1, 12);
  write_bytes(folder / "tiff.png", encode_tiff(codes));
  EXPECT_TRUE(test::same_pixels(read_image(folder / "tiff.png"), codes));
  const ImageF values = test::random_radiances(9, 7, 3);
  write_exr(folder / "exr.tif", values, {.half = false});
  EXPECT_TRUE(test::same_pixels(read_image(folder / "exr.tif"), values));
}

TEST(ImageFile, EveryTruncationOfAPngIsAnError) {
  const test::TemporaryFolder folder;
  const std::string whole = foreign_png(random_codes(40, 40, 1, 12), 16);
  for (std::size_t size = 0; size < whole.size(); size += size < 64 ? 1 : 131) {
    write_bytes(folder / "cut.png", whole.substr(0, size));
    EXPECT_TRUE(contains(input_error_of([&] { (void)read_image(folder / "cut.png"); }), "cut.png: ")) << size;
  }
}

// Every chunk of a PNG has a checksum: no flipped bit in the pixels goes unnoticed.
TEST(ImageFile, DamagedPngPixelsAreAnError) {
  const test::TemporaryFolder folder;
  const std::string whole = foreign_png(random_codes(40, 40, 1, 12), 16);
  const std::size_t pixels = whole.find("IDAT") + 4;
  for (std::size_t i = pixels; i + 16 < whole.size(); i += 61) {
    std::string damaged = whole;
    damaged[i] = static_cast<char>(damaged[i] ^ 0x10);
    write_bytes(folder / "bad.png", damaged);
    EXPECT_TRUE(contains(input_error_of([&] { (void)read_image(folder / "bad.png"); }), "truncated or damaged")) << i;
  }
}

TEST(ImageFile, RefusesWhatItWouldMisread) {
  const test::TemporaryFolder folder;
  const auto error = [&](const std::string& bytes) {
    write_bytes(folder / "f", bytes);
    return input_error_of([&] { (void)read_image(folder / "f"); });
  };
  EXPECT_TRUE(contains(error(test::foreign_palette_png()), "palette"));
  EXPECT_TRUE(contains(error("GIF89a..........."), "is no PNG, TIFF or EXR"));
  EXPECT_TRUE(contains(error(""), "is empty"));
  EXPECT_TRUE(contains(input_error_of([&] { (void)read_image(folder.path()); }), "is a folder"));
}

TEST(ImageFile, WhatIsWrittenIsReadByOpenCv) {
  if (test::run_command({"/usr/bin/python3", "-c", "import cv2"}).exit_code != 0) GTEST_SKIP() << "no python3-opencv";
  const test::TemporaryFolder folder;
  ImageU8 image(5, 4, 3);
  image.at(3, 2, 0) = 200;
  image.at(3, 2, 2) = 17;
  write_png(folder / "f.png", image);
  const auto outcome = test::run_command({"/usr/bin/python3", "-c",
                                          "import cv2, sys; a = cv2.imread(sys.argv[1], -1)\n"
                                          "assert a.shape == (4, 5, 3) and a.sum() == 217\n"
                                          "assert a[2, 3].tolist() == [17, 0, 200]",  // blue first
                                          (folder / "f.png").string()});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
}

// Anchors of IEC 61966-2-1: the ends, the linear toe, and 18 % grey, which is known as 118.
TEST(ImageFile, DisplayEncodingIsSrgb) {
  ImageF linear(6, 1, 1);
  linear.data = {-1.0F, 0.0F, 0.001F, 0.18F, 1.0F, 7.0F};
  EXPECT_EQ(to_srgb8(linear, 1).data, (std::vector<std::uint8_t>{0, 0, 3, 118, 255, 255}));
  linear.data = {-1.0F, 0.0F, 0.0005F, 0.09F, 0.5F, 3.5F};
  EXPECT_EQ(to_srgb8(linear, 2).data, (std::vector<std::uint8_t>{0, 0, 3, 118, 255, 255}));
}

TEST(ImageFile, DisplayExposureIgnoresALamp) {
  ImageF picture(100, 100, 3, 0.5F);
  for (int x = 0; x < 20; ++x) picture.at(x, 0) = 4000;
  EXPECT_NEAR(display_exposure(picture), 0.9 / 0.5, 1e-6);
}

}  // namespace
}  // namespace mf
