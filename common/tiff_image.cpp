// SPDX-License-Identifier: Apache-2.0
#include "common/tiff_image.h"

#include <fmt/format.h>
#include <tiffio.h>

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <memory>
#include <span>
#include <vector>

#include "common/check.h"
#include "common/error.h"
#include "common/fast_deflate.h"
#include "common/literal_deflate.h"

namespace mf {

namespace {

constexpr int fastest_deflate = 1;  // frames are noise-limited: higher levels cost three times the time for 3 % less
constexpr std::uint32_t strip_bytes = 1U << 18U;   // one strip fits the second-level cache
constexpr std::uint64_t max_pixels = 1ULL << 28U;  // beyond any sensor; a damaged header must not allocate memory

// What libtiff reads from or writes to, and the first error it met. One per call: no state is shared among threads.
struct MemoryFile {
  std::string_view source;
  std::string written;
  std::uint64_t position = 0;
  bool writing = false;
  std::string error;

  [[nodiscard]] std::uint64_t size() const { return writing ? written.size() : source.size(); }
};

MemoryFile& memory_file(thandle_t handle) {
  return *static_cast<MemoryFile*>(handle);
}

tmsize_t read_memory(thandle_t handle, void* buffer, tmsize_t size) {
  MemoryFile& file = memory_file(handle);
  const std::string_view all = file.writing ? std::string_view(file.written) : file.source;
  const std::uint64_t left = file.position < all.size() ? all.size() - file.position : 0;
  const std::uint64_t count = std::min(left, static_cast<std::uint64_t>(size));
  if (count > 0) std::memcpy(buffer, all.data() + file.position, count);
  file.position += count;
  return static_cast<tmsize_t>(count);
}

tmsize_t write_memory(thandle_t handle, void* buffer, tmsize_t size) {
  MemoryFile& file = memory_file(handle);
  const std::string_view bytes(static_cast<const char*>(buffer), static_cast<std::size_t>(size));
  try {
    if (file.position > file.written.size()) file.written.resize(file.position);
    const std::size_t over = std::min<std::size_t>(bytes.size(), file.written.size() - file.position);
    file.written.replace(file.position, over, bytes);  // at the end, where nearly all goes, that appends
  } catch (const std::bad_alloc&) {
    return -1;  // no exception may cross libtiff's C frames
  }
  file.position += bytes.size();
  return size;
}

toff_t seek_memory(thandle_t handle, toff_t offset, int whence) {
  MemoryFile& file = memory_file(handle);
  if (whence == SEEK_SET) file.position = offset;
  if (whence == SEEK_CUR) file.position += offset;
  if (whence == SEEK_END) file.position = file.size() + offset;
  return file.position;
}

int close_memory(thandle_t) {
  return 0;
}

toff_t size_of_memory(thandle_t handle) {
  return memory_file(handle).size();
}

int map_memory(thandle_t handle, void** base, toff_t* size) {
  const MemoryFile& file = memory_file(handle);
  if (file.writing) return 0;
  *base = const_cast<char*>(file.source.data());  // libtiff only reads what it maps
  *size = file.source.size();
  return 1;
}

void unmap_memory(thandle_t, void*, toff_t) {}

int remember_error(TIFF*, void* user_data, const char*, const char* format, va_list arguments) {
  auto& file = *static_cast<MemoryFile*>(user_data);
  if (!file.error.empty()) return 1;
  char line[256];
  std::vsnprintf(line, sizeof line, format, arguments);
  file.error = line;
  return 1;  // handled: libtiff prints nothing
}

int ignore_warning(TIFF*, void*, const char*, const char*, va_list) {
  return 1;
}

struct TiffCloser {
  void operator()(TIFF* tiff) const { TIFFClose(tiff); }
};
using TiffHandle = std::unique_ptr<TIFF, TiffCloser>;

TiffHandle open_tiff(MemoryFile& file) {
  const std::unique_ptr<TIFFOpenOptions, decltype(&TIFFOpenOptionsFree)> options(TIFFOpenOptionsAlloc(),
                                                                                 &TIFFOpenOptionsFree);
  TIFFOpenOptionsSetErrorHandlerExtR(options.get(), remember_error, &file);
  TIFFOpenOptionsSetWarningHandlerExtR(options.get(), ignore_warning, nullptr);
  return TiffHandle(TIFFClientOpenExt("tiff", file.writing ? "w" : "r", &file, read_memory, write_memory, seek_memory,
                                      close_memory, size_of_memory, map_memory, unmap_memory, options.get()));
}

struct Layout {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint16_t bits = 1;
  std::uint16_t samples = 1;
  std::uint16_t format = SAMPLEFORMAT_UINT;
  bool separate_planes = false;
  std::uint32_t block_width = 0;  // a tile, or a strip as wide as the picture
  std::uint32_t block_height = 0;
  bool tiled = false;
  int channels = 1;
};

[[noreturn]] void refuse(const std::string& file, const std::string& what) {
  throw InputError(file, "", what);
}

void require_supported(const Layout& layout, std::uint16_t photometric, std::uint16_t orientation,
                       const std::string& file) {
  const bool codes = layout.format == SAMPLEFORMAT_UINT && (layout.bits == 8 || layout.bits == 16);
  const bool floats = layout.format == SAMPLEFORMAT_IEEEFP && layout.bits == 32;
  if (!codes && !floats)
    refuse(file, fmt::format("has {} bit samples of TIFF format {}: save it with 8 or 16 bit unsigned or 32 bit float "
                             "samples",
                             layout.bits, layout.format));
  if (photometric != PHOTOMETRIC_MINISBLACK && photometric != PHOTOMETRIC_RGB && photometric != PHOTOMETRIC_CFA)
    refuse(file, fmt::format("has photometric interpretation {}: save it as grey or RGB", photometric));
  if (layout.samples < layout.channels) refuse(file, "has fewer samples a pixel than colours: it is damaged");
  if (orientation != ORIENTATION_TOPLEFT)
    refuse(file, fmt::format("is stored turned (orientation {}): save it upright, first row at the top", orientation));
  if (layout.width == 0 || layout.height == 0 ||
      std::uint64_t{layout.width} * std::uint64_t{layout.height} > max_pixels)
    refuse(file, fmt::format("claims {} x {} pixels: it is damaged", layout.width, layout.height));
}

Layout read_layout(TIFF* tiff, const std::string& file) {
  Layout layout;
  std::uint16_t photometric = PHOTOMETRIC_MINISBLACK;
  std::uint16_t planar = PLANARCONFIG_CONTIG;
  std::uint16_t orientation = ORIENTATION_TOPLEFT;
  TIFFGetField(tiff, TIFFTAG_IMAGEWIDTH, &layout.width);
  TIFFGetField(tiff, TIFFTAG_IMAGELENGTH, &layout.height);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_BITSPERSAMPLE, &layout.bits);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLESPERPIXEL, &layout.samples);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLEFORMAT, &layout.format);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_PLANARCONFIG, &planar);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_ORIENTATION, &orientation);
  TIFFGetField(tiff, TIFFTAG_PHOTOMETRIC, &photometric);
  layout.channels = photometric == PHOTOMETRIC_RGB ? 3 : 1;
  layout.separate_planes = planar == PLANARCONFIG_SEPARATE && layout.samples > 1;
  require_supported(layout, photometric, orientation, file);
  layout.tiled = TIFFIsTiled(tiff) != 0;
  if (layout.tiled) {
    TIFFGetField(tiff, TIFFTAG_TILEWIDTH, &layout.block_width);
    TIFFGetField(tiff, TIFFTAG_TILELENGTH, &layout.block_height);
  } else {
    layout.block_width = layout.width;
    TIFFGetFieldDefaulted(tiff, TIFFTAG_ROWSPERSTRIP, &layout.block_height);
    layout.block_height = std::min(layout.block_height, layout.height);
  }
  if (layout.block_width == 0 || layout.block_height == 0) refuse(file, "has empty tiles or strips: it is damaged");
  return layout;
}

