// SPDX-License-Identifier: Apache-2.0
#include "common/tiff_image.h"

#include <gtest/gtest.h>
#include <tiffio.h>

#include <algorithm>
#include <cmath>
#include <random>

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
using test::random_codes;
using test::random_radiances;
using test::same_pixels;
using test::write_bytes;

TEST(Tiff, RoundTripsEveryKindBitForBit) {
  const std::vector<FramePixels> pictures{random_codes(33, 17, 1, 16), random_codes(33, 17, 3, 16),
                                          random_radiances(33, 17, 1), random_radiances(33, 17, 3),
                                          random_codes(700, 900, 1, 12)};  // the last has many strips
  for (const FramePixels& pixels : pictures)
    EXPECT_TRUE(same_pixels(pixels, decode_tiff(encode_tiff(pixels), "f.tif").pixels));
}

// Shot noise over a bright window: what a camera sees. Rows of pure noise are the worst case of the Huffman code, as
// its counts are sampled; a black one is the best.
ImageU16 camera_codes(int width, int height, double electrons) {
  ImageU16 image(width, height, 1);
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const double code = x > width / 2 && y > height / 2 ? 5000 : 150 + 600 * (1 + std::sin(0.01 * x + 0.02 * y));
      image.at(x, y) = static_cast<std::uint16_t>(
          std::clamp(code + std::sqrt(code * 4095 / electrons) * normal(random), 0.0, 4095.0));
    }
  return image;
}

ImageU16 surprising_codes() {
  ImageU16 image(1024, 256, 1);
  std::mt19937 random(6);
  for (std::size_t i = 0; i < image.data.size(); ++i)
    if (i % 2048 >= 256) image.data[i] = static_cast<std::uint16_t>(random());
  return image;
}

TEST(Tiff, NoiseIsSmallerByWhatItsBitsAllow) {
  for (const int width : {1024, 1023, 7}) {
    const ImageU16 image = camera_codes(width, 700, 10000);
    const std::string bytes = encode_tiff(image);
    EXPECT_TRUE(same_pixels(image, decode_tiff(bytes, "f.tif").pixels));
    if (width > 1000) {
      EXPECT_LT(static_cast<double>(bytes.size()), 2.0 * width * 700 / 1.6);
    }
  }
  const ImageU16 worst = surprising_codes(), black(640, 480, 1);
  EXPECT_TRUE(same_pixels(worst, decode_tiff(encode_tiff(worst), "f.tif").pixels));
  EXPECT_LT(encode_tiff(black).size(), 8000U);
  EXPECT_TRUE(same_pixels(black, decode_tiff(encode_tiff(black), "f.tif").pixels));
}

// Only the strips that hold wanted rows are decoded; those rows are what they are.
TEST(Tiff, DecodesOnlyTheRowsThatAreWanted) {
  ImageU16 image(512, 1024, 1);
  for (std::size_t i = 0; i < image.data.size(); ++i) image.data[i] = static_cast<std::uint16_t>(1 + i % 4000);
  const auto part = std::get<ImageU16>(decode_tiff(encode_tiff(image), "f.tif", {300, 420}).pixels);
  ASSERT_EQ(part.height, image.height);
  for (int y = 300; y < 420; ++y)
    ASSERT_TRUE(std::equal(image.row(y).begin(), image.row(y).end(), part.row(y).begin())) << y;
  EXPECT_EQ(part.at(5, 0), 0);
  EXPECT_EQ(part.at(5, 1023), 0);
}

TEST(Tiff, EveryTruncationIsAnErrorThatNamesTheFile) {
  const std::string whole = encode_tiff(random_codes(64, 64, 1, 12));
  for (std::size_t size = 0; size < whole.size(); size += 97)
    EXPECT_TRUE(contains(input_error_of([&] { (void)decode_tiff(whole.substr(0, size), "cut.tif"); }), "cut.tif: "))
        << size;
}

// Damage anywhere may be read as other codes (the session's checksum finds that), but never crashes.
TEST(Tiff, DamageIsReadOrRefusedAndNothingElse) {
  const std::string whole = encode_tiff(random_codes(24, 24, 1, 12));
  for (std::size_t i = 0; i < whole.size(); ++i)
    for (const int flip : {0x01, 0x80, 0xFF}) {
      std::string damaged = whole;
      damaged[i] = static_cast<char>(damaged[i] ^ flip);
      try {
        (void)decode_tiff(damaged, "damaged.tif");
      } catch (const InputError&) {
        continue;
      }
    }
}

