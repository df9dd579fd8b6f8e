// SPDX-License-Identifier: Apache-2.0
#include "common/session_header.h"

#include <fmt/format.h>

#include "common/error.h"
#include "common/json_file.h"

namespace mf {

namespace {

using nlohmann::json;

json target_to_json(const MirrorTarget& target) {
  json tags = json::array();
  for (const PlanarTag& tag : target.tags)
    tags.push_back({{"id", tag.id}, {"centre_m", {tag.centre_m.x(), tag.centre_m.y()}}});
  return {{"family", target.family},
          {"tag_size_m", target.tags.empty() ? 0.0 : target.tags.front().size_m},
          {"opening_m", {target.opening_m.x(), target.opening_m.y()}},
          {"tags", tags}};
}

json world_to_json(const WorldTarget& world) {
  const auto list = [](const Eigen::Vector3d& v) { return json{v.x(), v.y(), v.z()}; };
  json tags = json::array();
  for (const WorldTag& tag : world.tags)
    tags.push_back({{"id", tag.id}, {"size_m", tag.size_m}, {"centre_in_world_m", list(tag.centre_in_world)}});
  json document = {{"family", world.family}, {"tags", tags}};
  if (world.checkerboard)
    document["checkerboard"] = {{"squares", world.checkerboard->squares},
                                {"centre_in_world_m", list(world.checkerboard->centre_in_world)},
                                {"size_m", {world.checkerboard->size_m.x(), world.checkerboard->size_m.y()}}};
  return document;
}

SessionHeader::Reference reference_from_json(const json& document, const std::string& file) {
  SessionHeader::Reference reference;
  reference.frame = json_field<std::string>(document, "frame", file);
  const auto pixel = json_field<std::array<double, 2>>(document, "pixel", file);
  reference.x_px = pixel[0];
  reference.y_px = pixel[1];
  reference.radius_px = json_field<double>(document, "radius_px", file);
  reference.radiance = json_field<std::vector<double>>(document, "radiance", file);
  return reference;
}

}  // namespace

std::map<std::string, json> session_header_to_json(const SessionHeader& header) {
  std::map<std::string, json> documents;
  documents["camera"] = {{"pixel_format", pixel_format_name(header.format)},
                         {"width", header.width},
                         {"height", header.height},
                         {"black_level_hint", header.black_level_hint},
                         {"mirror_reflectance", header.mirror_reflectance}};
  documents["target"] = target_to_json(header.target);
  if (header.world) documents["world"] = world_to_json(*header.world);
  if (header.reference)
    documents["reference"] = {{"frame", header.reference->frame},
                              {"pixel", {header.reference->x_px, header.reference->y_px}},
                              {"radius_px", header.reference->radius_px},
                              {"radiance", header.reference->radiance}};
  return documents;
}

SessionHeader session_header_from_json(const std::map<std::string, json>& documents, const std::string& file) {
  const auto find = [&](const std::string& key) {
    const auto found = documents.find(key);
    return found == documents.end() ? nullptr : &found->second;
  };
  const json* camera = find("camera");
  const json* target = find("target");
  if (camera == nullptr || target == nullptr)
    throw InputError(file, camera == nullptr ? "camera" : "target",
                     "is missing from the table meta: the session was never begun; record or import it again");
  SessionHeader header;
  const auto name = json_field<std::string>(*camera, "pixel_format", file);
  const std::optional<PixelFormat> format = parse_pixel_format(name);
  if (!format) throw InputError(file, "pixel_format", fmt::format("'{}' is unknown: the index is damaged", name));
  header.format = *format;
  header.width = json_field<int>(*camera, "width", file);
  header.height = json_field<int>(*camera, "height", file);
  header.black_level_hint = json_field<double>(*camera, "black_level_hint", file);
  header.mirror_reflectance = json_field<double>(*camera, "mirror_reflectance", file);
  header.target = mirror_target_from_json(*target, file);
  if (const json* world = find("world")) header.world = world_target_from_json(*world, file);
  if (const json* reference = find("reference")) header.reference = reference_from_json(*reference, file);
  return header;
}

}  // namespace mf