// Copies one decoded tile or strip at (x0, y0) into the picture. A block of one plane fills channel `plane` only.
template <typename Stored, typename Pixel>
void copy_block(const std::vector<unsigned char>& block, const Layout& layout, std::uint32_t x0, std::uint32_t y0,
                int plane, Image<Pixel>& image) {
  const std::size_t block_samples = layout.separate_planes ? 1 : layout.samples;
  const std::uint32_t columns = std::min(layout.block_width, layout.width - x0);
  const std::uint32_t rows = std::min(layout.block_height, layout.height - y0);
  const int first = layout.separate_planes ? plane : 0;
  const int last = layout.separate_planes ? plane + 1 : layout.channels;
  for (std::uint32_t row = 0; row < rows; ++row) {
    const unsigned char* source = block.data() + std::size_t{row} * layout.block_width * block_samples * sizeof(Stored);
    Pixel* target = &image.at(static_cast<int>(x0), static_cast<int>(y0 + row));
    for (std::uint32_t x = 0; x < columns; ++x, target += image.channels)
      for (int c = first; c < last; ++c) {
        Stored value;  // memcpy: the block has no alignment to speak of
        std::memcpy(&value, source + (x * block_samples + static_cast<std::size_t>(c - first)) * sizeof(Stored),
                    sizeof value);
        target[c] = value;
      }
  }
}