TEST(Tiff, OtherInflatersReadNoise) {
  const std::string program =
      "import sys, numpy as np; d = sys.argv[1] + '/'\n"
      "b = np.fromfile(d + 'noise.raw', np.uint16).reshape(300, 400)\n"
      "if sys.argv[2] == 'cv2': import cv2; a = cv2.imread(d + 'noise.tif', -1)\n"
      "else: import PIL.Image; a = np.array(PIL.Image.open(d + 'noise.tif'))\n"
      "assert (a == b).all()";
  const test::TemporaryFolder folder;
  const ImageU16 codes = camera_codes(400, 300, 8000);
  write_bytes(folder / "noise.tif", encode_tiff(codes));
  write_bytes(folder / "noise.raw", {reinterpret_cast<const char*>(codes.data.data()), codes.data.size() * 2});
  int readers = 0;
  for (const std::string reader : {"cv2", "PIL"}) {
    if (test::run_command({"/usr/bin/python3", "-c", "import numpy, " + reader}).exit_code != 0) continue;
    const auto outcome = test::run_command({"/usr/bin/python3", "-c", program, folder.path().string(), reader});
    EXPECT_EQ(outcome.exit_code, 0) << reader << ": " << outcome.err;
    ++readers;
  }
  if (readers == 0) GTEST_SKIP() << "neither python3-opencv nor python3-pil";
}

TEST(Tiff, OpenCvReadsWhatIsWritten) {
  if (test::run_command({"/usr/bin/python3", "-c", "import cv2"}).exit_code != 0) GTEST_SKIP() << "no python3-opencv";
  const test::TemporaryFolder folder;
  const ImageU16 codes = random_codes(40, 30, 1, 12);
  ImageF radiances = random_radiances(40, 30, 3);
  write_bytes(folder / "codes.tif", encode_tiff(codes));
  write_bytes(folder / "linear.tif", encode_tiff(radiances));
  write_bytes(folder / "codes.raw", {reinterpret_cast<const char*>(codes.data.data()), codes.data.size() * 2});
  write_bytes(folder / "linear.raw", {reinterpret_cast<const char*>(radiances.data.data()), radiances.data.size() * 4});
  const auto outcome = test::run_command(
      {"/usr/bin/python3", "-c",
       "import cv2, numpy as np, sys; d = sys.argv[1] + '/'\n"
       "a = cv2.imread(d + 'codes.tif', -1); b = np.fromfile(d + 'codes.raw', np.uint16).reshape(30, 40)\n"
       "assert a.dtype == np.uint16 and (a == b).all()\n"
       "a = cv2.imread(d + 'linear.tif', -1)[..., ::-1]; b = np.fromfile(d + 'linear.raw', np.float32)\n"
       "assert a.dtype == np.float32 and (a == b.reshape(30, 40, 3)).all()",
       folder.path().string()});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
}

// Files as other programs write them, made with libtiff: 8 bits, tiles, planes, LZW, alpha.
struct Foreign {
  std::uint16_t bits = 8, samples = 1, photometric = PHOTOMETRIC_MINISBLACK, planar = PLANARCONFIG_CONTIG;
  std::uint16_t compression = COMPRESSION_NONE, orientation = ORIENTATION_TOPLEFT;
  bool tiled = false;
};

constexpr int foreign_width = 20, foreign_height = 18;

std::uint8_t foreign_code(std::uint32_t x, std::uint32_t y, int sample) {
  return static_cast<std::uint8_t>((x * 7 + y * 11 + static_cast<std::uint32_t>(sample) * 50) % 256);
}

