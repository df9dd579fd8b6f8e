// SPDX-License-Identifier: Apache-2.0
#include "host/io/png_image.h"

#include <fmt/format.h>
#include <png.h>

#include <bit>
#include <csetjmp>
#include <cstring>
#include <vector>

#include "common/check.h"
#include "common/error.h"

namespace mf {

namespace {

constexpr png_uint_32 max_side = 1U << 16U;  // beyond any sensor; a damaged header must not allocate memory

// libpng leaves through longjmp, which skips destructors. So every function between setjmp and libpng owns nothing:
// the buffers live in the callers, and errors are thrown only after the jump.
struct PngError {
  char message[160] = "";
};

[[noreturn]] void jump_with_error(png_structp png, png_const_charp message) {
  auto* error = static_cast<PngError*>(png_get_error_ptr(png));
  std::strncpy(error->message, message, sizeof error->message - 1);
  png_longjmp(png, 1);
}

void ignore_warning(png_structp, png_const_charp) {}

class PngReader {
 public:
  PngReader()
      : png_(png_create_read_struct(PNG_LIBPNG_VER_STRING, &error_, jump_with_error, ignore_warning)),
        info_(png_create_info_struct(png_)) {
    check(png_ != nullptr && info_ != nullptr, "libpng starts");
  }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;
  ~PngReader() { png_destroy_read_struct(&png_, &info_, nullptr); }

  [[nodiscard]] png_structp png() const { return png_; }
  [[nodiscard]] png_infop info() const { return info_; }
  [[nodiscard]] const char* message() const { return error_.message; }

 private:
  PngError error_;
  png_structp png_;
  png_infop info_;
};

class PngWriter {
 public:
  PngWriter()
      : png_(png_create_write_struct(PNG_LIBPNG_VER_STRING, &error_, jump_with_error, ignore_warning)),
        info_(png_create_info_struct(png_)) {
    check(png_ != nullptr && info_ != nullptr, "libpng starts");
  }
  PngWriter(const PngWriter&) = delete;
  PngWriter& operator=(const PngWriter&) = delete;
  ~PngWriter() { png_destroy_write_struct(&png_, &info_); }

  [[nodiscard]] png_structp png() const { return png_; }
  [[nodiscard]] png_infop info() const { return info_; }