template <typename Stored, typename Pixel>
Image<Pixel> read_blocks(TIFF* tiff, const Layout& layout, const RowRange& wanted, const MemoryFile& memory,
                         const std::string& file) {
  Image<Pixel> image(static_cast<int>(layout.width), static_cast<int>(layout.height), layout.channels);
  const tmsize_t block_size = layout.tiled ? TIFFTileSize(tiff) : TIFFStripSize(tiff);
  std::vector<unsigned char> block(static_cast<std::size_t>(std::max<tmsize_t>(block_size, 0)));
  const tmsize_t row_size = layout.tiled ? TIFFTileRowSize(tiff) : TIFFScanlineSize(tiff);
  const int planes = layout.separate_planes ? layout.channels : 1;
  const auto is_wanted = [&](std::uint32_t y) {
    return std::int64_t{y} + layout.block_height > wanted.begin && std::int64_t{y} < wanted.end;
  };
  for (int plane = 0; plane < planes; ++plane)
    for (std::uint32_t y = 0; y < layout.height; y += layout.block_height)
      for (std::uint32_t x = 0; is_wanted(y) && x < layout.width; x += layout.block_width) {
        const auto sample = static_cast<std::uint16_t>(plane);
        const tmsize_t got =
            layout.tiled ? TIFFReadEncodedTile(tiff, TIFFComputeTile(tiff, x, y, 0, sample), block.data(), block_size)
                         : TIFFReadEncodedStrip(tiff, TIFFComputeStrip(tiff, y, sample), block.data(), block_size);
        const std::uint32_t rows =
            layout.tiled ? layout.block_height : std::min(layout.block_height, layout.height - y);
        if (got < row_size * static_cast<tmsize_t>(rows) || !memory.error.empty())
          refuse(file, fmt::format("is truncated or damaged ({}): copy or record it again",
                                   memory.error.empty() ? "rows are missing" : memory.error));
        copy_block<Stored>(block, layout, x, y, plane, image);
      }
  return image;
}

// More than half of them zero: a picture without noise, or without light. Of every 61 values one is looked at.
bool repeats_itself(std::span<const std::uint16_t> differences) {
  constexpr std::size_t each = 61;  // hardly a divisor of a row's length: all columns get their turn
  std::size_t zeros = 0, seen = 0;
  for (std::size_t i = 0; i < differences.size(); i += each, ++seen) zeros += differences[i] == 0 ? 1 : 0;
  return 2 * zeros > seen;
}

// Each row as the differences of its neighbours, channel by channel (TIFF 6.0, section 14), deflated: what libtiff
// writes with PREDICTOR_HORIZONTAL, but fast enough for a camera.
void write_deflated_strip(TIFF* tiff, std::uint32_t strip, std::span<const std::uint16_t> pixels,
                          std::size_t row_length, std::size_t channels) {
  thread_local std::vector<std::uint16_t> differences;
  thread_local std::string deflated;
  differences.resize(pixels.size());
  for (std::size_t begin = 0; begin < pixels.size(); begin += row_length) {
    const std::uint16_t* from = pixels.data() + begin;
    std::uint16_t* to = differences.data() + begin;
    std::copy_n(from, channels, to);
    for (std::size_t i = channels; i < row_length; ++i)
      to[i] = static_cast<std::uint16_t>(from[i] - from[i - channels]);
  }
  deflated.clear();
  if (repeats_itself(differences))
    append_deflated({reinterpret_cast<const std::uint8_t*>(differences.data()), 2 * differences.size()}, deflated);
  else
    append_deflated_literals(differences, deflated);
  const auto size = static_cast<tmsize_t>(deflated.size());
  check(TIFFWriteRawStrip(tiff, strip, deflated.data(), size) == size, "a TIFF strip is written to memory");
}