std::string foreign_tiff(const std::filesystem::path& file, const Foreign& kind) {
  TIFF* tiff = TIFFOpen(file.c_str(), "w");
  TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, foreign_width);
  TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, foreign_height);
  TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, kind.bits);
  TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, kind.samples);
  TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, kind.photometric);
  TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, kind.planar);
  TIFFSetField(tiff, TIFFTAG_COMPRESSION, kind.compression);
  TIFFSetField(tiff, TIFFTAG_ORIENTATION, kind.orientation);
  const std::uint32_t block = 16;
  const std::uint32_t block_width = kind.tiled ? block : foreign_width;
  if (kind.tiled) {
    TIFFSetField(tiff, TIFFTAG_TILEWIDTH, block);
    TIFFSetField(tiff, TIFFTAG_TILELENGTH, block);
  } else {
    TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, block);
  }
  const bool separate = kind.planar == PLANARCONFIG_SEPARATE;
  const int samples = separate ? 1 : kind.samples;
  const auto planes = static_cast<std::uint16_t>(separate ? kind.samples : 1);
  for (std::uint16_t plane = 0; plane < planes; ++plane)
    for (std::uint32_t y0 = 0; y0 < foreign_height; y0 += block)
      for (std::uint32_t x0 = 0; x0 < foreign_width; x0 += block_width) {
        const std::uint32_t rows = kind.tiled ? block : std::min<std::uint32_t>(block, foreign_height - y0);
        std::vector<std::uint8_t> data;
        for (std::uint32_t y = y0; y < y0 + rows; ++y)
          for (std::uint32_t x = x0; x < x0 + block_width; ++x)
            for (int s = 0; s < samples; ++s) data.push_back(foreign_code(x, y, separate ? plane : s));
        const auto size = static_cast<tmsize_t>(data.size());
        if (kind.tiled)
          TIFFWriteEncodedTile(tiff, TIFFComputeTile(tiff, x0, y0, 0, plane), data.data(), size);
        else
          TIFFWriteEncodedStrip(tiff, TIFFComputeStrip(tiff, y0, plane), data.data(), size);
      }
  TIFFClose(tiff);
  return read_file_bytes(file);
}

TEST(Tiff, ReadsWhatOtherProgramsWrite) {
  const test::TemporaryFolder folder;
  const std::uint16_t rgb = PHOTOMETRIC_RGB;
  const std::vector<Foreign> kinds{{.samples = 1},
                                   {.samples = 2},  // grey with alpha
                                   {.samples = 3, .photometric = rgb, .compression = COMPRESSION_LZW},
                                   {.samples = 4, .photometric = rgb, .planar = PLANARCONFIG_SEPARATE},
                                   {.samples = 3, .photometric = rgb, .tiled = true},
                                   {.samples = 3, .photometric = rgb, .planar = PLANARCONFIG_SEPARATE, .tiled = true}};
  for (const Foreign& kind : kinds) {
    const StoredImage stored = decode_tiff(foreign_tiff(folder / "foreign.tif", kind), "foreign.tif");
    EXPECT_EQ(stored.bits_per_sample, 8);
    const ImageU16& image = std::get<ImageU16>(stored.pixels);
    ASSERT_EQ(image.width, foreign_width);
    ASSERT_EQ(image.height, foreign_height);
    ASSERT_EQ(image.channels, kind.photometric == rgb ? 3 : 1);
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x)
        for (int c = 0; c < image.channels; ++c)
          ASSERT_EQ(image.at(x, y, c), foreign_code(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), c));
  }
}

TEST(Tiff, RefusesWhatItWouldMisread) {
  const test::TemporaryFolder folder;
  const auto refusal = [&](const Foreign& kind) {
    const std::string bytes = foreign_tiff(folder / "f.tif", kind);
    return input_error_of([&] { (void)decode_tiff(bytes, "f.tif"); });
  };
  EXPECT_TRUE(contains(refusal({.bits = 4}), "4 bit"));
  EXPECT_TRUE(contains(refusal({.photometric = PHOTOMETRIC_MINISWHITE}), "photometric"));
  EXPECT_TRUE(contains(refusal({.orientation = ORIENTATION_LEFTBOT}), "turned"));
  EXPECT_TRUE(contains(input_error_of([] { (void)decode_tiff("no picture", "f.tif"); }), "is no TIFF"));
}

TEST(FileBytes, Crc32IsTheOneOfZlib) {
  EXPECT_EQ(crc32(""), 0U);
  EXPECT_EQ(crc32("123456789"), 0xCBF43926U);  // the check value of the CRC catalogue
}

}  // namespace
}  // namespace mf
