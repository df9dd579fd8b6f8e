// SPDX-License-Identifier: Apache-2.0
#include <ImfFrameBuffer.h>
#include <ImfInputPart.h>
#include <ImfMultiPartInputFile.h>
#include <ImfThreading.h>
#include <ImfTiledInputPart.h>
#include <fmt/format.h>
#include <half.h>

#include <algorithm>
#include <thread>

#include "common/error.h"
#include "host/light_field/light_field.h"
#include "host/light_field/light_field_header.h"

namespace mf {

namespace {

// One row of tiles, as half floats.
class TileRow {
 public:
  TileRow(int columns, int resolution)
      : resolution_(resolution),
        width_(columns * resolution),
        texels_(static_cast<std::size_t>(width_) * static_cast<std::size_t>(resolution) * 4) {}

  // A frame buffer that finds the atlas' row of tiles here.
  [[nodiscard]] Imf::FrameBuffer frame_buffer(int row) {
    Imf::FrameBuffer buffer;
    const std::size_t pixel = 4 * sizeof(half), line = pixel * static_cast<std::size_t>(width_);
    char* base = reinterpret_cast<char*>(texels_.data()) - static_cast<std::ptrdiff_t>(line) * row * resolution_;
    for (std::size_t c = 0; c < tile_channels.size(); ++c)
      buffer.insert(tile_channels[c], Imf::Slice(Imf::HALF, base + c * sizeof(half), pixel, line));
    return buffer;
  }
  [[nodiscard]] half* texel(int column, int x, int y) {
    return texels_.data() + 4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                                 static_cast<std::size_t>(column * resolution_ + x));
  }

 private:
  int resolution_;
  int width_;
  std::vector<half> texels_;
};

void read_tiles(Imf::MultiPartInputFile& file, LightField& field) {
  Imf::TiledInputPart in(file, 0);
  field.rgbc.resize(field.directions.size() * field.texel_count());
  const int columns = atlas_columns(field.directions.size()), n = field.resolution;
  TileRow row(columns, n);
  for (int r = 0; r < atlas_rows(field.directions.size()); ++r) {
    in.setFrameBuffer(row.frame_buffer(r));
    in.readTiles(0, columns - 1, r, r);
    for (int c = 0; c < columns; ++c) {
      const std::size_t direction =
          static_cast<std::size_t>(r) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(c);
      if (direction >= field.directions.size()) break;
      Eigen::Vector4f* tile = field.tile(direction);
      for (int y = 0; y < n; ++y)
        for (int x = 0; x < n; ++x)
          for (int i = 0; i < 4; ++i) tile[y * n + x][i] = static_cast<float>(row.texel(c, x, y)[i]);
    }
  }
}

Imf::FrameBuffer float_buffer(const std::vector<const char*>& channels, ImageF& map) {
  Imf::FrameBuffer buffer;
  char* base = reinterpret_cast<char*>(map.data.data());
  const std::size_t pixel = sizeof(float) * channels.size();
  for (std::size_t c = 0; c < channels.size(); ++c)
    buffer.insert(channels[c],
                  Imf::Slice(Imf::FLOAT, base + c * sizeof(float), pixel, pixel * static_cast<std::size_t>(map.width)));
  return buffer;
}

ImageF read_map(Imf::MultiPartInputFile& file, int part, const std::vector<const char*>& channels) {
  Imf::InputPart in(file, part);
  const Imath::Box2i window = in.header().dataWindow();
  ImageF map(window.max.x - window.min.x + 1, window.max.y - window.min.y + 1, static_cast<int>(channels.size()));
  in.setFrameBuffer(float_buffer(channels, map));
  in.readPixels(window.min.y, window.max.y);
  return map;
}

void read_maps(Imf::MultiPartInputFile& file, LightField& field, const std::string& path) {
  Surroundings& s = field.surroundings;
  for (int part = 1; part < file.parts(); ++part) {
    const std::string name = file.header(part).name();
    s.centre_in_world = centre_from(file.header(part), path);
    if (name == "inverseDistance") {
      s.inverse_distance = read_map(file, part, {"Y"});
      shape_from(file.header(part), s);
    }
    if (name == "distanceConfidence") s.confidence = read_map(file, part, {"Y"});
    if (name == "panorama") s.panorama = read_map(file, part, {"R", "G", "B", "A"});
    if (!name.starts_with("emitter")) continue;
    field.emitters.push_back(emitter_from(file.header(part), path));
    field.emitters.back().mask = read_map(file, part, {"visibility", "weight", "share"});
  }
}

void use_all_cores() {
  Imf::setGlobalThreadCount(static_cast<int>(std::max(1U, std::thread::hardware_concurrency())));
}

}  // namespace

LightField read_light_field(const std::filesystem::path& path) {
  use_all_cores();
  try {
    Imf::MultiPartInputFile in(path.c_str());
    LightField field = field_without_texels(in.header(0), path.string());
    read_tiles(in, field);
    read_maps(in, field, path.string());
    return field;
  } catch (const InputError&) {
    throw;
  } catch (const std::exception& e) {
    throw InputError(path.string(), "", fmt::format("is no readable light field ({}): resample again", e.what()));
  }
}

}  // namespace mf
