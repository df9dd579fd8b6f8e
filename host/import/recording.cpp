// SPDX-License-Identifier: Apache-2.0
#include "host/import/recording.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "common/error.h"
#include "common/json_file.h"
#include "host/import/json_entry.h"

namespace mf {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// The camera, and the scene picture's exposure when it is said.
struct Camera {
  PixelFormat format;
  double black_level_hint = 0;
  double mirror_reflectance = 1;
  std::optional<double> scene_exposure_s;
};

PixelFormat pixel_format_of(const JsonEntry& camera) {
  const std::string name = camera.text("pixel_format");
  const std::optional<PixelFormat> format = parse_pixel_format(name);
  if (!format)
    camera.fail("pixel_format", fmt::format("'{}' is unknown: use Mono, BayerRG, BayerGR, BayerGB, BayerBG or RGB with "
                                            "8 to 16 bits (as BayerRG12), MonoFloat or RGBFloat",
                                            name));
  if (camera.has("bits") && !format->linear_float && camera.finite_number("bits") != format->bits)
    camera.fail("bits", fmt::format("is {}, but pixel_format {} has {}: make them agree", camera.finite_number("bits"),
                                    name, format->bits));
  return *format;
}

Camera read_camera(const fs::path& file) {
  const json document = read_json_file(file);
  const JsonEntry entry(document, file.string());
  entry.require_known_keys(
      {"pixel_format", "bits", "black_level_hint", "mirror_reflectance", "scene_exposure_s", "frames_primaries"});
  Camera camera;
  camera.format = pixel_format_of(entry);
  camera.black_level_hint = entry.non_negative_number("black_level_hint", 0);
  if (!camera.format.linear_float && camera.black_level_hint >= camera.format.level_count())
    entry.fail("black_level_hint", fmt::format("is {}, but the highest code is {}: give the code of no light",
                                               camera.black_level_hint, camera.format.level_count() - 1));
  if (entry.has("mirror_reflectance")) camera.mirror_reflectance = entry.positive_number("mirror_reflectance");
  if (camera.mirror_reflectance > 1)
    entry.fail("mirror_reflectance",
               fmt::format("is {}: give the reflected part, above 0 and at most 1", camera.mirror_reflectance));
  if (entry.has("scene_exposure_s")) camera.scene_exposure_s = entry.positive_number("scene_exposure_s");
  return camera;
}

// The frames that a list (frames.json, sweep.json) names in `folder`.
std::vector<RecordedFrame> read_frame_list(const fs::path& file, const fs::path& folder, FrameRole role) {
  const json document = read_json_file(file);
  if (!document.is_array() || document.empty())
    throw InputError(file.string(), "", "is no list of frames: write [ { \"frame\": ..., \"exposure_s\": ... }, ... ]");
  std::vector<RecordedFrame> frames;
  std::set<std::string> names;
  for (std::size_t i = 0; i < document.size(); ++i) {
    const JsonEntry entry(document[i], file.string(), fmt::format("[{}]", i));
    entry.require_known_keys({"frame", "exposure_s", "nd_density", "time_s"});
    FrameInfo info;
    info.name = entry.text("frame");
    info.role = role;
    if (info.name.empty() || info.name == "." || info.name == ".." || info.name.find('/') != std::string::npos)
      entry.fail("frame", fmt::format("'{}' is no file name: name a file in {}", info.name, folder.string()));
    if (!names.insert(info.name).second)
      entry.fail("frame", fmt::format("'{}' is listed twice: list each frame once", info.name));
    info.exposure_s = entry.positive_number("exposure_s");
    info.nd_density = entry.non_negative_number("nd_density", 0);
    info.time_s = entry.finite_number("time_s", 0.0);
    frames.push_back({folder / info.name, info});
  }
  return frames;
}

int count_unlisted(const fs::path& folder, const std::vector<RecordedFrame>& frames) {
  std::set<fs::path> listed;
  for (const RecordedFrame& frame : frames) listed.insert(frame.file.filename());
  int count = 0;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error))
    if (entry.is_regular_file(error) && !listed.contains(entry.path().filename())) ++count;
  return count;
}

std::optional<fs::path> find_scene(const fs::path& folder) {
  std::optional<fs::path> found;
  for (const char* name : {"scene.png", "scene.tif", "scene.tiff", "scene.exr"}) {
    if (!fs::exists(folder / name)) continue;
    if (found)
      throw InputError((folder / name).string(), "",
                       fmt::format("is a second scene picture beside {}: keep one", found->filename().string()));
    found = folder / name;
  }
  return found;
}

// A scene picture is taken with the camera as it stands for the frames, so their exposure is its exposure, unless
// camera.json says otherwise. When theirs differ it must.
RecordedFrame scene_frame(const fs::path& picture, const Camera& camera, const std::vector<RecordedFrame>& frames,
                          const fs::path& camera_file) {
  FrameInfo info = frames.front().info;
  info.name = picture.filename().string();
  info.role = FrameRole::scene;
  info.time_s = 0;
  if (camera.scene_exposure_s) {
    info.exposure_s = *camera.scene_exposure_s;
    info.nd_density = 0;
    return {picture, info};
  }
  for (const RecordedFrame& frame : frames)
    if (frame.info.exposure_s != info.exposure_s || frame.info.nd_density != info.nd_density)
      throw InputError(
          camera_file.string(), "scene_exposure_s",
          fmt::format("is missing, and the frames' exposures differ ({}: {} s, {}: {} s): add the exposure "
                      "of {} in seconds",
                      frames.front().info.name, info.exposure_s, frame.info.name, frame.info.exposure_s, info.name));
  return {picture, info};
}

