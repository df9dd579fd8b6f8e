// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/light_field_writer.h"

#include <ImfIO.h>
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>
#include <numeric>

#include "common/check.h"
#include "common/error.h"
#include "host/light_field/exr_chunk.h"
#include "host/light_field/half_floats.h"
#include "host/light_field/light_field_header.h"

namespace mf {

static_assert(std::endian::native == std::endian::little, "OpenEXR files are little endian");

namespace {

// OpenEXR file layout: magic number, version 2 with the flag "several parts", the parts' headers, an empty header, each
// part's table of chunk offsets, the chunks.
constexpr std::int32_t magic = 20000630;
constexpr std::int32_t version_of_several_parts = 2 | 0x1000;
constexpr int lines_a_chunk = 16;  // of a part with ZIP-compressed scan lines

class MemoryStream : public Imf::OStream {
 public:
  MemoryStream() : OStream("light field header") {}
  void write(const char* bytes, int count) override {
    const std::size_t end = position_ + static_cast<std::size_t>(count);
    if (bytes_.size() < end) bytes_.resize(end);
    std::memcpy(bytes_.data() + position_, bytes, static_cast<std::size_t>(count));
    position_ = end;
  }
  std::uint64_t tellp() override { return position_; }
  void seekp(std::uint64_t position) override { position_ = position; }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
  std::uint64_t position_ = 0;
};

int chunks_of(const ImageF& map) {
  return (map.height + lines_a_chunk - 1) / lines_a_chunk;
}

}  // namespace

LightFieldWriter::LightFieldWriter(const std::filesystem::path& path, const LightField& field)
    : path_(path), field_(field), file_(path), out_(file_.path(), std::ios::binary | std::ios::trunc) {
  if (!out_) fail();
  std::vector<Imf::Header> headers{header_of(field)};
  std::vector<int> chunk_counts{atlas_columns(field.directions.size()) * atlas_rows(field.directions.size())};
  for (const NamedMap& map : maps_of(field)) {
    headers.push_back(header_of(map, field.surroundings, headers.front().displayWindow()));
    chunk_counts.push_back(chunks_of(*map.map));
  }
  MemoryStream start;
  for (std::size_t part = 0; part < headers.size(); ++part) {
    headers[part].setChunkCount(chunk_counts[part]);
    headers[part].writeTo(start, part == 0);
  }
  start.write("", 1);  // the empty header
  write(&magic, sizeof magic);
  write(&version_of_several_parts, sizeof version_of_several_parts);
  write(start.bytes().data(), start.bytes().size());
  for (const int count : chunk_counts) {
    parts_.push_back({position_, {}});
    const std::vector<std::uint64_t> later(static_cast<std::size_t>(count), 0);
    write(later.data(), later.size() * sizeof later[0]);
  }
}

std::string LightFieldWriter::pack(const Eigen::Vector4f* tile, int resolution) {
  const std::size_t n = static_cast<std::size_t>(resolution);
  thread_local std::vector<std::uint16_t> halves;
  halves.resize(4 * n * n);
  constexpr std::array<Eigen::Index, 4> by_name{2, 1, 0, 3};  // B, G, R, confidence
  for (std::size_t y = 0; y < n; ++y)
    for (std::size_t c = 0; c < by_name.size(); ++c)
      for (std::size_t x = 0; x < n; ++x)
        halves[(y * by_name.size() + c) * n + x] = to_half(tile[y * n + x][by_name[c]]);
  return zip_chunk({reinterpret_cast<const std::uint8_t*>(halves.data()), 2 * halves.size()});
}

void LightFieldWriter::append(const std::string& packed) {
  const std::int32_t tile = static_cast<std::int32_t>(parts_.front().offsets.size());
  const int columns = atlas_columns(field_.directions.size());
  constexpr std::int32_t level = 0;
  write_chunk(0, {tile % columns, tile / columns, level, level}, packed);
}

void LightFieldWriter::finish() {
  check(parts_.front().offsets.size() == field_.directions.size(), "every direction has its tile");
  const std::vector<Eigen::Vector4f> unused(field_.texel_count(), Eigen::Vector4f::Zero());
  const std::string packed = pack(unused.data(), field_.resolution);
  const int tiles = atlas_columns(field_.directions.size()) * atlas_rows(field_.directions.size());
  while (parts_.front().offsets.size() < static_cast<std::size_t>(tiles)) append(packed);
  std::size_t part = 1;
  for (const NamedMap& map : maps_of(field_)) write_map(part++, *map.map, map.channels);
  fill_tables();
  out_.close();
  if (!out_) fail();
  file_.commit();
}

void LightFieldWriter::write(const void* bytes, std::size_t size) {
  out_.write(static_cast<const char*>(bytes), static_cast<std::streamsize>(size));
  if (!out_) fail();
  position_ += size;
}

void LightFieldWriter::write_chunk(std::size_t part, std::initializer_list<std::int32_t> place,
                                   const std::string& data) {
  parts_[part].offsets.push_back(position_);
  std::vector<std::int32_t> head{static_cast<std::int32_t>(part)};
  head.insert(head.end(), place);
  head.push_back(static_cast<std::int32_t>(data.size()));
  write(head.data(), head.size() * sizeof head[0]);
  write(data.data(), data.size());
}

void LightFieldWriter::write_map(std::size_t part, const ImageF& map, const std::vector<const char*>& channels) {
  std::vector<std::size_t> by_name(channels.size());
  std::iota(by_name.begin(), by_name.end(), std::size_t{0});
  std::sort(by_name.begin(), by_name.end(),
            [&](std::size_t a, std::size_t b) { return std::strcmp(channels[a], channels[b]) < 0; });
  for (int first = 0; first < map.height; first += lines_a_chunk) {
    std::vector<float> lines;
    for (int y = first; y < std::min(first + lines_a_chunk, map.height); ++y)
      for (const std::size_t c : by_name)
        for (int x = 0; x < map.width; ++x) lines.push_back(map.at(x, y, static_cast<int>(c)));
    write_chunk(part, {first},
                zip_chunk({reinterpret_cast<const std::uint8_t*>(lines.data()), lines.size() * sizeof lines[0]}));
  }
}

void LightFieldWriter::fill_tables() {
  for (const Part& part : parts_) {
    out_.seekp(static_cast<std::streamoff>(part.table_begin));
    write(part.offsets.data(), part.offsets.size() * sizeof part.offsets[0]);
  }
}

void LightFieldWriter::fail() const {
  throw InputError(path_.string(), "",
                   fmt::format("cannot be written ({}): check the folder, its permissions and the free space",
                               std::strerror(errno != 0 ? errno : EIO)));
}

void write_light_field(const std::filesystem::path& path, const LightField& field) {
  LightFieldWriter writer(path, field);
  for (std::size_t i = 0; i < field.directions.size(); ++i)
    writer.append(LightFieldWriter::pack(field.tile(i), field.resolution));
  writer.finish();
}

}  // namespace mf
