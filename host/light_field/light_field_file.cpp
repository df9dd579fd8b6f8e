// SPDX-License-Identifier: Apache-2.0
#include <ImathMatrix.h>
#include <ImathVec.h>
#include <ImfChannelList.h>
#include <ImfDoubleAttribute.h>
#include <ImfFloatVectorAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfIntAttribute.h>
#include <ImfMatrixAttribute.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <ImfThreading.h>
#include <ImfTileDescriptionAttribute.h>
#include <ImfTiledInputFile.h>
#include <ImfTiledOutputFile.h>
#include <ImfVecAttribute.h>
#include <fmt/format.h>
#include <half.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "common/atomic_file.h"
#include "common/error.h"
#include "host/light_field/light_field.h"

namespace mf {

namespace {

constexpr int format_version = 1;
constexpr std::array<const char*, 4> channel_names{"R", "G", "B", "confidence"};

int atlas_columns(std::size_t directions) {
  return static_cast<int>(std::ceil(std::sqrt(static_cast<double>(directions))));
}
int atlas_rows(std::size_t directions) {
  const int columns = atlas_columns(directions);
  return (static_cast<int>(directions) + columns - 1) / columns;
}

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
    for (std::size_t c = 0; c < channel_names.size(); ++c)
      buffer.insert(channel_names[c], Imf::Slice(Imf::HALF, base + c * sizeof(half), pixel, line));
    return buffer;
  }
  [[nodiscard]] half* texel(int column, int x, int y) {
    return texels_.data() + 4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                                 static_cast<std::size_t>(column * resolution_ + x));
  }
  void clear() { std::fill(texels_.begin(), texels_.end(), half(0.0F)); }

 private:
  int resolution_;
  int width_;
  std::vector<half> texels_;
};

Imf::Header header_of(const LightField& field) {
  const int columns = atlas_columns(field.directions.size());
  Imf::Header header(columns * field.resolution, atlas_rows(field.directions.size()) * field.resolution);
  for (const char* name : channel_names) header.channels().insert(name, Imf::Channel(Imf::HALF));
  header.setTileDescription(
      Imf::TileDescription(static_cast<unsigned>(field.resolution), static_cast<unsigned>(field.resolution)));
  header.compression() = Imf::ZIP_COMPRESSION;
  Imf::addChromaticities(header, Imf::Chromaticities());  // BT.709
  header.insert("mfVersion", Imf::IntAttribute(format_version));
  header.insert("mfResolution", Imf::IntAttribute(field.resolution));
  header.insert("mfFrequency", Imf::IntAttribute(field.directions.frequency));
  header.insert("mfAbsolute", Imf::IntAttribute(field.absolute ? 1 : 0));
  header.insert("mfProxyRadius", Imf::DoubleAttribute(field.proxy.radius_m));
  header.insert("mfOptions", Imf::StringAttribute(field.options_json));
  const Eigen::Matrix4d m = field.plane.world_from_plane.matrix();
  Imath::M44d rows;
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) rows[r][c] = m(r, c);
  header.insert("mfWorldFromPlane", Imf::M44dAttribute(rows));
  header.insert("mfPlaneMin", Imf::V2dAttribute({field.plane.min_m.x(), field.plane.min_m.y()}));
  header.insert("mfPlaneMax", Imf::V2dAttribute({field.plane.max_m.x(), field.plane.max_m.y()}));
  Imf::FloatVector directions;
  for (const Eigen::Vector3f& d : field.directions.directions)
    directions.insert(directions.end(), {d.x(), d.y(), d.z()});
  header.insert("mfDirections", Imf::FloatVectorAttribute(directions));
  header.insert("mfSolidAngles", Imf::FloatVectorAttribute(field.directions.solid_angles_sr));
  return header;
}

template <typename Attribute>
const typename std::remove_reference_t<decltype(std::declval<const Attribute&>().value())>& attribute(
    const Imf::Header& header, const char* name, const std::string& file) {
  const Attribute* found = header.findTypedAttribute<Attribute>(name);
  if (found == nullptr)
    throw InputError(file, name, "is missing: this is no light field written by 'mirrorfield resample'");
  return found->value();
}

