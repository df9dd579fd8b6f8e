// SPDX-License-Identifier: Apache-2.0
#include "hw-sim/picture_files.h"

#include <ImfRgbaFile.h>
#include <ImfStandardAttributes.h>
#include <fmt/format.h>
#include <png.h>

#include <cstdio>
#include <memory>

#include "common/atomic_file.h"
#include "common/check.h"
#include "common/error.h"

namespace mf::sim {

namespace {

struct FileCloser {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

[[noreturn]] void fail(const std::filesystem::path& file) {
  throw InputError(file.string(), "", "cannot be written: check the disk's space and the folder's permissions");
}

// libpng reports errors by longjmp; no object with a destructor may live in this frame.
bool encode_png16(std::FILE* file, const ImageU16& codes, const png_bytep* rows) {
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  if (setjmp(png_jmpbuf(png)) != 0) {
    png_destroy_write_struct(&png, &info);
    return false;
  }
  png_init_io(png, file);
  png_set_IHDR(png, info, static_cast<png_uint_32>(codes.width), static_cast<png_uint_32>(codes.height), 16,
               PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_compression_level(png, 3);
  png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_NONE);  // neighbours of a mosaic differ in colour
  png_write_info(png, info);
  png_set_swap(png);  // PNG is big-endian
  png_write_image(png, const_cast<png_bytepp>(rows));
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  return true;
}

}  // namespace

void write_png16(const std::filesystem::path& path, const ImageU16& codes) {
  check(codes.channels == 1, "a mosaic has one channel");
  std::vector<png_bytep> rows;
  rows.reserve(static_cast<std::size_t>(codes.height));
  for (int y = 0; y < codes.height; ++y)
    rows.push_back(const_cast<png_bytep>(reinterpret_cast<const png_byte*>(codes.row(y).data())));
  const std::unique_ptr<std::FILE, FileCloser> file(std::fopen(path.c_str(), "wb"));
  if (!file || !encode_png16(file.get(), codes, rows.data()) || std::fflush(file.get()) != 0) fail(path);
}

void write_rgb_exr(const std::filesystem::path& path, const ImageF& rgb) {
  check(rgb.channels == 3, "a picture has three channels");
  std::vector<Imf::Rgba> pixels;
  pixels.reserve(rgb.data.size() / 3);
  for (std::size_t i = 0; i < rgb.data.size(); i += 3)
    pixels.emplace_back(half(rgb.data[i]), half(rgb.data[i + 1]), half(rgb.data[i + 2]));
  Imf::Header header(rgb.width, rgb.height);
  Imf::addChromaticities(header, Imf::Chromaticities());  // the default is BT.709
  try {
    Imf::RgbaOutputFile file(path.c_str(), header, Imf::WRITE_RGB);
    file.setFrameBuffer(pixels.data(), 1, static_cast<std::size_t>(rgb.width));
    file.writePixels(rgb.height);
  } catch (const std::exception&) {
    fail(path);
  }
}

void write_obj(const std::filesystem::path& path, const Mesh& mesh) {
  std::string text = "# made by mirrorfield-sim; metres, world frame, Z up\n";
  for (const Eigen::Vector3f& v : mesh.vertices)
    fmt::format_to(std::back_inserter(text), "v {:.6f} {:.6f} {:.6f}\n", v.x(), v.y(), v.z());
  for (const auto& t : mesh.triangles)
    fmt::format_to(std::back_inserter(text), "f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
  write_file_atomically(path, text);
}

}  // namespace mf::sim
