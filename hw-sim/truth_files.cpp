// SPDX-License-Identifier: Apache-2.0
#include "hw-sim/truth_files.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "common/json_file.h"
#include "hw-sim/picture_files.h"

namespace mf::sim {

namespace {

using nlohmann::json;
namespace fs = std::filesystem;

constexpr float object_albedo = 0.7F;
constexpr double object_clearance_m = 0.02;

json tag_list(const MirrorTarget& target) {
  json tags = json::array();
  for (const PlanarTag& tag : target.tags)
    tags.push_back({{"id", tag.id}, {"centre_m", {tag.centre_m.x(), tag.centre_m.y()}}});
  return tags;
}

json k_matrix(const CameraModel& camera) {
  return json::array({json::array({camera.fx(), 0.0, camera.cx()}), json::array({0.0, camera.fy(), camera.cy()}),
                      json::array({0.0, 0.0, 1.0})});
}

void write_true_calibration(const fs::path& truth, const DeskRig& rig, const std::vector<Rigid3>& poses) {
  json mirrors = json::array();
  for (const Rigid3& pose : poses) mirrors.push_back(rigid3_to_json(pose));
  write_json_file(truth / "calibration.json", {{"K", k_matrix(rig.camera)},
                                               {"cam_from_world", rigid3_to_json(rig.cam_from_world)},
                                               {"world_from_mirror", mirrors}});
}

void write_true_response(const fs::path& truth, const ResponseCurve& response) {
  json codes = json::array();
  for (std::size_t code = 0; code < response.channels[0].exposure.size(); ++code) codes.push_back(code);
  write_json_file(
      truth / "response.json",
      {{"black_level", response.black_level}, {"code", codes}, {"exposure", response.channels[0].exposure}});
}

// The views without and with the object in the scene, by the same tracer.
void write_true_pictures(const fs::path& truth, const DeskRig& rig, const TruthOptions& options,
                         const Progress& progress) {
  const Mesh knot = trefoil_knot(object_clearance_m);
  write_obj(truth / "knot.obj", knot);
  Scene with_object = rig.scene;
  with_object.surfaces.push_back({knot, PlainPaint{Rgb::Constant(object_albedo)}});
  const Tracer object_tracer(with_object, nullptr);
  json views = json::array();
  for (int view = 0; view < options.views; ++view) {
    Shot shot =
        rig.shot(std::nullopt, whole(rig.camera), options.samples, stream_key(options.seed, Stream::object, view));
    shot.cam_from_world = desk_cam_from_world(view);
    views.push_back({{"camera_from_world", rigid3_to_json(shot.cam_from_world)}, {"K", k_matrix(rig.camera)}});
    write_rgb_exr(truth / fmt::format("knot{}.exr", view), render(object_tracer, shot));
    if (view > 0) {  // view 0 without the object is the scene picture, written there
      shot.seed = stream_key(options.seed, Stream::plate, view);
      write_rgb_exr(truth / fmt::format("plate{}.exr", view), render(rig.tracer, shot));
    }
    report_progress(progress, "truth", (view + 1.0) / (options.views + 1));
  }
  write_json_file(truth / "views.json", views);
  const int probe_width = rig.camera.width;
  write_rgb_exr(truth / "probe_0_0_0.1.exr", render_probe(rig.tracer, {0, 0, 0.1F}, probe_width, options.samples,
                                                          stream_key(options.seed, Stream::probe)));
  report_progress(progress, "truth", 1);
}

}  // namespace

void write_target(const fs::path& folder, const MirrorTarget& target) {
  write_json_file(folder / "target.json", {{"family", target.family},
                                           {"tag_size_m", target.tags.front().size_m},
                                           {"opening_m", {target.opening_m.x(), target.opening_m.y()}},
                                           {"tags", tag_list(target)}});
}

void write_world(const fs::path& folder, const WorldTarget& world) {
  json tags = json::array();
  for (const WorldTag& tag : world.tags) {
    const Eigen::Vector3d& c = tag.centre_in_world;
    tags.push_back({{"id", tag.id}, {"size_m", tag.size_m}, {"centre_in_world_m", {c.x(), c.y(), c.z()}}});
  }
  const Checkerboard& board = *world.checkerboard;
  const Eigen::Vector3d& c = board.centre_in_world;
  write_json_file(folder / "world.json", {{"family", world.family},
                                          {"tags", tags},
                                          {"checkerboard",
                                           {{"squares", board.squares},
                                            {"centre_in_world_m", {c.x(), c.y(), c.z()}},
                                            {"size_m", {board.size_m.x(), board.size_m.y()}}}}});
}

void write_truth(const fs::path& truth, const DeskRig& rig, const std::vector<Rigid3>& poses,
                 const std::optional<ResponseCurve>& response, const ImageF& plate, const TruthOptions& options,
                 const Progress& progress) {
  fs::create_directories(truth);
  write_rgb_exr(truth / "plate0.exr", plate);
  write_true_calibration(truth, rig, poses);
  if (response) write_true_response(truth, *response);
  write_true_pictures(truth, rig, options, progress);
}

}  // namespace mf::sim