DirectionSet directions_of(const Imf::Header& header, const std::string& file) {
  const int frequency = attribute<Imf::IntAttribute>(header, "mfFrequency", file);
  if (frequency < 1 || frequency > 400) throw InputError(file, "mfFrequency", "is out of range: resample again");
  DirectionSet set = geodesic_hemisphere_of_frequency(frequency);
  const Imf::FloatVector& stored = attribute<Imf::FloatVectorAttribute>(header, "mfDirections", file);
  bool same = stored.size() == 3 * set.size();
  for (std::size_t i = 0; same && i < set.size(); ++i)
    same = (Eigen::Map<const Eigen::Vector3f>(stored.data() + 3 * i) - set.directions[i]).norm() < 1e-4F;
  if (!same) throw InputError(file, "mfDirections", "is not the geodesic set of mfFrequency: resample again");
  return set;
}

LightField field_without_texels(const Imf::Header& header, const std::string& file) {
  LightField field;
  if (attribute<Imf::IntAttribute>(header, "mfVersion", file) != format_version)
    throw InputError(file, "mfVersion", fmt::format("is not {}: resample again with this version", format_version));
  field.resolution = attribute<Imf::IntAttribute>(header, "mfResolution", file);
  field.absolute = attribute<Imf::IntAttribute>(header, "mfAbsolute", file) != 0;
  field.proxy.radius_m = attribute<Imf::DoubleAttribute>(header, "mfProxyRadius", file);
  field.options_json = attribute<Imf::StringAttribute>(header, "mfOptions", file);
  const Imath::M44d& rows = attribute<Imf::M44dAttribute>(header, "mfWorldFromPlane", file);
  Eigen::Matrix4d m;
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) m(r, c) = rows[r][c];
  const std::optional<Rigid3> world_from_plane = Rigid3::from_matrix(m);
  if (!world_from_plane) throw InputError(file, "mfWorldFromPlane", "is no rigid transform: resample again");
  field.plane.world_from_plane = *world_from_plane;
  const Imath::V2d low = attribute<Imf::V2dAttribute>(header, "mfPlaneMin", file);
  const Imath::V2d high = attribute<Imf::V2dAttribute>(header, "mfPlaneMax", file);
  field.plane.min_m = {low.x, low.y};
  field.plane.max_m = {high.x, high.y};
  field.directions = directions_of(header, file);
  const Imath::Box2i window = header.dataWindow();
  if (field.resolution < 2 || field.resolution > 1024 || !header.hasTileDescription() ||
      header.tileDescription().xSize != static_cast<unsigned>(field.resolution) ||
      window.max.x - window.min.x + 1 != atlas_columns(field.directions.size()) * field.resolution ||
      window.max.y - window.min.y + 1 != atlas_rows(field.directions.size()) * field.resolution)
    throw InputError(file, "dataWindow", "does not fit mfResolution and mfDirections: resample again");
  return field;
}

void use_all_cores() {
  Imf::setGlobalThreadCount(static_cast<int>(std::max(1U, std::thread::hardware_concurrency())));
}

}  // namespace

void write_light_field(const std::filesystem::path& path, const LightField& field) {
  use_all_cores();
  AtomicFile file(path);
  try {
    Imf::TiledOutputFile out(file.path().c_str(), header_of(field));
    const int columns = atlas_columns(field.directions.size()), n = field.resolution;
    TileRow row(columns, n);
    for (int r = 0; r < atlas_rows(field.directions.size()); ++r) {
      row.clear();
      for (int c = 0; c < columns; ++c) {
        const std::size_t direction =
            static_cast<std::size_t>(r) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(c);
        if (direction >= field.directions.size()) break;
        const Eigen::Vector4f* tile = field.tile(direction);
        for (int y = 0; y < n; ++y)
          for (int x = 0; x < n; ++x)
            for (int i = 0; i < 4; ++i)
              row.texel(c, x, y)[i] = half(std::min(tile[y * n + x][i], 65504.0F));  // largest half
      }
      out.setFrameBuffer(row.frame_buffer(r));
      out.writeTiles(0, columns - 1, r, r);
    }
  } catch (const std::exception& e) {
    throw InputError(
        path.string(), "",
        fmt::format("cannot be written ({}): check the folder, its permissions and the free space", e.what()));
  }
  file.commit();
}

LightField read_light_field(const std::filesystem::path& path) {
  use_all_cores();
  try {
    Imf::TiledInputFile in(path.c_str());
    LightField field = field_without_texels(in.header(), path.string());
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
    return field;
  } catch (const InputError&) {
    throw;
  } catch (const std::exception& e) {
    throw InputError(path.string(), "", fmt::format("is no readable light field ({}): resample again", e.what()));
  }
}

}  // namespace mf
