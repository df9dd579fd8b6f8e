// SPDX-License-Identifier: Apache-2.0
#include "host/io/exr.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfChromaticities.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStdIO.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstring>
#include <sstream>
#include <vector>

#include "common/atomic_file.h"
#include "common/check.h"
#include "common/error.h"
#include "common/file_bytes.h"

namespace mf {

namespace {

constexpr std::int64_t max_pixels = 1LL << 28;  // beyond any picture of ours; a damaged header must not allocate memory

// EXR data in memory, so that a missing file is told by one function and OpenEXR can only complain about content.
class MemoryStream : public Imf::IStream {
 public:
  MemoryStream(std::string_view bytes, const std::string& name) : Imf::IStream(name.c_str()), bytes_(bytes) {}
  bool read(char target[], int count) override {
    const auto size = static_cast<std::uint64_t>(count);
    if (position_ + size > bytes_.size()) throw std::runtime_error("unexpected end of file");
    std::memcpy(target, bytes_.data() + position_, size);
    position_ += size;
    return position_ < bytes_.size();
  }
  std::uint64_t tellg() override { return position_; }
  void seekg(std::uint64_t position) override { position_ = std::min<std::uint64_t>(position, bytes_.size()); }

 private:
  std::string_view bytes_;
  std::uint64_t position_ = 0;
};

std::vector<std::string> colour_channels(const Imf::ChannelList& channels, const std::string& file) {
  std::vector<std::string> names{"R", "G", "B"};
  const auto has = [&](const char* name) { return channels.findChannel(name) != nullptr; };
  if (!has("R") || !has("G") || !has("B")) {
    if (!has("Y")) throw InputError(file, "channels", "has neither R, G, B nor Y: save it with one of these sets");
    names = {"Y"};
  }
  for (const std::string& name : names) {
    const Imf::Channel& channel = channels[name];
    if (channel.xSampling != 1 || channel.ySampling != 1)
      throw InputError(file, "channels", fmt::format("{} is subsampled: save it at full resolution", name));
  }
  return names;
}

ImageF read_channels(Imf::InputFile& input, const std::string& file) {
  const Imath::Box2i window = input.header().dataWindow();
  const std::int64_t width = std::int64_t{window.max.x} - window.min.x + 1;
  const std::int64_t height = std::int64_t{window.max.y} - window.min.y + 1;
  if (width <= 0 || height <= 0 || width * height > max_pixels)
    throw InputError(file, "dataWindow", fmt::format("claims {} x {} pixels: the file is damaged", width, height));
  const std::vector<std::string> names = colour_channels(input.header().channels(), file);
  ImageF image(static_cast<int>(width), static_cast<int>(height), static_cast<int>(names.size()));
  const std::size_t x_stride = names.size() * sizeof(float);
  const std::size_t y_stride = x_stride * static_cast<std::size_t>(width);
  Imf::FrameBuffer buffer;
  for (std::size_t c = 0; c < names.size(); ++c)
    buffer.insert(names[c], Imf::Slice::Make(Imf::FLOAT, image.data.data() + c, window, x_stride, y_stride));
  input.setFrameBuffer(buffer);
  input.readPixels(window.min.y, window.max.y);
  return image;
}

void require_finite(const ImageF& image, const std::string& file) {
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      for (int c = 0; c < image.channels; ++c)
        if (!std::isfinite(image.at(x, y, c)))
          throw InputError(file, fmt::format("pixel ({}, {}), channel {}", x, y, c),
                           std::isnan(image.at(x, y, c)) ? "is not a number: repair the picture"
                                                         : "is infinite: bring it down to a finite value");
}

}  // namespace

ImageF read_exr(const std::filesystem::path& path) {
  return decode_exr(read_file_bytes(path), path.string());
}

ImageF decode_exr(std::string_view bytes, const std::string& file) {
  ImageF image;
  try {
    MemoryStream stream(bytes, file);
    Imf::InputFile input(stream);
    image = read_channels(input, file);
  } catch (const InputError&) {
    throw;
  } catch (const std::exception& e) {  // Iex exceptions derive from it
    throw InputError(file, "",
                     fmt::format("is no EXR, or is truncated or damaged ({}): copy or make it again", e.what()));
  }
  require_finite(image, file);
  return image;
}

namespace {

Imf::Header header_for(const ImageF& image, const ExrOptions& options) {
  Imf::Header header(image.width, image.height);
  header.compression() = Imf::ZIP_COMPRESSION;
  Imf::addChromaticities(header, Imf::Chromaticities());  // its defaults are BT.709 with D65
  if (options.latlong) Imf::addEnvmap(header, Imf::ENVMAP_LATLONG);
  for (const auto& [name, value] : options.attributes) header.insert(name, Imf::StringAttribute(value));
  return header;
}

std::vector<half> to_half(const ImageF& image) {
  std::vector<half> values(image.data.size());
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = half(image.data[i]);
  return values;
}

}  // namespace

void write_exr(const std::filesystem::path& path, const ImageF& image, const ExrOptions& options) {
  check(!image.empty() && (image.channels == 1 || image.channels == 3 || image.channels == 4),
        "an EXR has 1, 3 or 4 channels");
  constexpr std::array<const char*, 4> colours{"R", "G", "B", "A"};
  const auto channels = static_cast<std::size_t>(image.channels);
  const Imf::PixelType type = options.half ? Imf::HALF : Imf::FLOAT;
  const std::vector<half> halves = options.half ? to_half(image) : std::vector<half>();
  const std::size_t sample = options.half ? sizeof(half) : sizeof(float);
  const char* pixels =
      options.half ? reinterpret_cast<const char*>(halves.data()) : reinterpret_cast<const char*>(image.data.data());
  Imf::Header header = header_for(image, options);
  Imf::FrameBuffer buffer;
  for (std::size_t c = 0; c < channels; ++c) {
    const char* name = channels == 1 ? "Y" : colours.at(c);
    header.channels().insert(name, Imf::Channel(type));
    // A frame buffer serves reading too, hence not const; an output file only reads it.
    buffer.insert(name, Imf::Slice(type, const_cast<char*>(pixels) + c * sample, channels * sample,
                                   channels * sample * static_cast<std::size_t>(image.width)));
  }
  // Into memory first: OpenEXR's destructor writes the line table and would swallow "disk full".
  Imf::StdOSStream stream;
  {
    Imf::OutputFile output(stream, header);
    output.setFrameBuffer(buffer);
    output.writePixels(image.height);
  }
  write_file_atomically(path, stream.str());
}

}  // namespace mf
