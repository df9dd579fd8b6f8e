// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/light_field_header.h"

#include <ImathMatrix.h>
#include <ImathVec.h>
#include <ImfChannelList.h>
#include <ImfFloatAttribute.h>
#include <ImfFloatVectorAttribute.h>
#include <ImfHeader.h>
#include <ImfIntAttribute.h>
#include <ImfMatrixAttribute.h>
#include <ImfPartType.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <ImfTileDescriptionAttribute.h>
#include <ImfVecAttribute.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/error.h"

namespace mf {

int atlas_columns(std::size_t directions) {
  return static_cast<int>(std::ceil(std::sqrt(static_cast<double>(directions))));
}
int atlas_rows(std::size_t directions) {
  const int columns = atlas_columns(directions);
  return (static_cast<int>(directions) + columns - 1) / columns;
}

// ---- writing ----

namespace {

constexpr int format_version = 1;

void describe(const ShadedEmitter& e, Imf::Header& header) {
  const auto vector = [](const Eigen::Vector3f& v) { return Imf::V3fAttribute({v.x(), v.y(), v.z()}); };
  header.insert("mfPosition", vector(e.emitter.position));
  header.insert("mfRadiance", vector(e.radiance));
  header.insert("mfRadius", Imf::FloatAttribute(e.emitter.radius_m));
  header.insert("mfViews", Imf::IntAttribute(e.emitter.views));
  header.insert("mfOccluderShare", Imf::FloatAttribute(e.occluder_share));
  header.insert("mfPlaneHeight", Imf::FloatAttribute(e.plane_height_m));
  header.insert("mfMaskMin", Imf::V2fAttribute({e.mask_min_m.x(), e.mask_min_m.y()}));
  header.insert("mfMaskMax", Imf::V2fAttribute({e.mask_max_m.x(), e.mask_max_m.y()}));
}

// What the map of distances is a picture of, where that has a shape of its own.
void describe_shape(const Surroundings& s, Imf::Header& header) {
  if (s.box) {
    header.insert("mfBoxMin", Imf::V2fAttribute({s.box->low.x(), s.box->low.y()}));
    header.insert("mfBoxMax", Imf::V3fAttribute({s.box->high.x(), s.box->high.y(), s.box->ceiling}));
  }
  if (!s.mesh_file.empty()) header.insert("mfMesh", Imf::StringAttribute(s.mesh_file));
}

}  // namespace

Imf::Header header_of(const LightField& field) {
  const int columns = atlas_columns(field.directions.size());
  Imf::Header header(columns * field.resolution, atlas_rows(field.directions.size()) * field.resolution);
  for (const char* name : tile_channels) header.channels().insert(name, Imf::Channel(Imf::HALF));
  header.setTileDescription(
      Imf::TileDescription(static_cast<unsigned>(field.resolution), static_cast<unsigned>(field.resolution)));
  header.compression() = Imf::ZIP_COMPRESSION;
  header.setName("field");
  header.setType(Imf::TILEDIMAGE);
  Imf::addChromaticities(header, Imf::Chromaticities());  // BT.709
  header.insert("mfVersion", Imf::IntAttribute(format_version));
  header.insert("mfResolution", Imf::IntAttribute(field.resolution));
  header.insert("mfFrequency", Imf::IntAttribute(field.directions.frequency));
  header.insert("mfAbsolute", Imf::IntAttribute(field.absolute ? 1 : 0));
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

std::vector<NamedMap> maps_of(const LightField& field) {
  const Surroundings& s = field.surroundings;
  std::vector<NamedMap> maps;
  if (!s.inverse_distance.empty()) maps.push_back({"inverseDistance", {"Y"}, &s.inverse_distance});
  if (!s.confidence.empty()) maps.push_back({"distanceConfidence", {"Y"}, &s.confidence});
  if (!s.panorama.empty()) maps.push_back({"panorama", {"R", "G", "B", "A"}, &s.panorama});
  for (std::size_t i = 0; i < field.emitters.size(); ++i)
    maps.push_back(
        {fmt::format("emitter{}", i), {"visibility", "weight", "share"}, &field.emitters[i].mask, &field.emitters[i]});
  return maps;
}

Imf::Header header_of(const NamedMap& map, const Surroundings& s, const Imath::Box2i& display_window) {
  Imf::Header header(display_window, Imath::Box2i({0, 0}, {map.map->width - 1, map.map->height - 1}));
  header.setName(map.name);
  header.setType(Imf::SCANLINEIMAGE);
  header.compression() = Imf::ZIP_COMPRESSION;
  Imf::addChromaticities(header, Imf::Chromaticities());
  for (const char* channel : map.channels) header.channels().insert(channel, Imf::Channel(Imf::FLOAT));
  header.insert("mfCentre", Imf::V3fAttribute({s.centre_in_world.x(), s.centre_in_world.y(), s.centre_in_world.z()}));
  if (map.emitter != nullptr) describe(*map.emitter, header);
  if (map.map == &s.inverse_distance) describe_shape(s, header);
  return header;
}

// ---- reading ----

namespace {

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

}  // namespace

LightField field_without_texels(const Imf::Header& header, const std::string& file) {
  LightField field;
  if (attribute<Imf::IntAttribute>(header, "mfVersion", file) != format_version)
    throw InputError(file, "mfVersion", fmt::format("is not {}: resample again with this version", format_version));
  field.resolution = attribute<Imf::IntAttribute>(header, "mfResolution", file);
  field.absolute = attribute<Imf::IntAttribute>(header, "mfAbsolute", file) != 0;
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
  const Imath::Box2i& window = header.dataWindow();
  if (field.resolution < 2 || field.resolution > 1024 || !header.hasTileDescription() ||
      header.tileDescription().xSize != static_cast<unsigned>(field.resolution) ||
      window.max.x - window.min.x + 1 != atlas_columns(field.directions.size()) * field.resolution ||
      window.max.y - window.min.y + 1 != atlas_rows(field.directions.size()) * field.resolution)
    throw InputError(file, "dataWindow", "does not fit mfResolution and mfDirections: resample again");
  return field;
}

Eigen::Vector3f centre_from(const Imf::Header& header, const std::string& file) {
  const Imath::V3f& centre = attribute<Imf::V3fAttribute>(header, "mfCentre", file);
  return {centre.x, centre.y, centre.z};
}

void shape_from(const Imf::Header& header, Surroundings& s) {
  const auto* low = header.findTypedAttribute<Imf::V2fAttribute>("mfBoxMin");
  const auto* high = header.findTypedAttribute<Imf::V3fAttribute>("mfBoxMax");
  if (low != nullptr && high != nullptr)
    s.box = RoomBox{{low->value().x, low->value().y}, {high->value().x, high->value().y}, high->value().z};
  if (const auto* mesh = header.findTypedAttribute<Imf::StringAttribute>("mfMesh")) s.mesh_file = mesh->value();
}

ShadedEmitter emitter_from(const Imf::Header& header, const std::string& path) {
  const auto vector = [&](const char* name) {
    const Imath::V3f& v = attribute<Imf::V3fAttribute>(header, name, path);
    return Eigen::Vector3f(v.x, v.y, v.z);
  };
  const auto vector2 = [&](const char* name) {
    const Imath::V2f& v = attribute<Imf::V2fAttribute>(header, name, path);
    return Eigen::Vector2f(v.x, v.y);
  };
  ShadedEmitter e;
  e.emitter = {vector("mfPosition"), attribute<Imf::FloatAttribute>(header, "mfRadius", path),
               attribute<Imf::IntAttribute>(header, "mfViews", path)};
  e.radiance = vector("mfRadiance");
  e.occluder_share = attribute<Imf::FloatAttribute>(header, "mfOccluderShare", path);
  e.plane_height_m = attribute<Imf::FloatAttribute>(header, "mfPlaneHeight", path);
  e.mask_min_m = vector2("mfMaskMin");
  e.mask_max_m = vector2("mfMaskMax");
  return e;
}

}  // namespace mf