 private:
  PngError error_;
  png_structp png_;
  png_infop info_;
};

struct Source {
  const char* bytes;
  std::size_t left;
};

void read_source(png_structp png, png_bytep target, std::size_t count) {
  auto* source = static_cast<Source*>(png_get_io_ptr(png));
  if (count > source->left) png_error(png, "unexpected end of file");
  std::memcpy(target, source->bytes, count);
  source->bytes += count;
  source->left -= count;
}

// Both return false after an error, whose message the reader holds.
bool read_png_header(const PngReader& reader, Source& source) {
  if (setjmp(png_jmpbuf(reader.png())) != 0) return false;
  png_set_user_limits(reader.png(), max_side, max_side);
  png_set_read_fn(reader.png(), &source, read_source);
  png_read_info(reader.png(), reader.info());
  return true;
}

bool read_png_rows(const PngReader& reader, png_bytep* rows) {
  if (setjmp(png_jmpbuf(reader.png())) != 0) return false;
  if (std::endian::native == std::endian::little && png_get_bit_depth(reader.png(), reader.info()) == 16)
    png_set_swap(reader.png());  // PNG is big-endian
  png_set_strip_alpha(reader.png());
  png_set_interlace_handling(reader.png());
  png_read_update_info(reader.png(), reader.info());
  png_read_image(reader.png(), rows);
  png_read_end(reader.png(), nullptr);
  return true;
}

template <typename Sample>
bool read_pixels(const PngReader& reader, ImageU16& image) {
  Image<Sample> stored(image.width, image.height, image.channels);
  std::vector<png_bytep> rows(static_cast<std::size_t>(image.height));
  for (int y = 0; y < image.height; ++y)
    rows[static_cast<std::size_t>(y)] = reinterpret_cast<png_bytep>(stored.row(y).data());
  if (!read_png_rows(reader, rows.data())) return false;
  image.data.assign(stored.data.begin(), stored.data.end());
  return true;
}

[[noreturn]] void refuse_damaged(const PngReader& reader, const std::string& file) {
  throw InputError(file, "", fmt::format("is truncated or damaged ({}): copy or record it again", reader.message()));
}

}  // namespace

StoredImage decode_png(std::string_view bytes, const std::string& file) {
  const PngReader reader;
  Source source{bytes.data(), bytes.size()};
  if (!read_png_header(reader, source)) refuse_damaged(reader, file);
  const int bits = png_get_bit_depth(reader.png(), reader.info());
  const int colour = png_get_color_type(reader.png(), reader.info());
  if ((colour & PNG_COLOR_MASK_PALETTE) != 0 || bits < 8)
    throw InputError(file, "",
                     fmt::format("is a PNG with {}: save it with 8 or 16 bits, grey or RGB",
                                 (colour & PNG_COLOR_MASK_PALETTE) != 0 ? "a palette" : fmt::format("{} bits", bits)));
  ImageU16 image(static_cast<int>(png_get_image_width(reader.png(), reader.info())),
                 static_cast<int>(png_get_image_height(reader.png(), reader.info())),
                 (colour & PNG_COLOR_MASK_COLOR) != 0 ? 3 : 1);
  const bool complete =
      bits == 8 ? read_pixels<std::uint8_t>(reader, image) : read_pixels<std::uint16_t>(reader, image);
  if (!complete) refuse_damaged(reader, file);
  return {std::move(image), bits};
}

std::optional<ImageU8> decode_png_alpha(std::string_view bytes, const std::string& file) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  const auto refuse = [&] {
    throw InputError(file, "", fmt::format("is truncated or damaged ({}): copy or record it again", png.message));
  };
  if (png_image_begin_read_from_memory(&png, bytes.data(), bytes.size()) == 0) refuse();
  const bool too_large = png.width > max_side || png.height > max_side;
  if (too_large || (png.format & PNG_FORMAT_FLAG_ALPHA) == 0) {
    png_image_free(&png);
    return std::nullopt;  // decode_png refuses what is too large
  }
  png.format = PNG_FORMAT_GA;
  std::vector<png_byte> grey_and_alpha(PNG_IMAGE_SIZE(png));
  if (png_image_finish_read(&png, nullptr, grey_and_alpha.data(), 0, nullptr) == 0) refuse();
  ImageU8 alpha(static_cast<int>(png.width), static_cast<int>(png.height), 1);
  for (std::size_t i = 0; i < alpha.data.size(); ++i) alpha.data[i] = grey_and_alpha[2 * i + 1];
  return alpha;
}

namespace {

void append_bytes(png_structp png, png_bytep bytes, std::size_t count) {
  static_cast<std::string*>(png_get_io_ptr(png))->append(reinterpret_cast<const char*>(bytes), count);
}

bool write_png_rows(const PngWriter& writer, std::string& target, const ImageU8& image, png_bytep* rows) {
  if (setjmp(png_jmpbuf(writer.png())) != 0) return false;
  png_set_write_fn(writer.png(), &target, append_bytes, nullptr);
  png_set_IHDR(writer.png(), writer.info(), static_cast<png_uint_32>(image.width),
               static_cast<png_uint_32>(image.height), 8,
               image.channels == 3 ? PNG_COLOR_TYPE_RGB : PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(writer.png(), writer.info());
  png_write_image(writer.png(), rows);
  png_write_end(writer.png(), nullptr);
  return true;
}

}  // namespace

std::string encode_png(const ImageU8& image) {
  check(!image.empty() && (image.channels == 1 || image.channels == 3), "a PNG of ours has 1 or 3 channels");
  const PngWriter writer;
  std::string bytes;
  std::vector<png_bytep> rows(static_cast<std::size_t>(image.height));
  // libpng's row pointers are not const; it only reads them.
  for (int y = 0; y < image.height; ++y) rows[static_cast<std::size_t>(y)] = const_cast<png_bytep>(image.row(y).data());
  check(write_png_rows(writer, bytes, image, rows.data()), "a PNG is written to memory");
  return bytes;
}

}  // namespace mf