MirrorTarget read_target(const fs::path& file) {
  const json document = read_json_file(file);
  const JsonEntry entry(document, file.string());
  entry.require_known_keys({"family", "tag_size_m", "opening_m", "tags"});
  const json& tags = entry.list("tags");
  for (std::size_t i = 0; i < tags.size(); ++i)
    JsonEntry(tags[i], file.string(), fmt::format("tags[{}]", i)).require_known_keys({"id", "centre_m"});
  return mirror_target_from_json(document, file.string());
}

WorldTarget read_world(const fs::path& file, const MirrorTarget& mirror) {
  const json document = read_json_file(file);
  const JsonEntry entry(document, file.string());
  entry.require_known_keys({"family", "tags", "checkerboard"});
  const json& tags = entry.list("tags");
  for (std::size_t i = 0; i < tags.size(); ++i)
    JsonEntry(tags[i], file.string(), fmt::format("tags[{}]", i))
        .require_known_keys({"id", "size_m", "centre_in_world_m"});
  if (entry.has("checkerboard"))
    JsonEntry(document.at("checkerboard"), file.string(), "checkerboard")
        .require_known_keys({"squares", "centre_in_world_m", "size_m"});
  WorldTarget world = world_target_from_json(document, file.string());
  if (world.family == mirror.family)
    for (std::size_t i = 0; i < world.tags.size(); ++i)
      if (mirror.find(world.tags[i].id) != nullptr)
        throw InputError(file.string(), fmt::format("tags[{}].id", i),
                         fmt::format("tag {} is in target.json too: a tag marks the scene or the mirror, not both",
                                     world.tags[i].id));
  return world;
}

SessionHeader::Reference read_reference(const fs::path& file, const PixelFormat& format,
                                        const std::optional<fs::path>& scene) {
  const json document = read_json_file(file);
  const JsonEntry entry(document, file.string());
  const bool mono = format.layout == PixelLayout::mono;
  const char* radiance_key = mono ? "radiance" : "radiance_rgb";
  entry.require_known_keys({"frame", "pixel", "radius_px", radiance_key});
  const std::string frame = entry.text("frame");
  if (!scene || frame != scene->filename())
    entry.fail("frame", fmt::format("'{}' is no scene picture of this recording: {}", frame,
                                    scene ? "name " + scene->filename().string() : "add scene.png"));
  const auto numbers = [&](const char* key, std::size_t count) {
    const json& list = entry.list(key);
    std::vector<double> values;
    for (const json& value : list)
      if (value.is_number() && std::isfinite(value.get<double>())) values.push_back(value.get<double>());
    if (values.size() != count || list.size() != count) entry.fail(key, fmt::format("needs {} finite numbers", count));
    return values;
  };
  SessionHeader::Reference reference;
  reference.frame = frame;
  const std::vector<double> pixel = numbers("pixel", 2);
  reference.x_px = pixel[0];
  reference.y_px = pixel[1];
  reference.radius_px = entry.positive_number("radius_px");
  reference.radiance = mono ? std::vector<double>{entry.positive_number("radiance")} : numbers("radiance_rgb", 3);
  for (const double radiance : reference.radiance)
    if (!(radiance > 0)) entry.fail(radiance_key, fmt::format("has {}: give radiances above 0", radiance));
  return reference;
}

}  // namespace

Recording read_recording(const fs::path& folder) {
  if (!fs::is_directory(folder))
    throw InputError(folder.string(), "", "is no folder: give one in the import format (docs/import.md)");
  const fs::path camera_file = folder / "camera.json";
  const Camera camera = read_camera(camera_file);
  Recording recording;
  recording.header.format = camera.format;
  recording.header.black_level_hint = camera.black_level_hint;
  recording.header.mirror_reflectance = camera.mirror_reflectance;
  recording.header.target = read_target(folder / "target.json");
  if (fs::exists(folder / "world.json"))
    recording.header.world = read_world(folder / "world.json", recording.header.target);
  recording.frames = read_frame_list(folder / "frames.json", folder / "frames", FrameRole::mirror);
  recording.unlisted_files = count_unlisted(folder / "frames", recording.frames);
  const std::optional<fs::path> scene = find_scene(folder);
  if (scene) recording.frames.push_back(scene_frame(*scene, camera, recording.frames, camera_file));
  if (fs::exists(folder / "sweep.json"))
    for (RecordedFrame& frame : read_frame_list(folder / "sweep.json", folder / "sweep", FrameRole::sweep))
      recording.frames.push_back(std::move(frame));
  else if (fs::exists(folder / "sweep"))
    throw InputError((folder / "sweep.json").string(), "", "is missing, but there is a folder sweep: add it");
  if (fs::exists(folder / "reference.json"))
    recording.header.reference = read_reference(folder / "reference.json", camera.format, scene);
  return recording;
}

}  // namespace mf