template <typename Pixel>
void write_strips(TIFF* tiff, const Image<Pixel>& image, std::uint32_t rows_per_strip, TiffCompression compression) {
  const auto height = static_cast<std::uint32_t>(image.height);
  const std::size_t row_length = image.row(0).size();
  for (std::uint32_t y = 0, strip = 0; y < height; y += rows_per_strip, ++strip) {
    const std::size_t rows = std::min(rows_per_strip, height - y);
    const std::span<const Pixel> pixels(image.row(static_cast<int>(y)).data(), rows * row_length);
    if constexpr (std::is_same_v<Pixel, std::uint16_t>)
      if (compression == TiffCompression::deflate) {
        write_deflated_strip(tiff, strip, pixels, row_length, static_cast<std::size_t>(image.channels));
        continue;
      }
    Pixel* first = const_cast<Pixel*>(pixels.data());  // libtiff only reads it
    const auto size = static_cast<tmsize_t>(pixels.size_bytes());
    check(TIFFWriteEncodedStrip(tiff, strip, first, size) == size, "a TIFF strip is written to memory");
  }
}

template <typename Pixel>
std::string encode(const Image<Pixel>& image, TiffCompression compression) {
  check(image.channels == 1 || image.channels == 3, "a TIFF has one or three channels");
  constexpr bool is_float = std::is_same_v<Pixel, float>;
  MemoryFile memory;
  memory.writing = true;
  const std::size_t raw_bytes = image.data.size() * sizeof(Pixel);
  memory.written.reserve((compression == TiffCompression::none ? raw_bytes : raw_bytes / 4 * 3) + 4096);
  const TiffHandle handle = open_tiff(memory);
  check(handle != nullptr, "a TIFF opens in memory");
  TIFF* tiff = handle.get();
  const auto height = static_cast<std::uint32_t>(image.height);
  const auto row_bytes = static_cast<std::uint32_t>(image.row(0).size_bytes());
  const std::uint32_t rows_per_strip = std::clamp(strip_bytes / row_bytes, 1U, height);
  TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, static_cast<std::uint32_t>(image.width));
  TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, height);
  TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, static_cast<int>(8 * sizeof(Pixel)));
  TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, image.channels);
  TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, is_float ? SAMPLEFORMAT_IEEEFP : SAMPLEFORMAT_UINT);
  TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, image.channels == 3 ? PHOTOMETRIC_RGB : PHOTOMETRIC_MINISBLACK);
  TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
  TIFFSetField(tiff, TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT);
  if (compression == TiffCompression::deflate) {
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE);
    TIFFSetField(tiff, TIFFTAG_PREDICTOR, is_float ? PREDICTOR_FLOATINGPOINT : PREDICTOR_HORIZONTAL);
    TIFFSetField(tiff, TIFFTAG_ZIPQUALITY, fastest_deflate);
  } else {
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_NONE);
  }
  TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, rows_per_strip);
  write_strips(tiff, image, rows_per_strip, compression);
  check(TIFFFlush(tiff) == 1, "a TIFF is written to memory");
  return std::move(memory.written);
}

}  // namespace

StoredImage decode_tiff(std::string_view bytes, const std::string& file, const RowRange& rows) {
  MemoryFile memory;
  memory.source = bytes;
  const TiffHandle tiff = open_tiff(memory);
  if (tiff == nullptr)
    refuse(file, fmt::format("is no TIFF, or is damaged ({}): copy or record it again", memory.error));
  const Layout layout = read_layout(tiff.get(), file);
  if (layout.format == SAMPLEFORMAT_IEEEFP)
    return {read_blocks<float, float>(tiff.get(), layout, rows, memory, file), layout.bits};
  if (layout.bits == 8)
    return {read_blocks<std::uint8_t, std::uint16_t>(tiff.get(), layout, rows, memory, file), layout.bits};
  return {read_blocks<std::uint16_t, std::uint16_t>(tiff.get(), layout, rows, memory, file), layout.bits};
}

std::string encode_tiff(const FramePixels& pixels, TiffCompression compression) {
  return std::visit([&](const auto& image) { return encode(image, compression); }, pixels);
}

}  // namespace mf
