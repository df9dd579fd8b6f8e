// SPDX-License-Identifier: Apache-2.0
#include "hw-sim/capture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/json_file.h"
#include "hw-sim/motion.h"
#include "hw-sim/picture_files.h"
#include "hw-sim/sensor.h"
#include "hw-sim/tracer.h"

namespace mf::sim {

namespace {

using nlohmann::json;
namespace fs = std::filesystem;

constexpr double mirror_reflectance = 0.92;
constexpr double frame_exposure_s = 0.01;
constexpr double sweep_exposure_s = 0.014;
constexpr double frames_per_second = 12;
constexpr int sweep_count = 12;
constexpr float object_albedo = 0.7F;
constexpr double object_clearance_m = 0.02;

// What a random number is for: streams with the same seed must not meet.
enum class Stream : std::uint64_t { scene, frame, frame_noise, sweep, sweep_noise, plate, plate_noise, object, probe };
std::uint64_t key(std::uint64_t seed, Stream stream, int index = 0) {
  return mix(mix(seed, static_cast<std::uint64_t>(stream)), static_cast<std::uint64_t>(index));
}

Rigid3 look_at(const Eigen::Vector3d& eye, const Eigen::Vector3d& at) {
  Eigen::Matrix3d world_from_cam;
  const Eigen::Vector3d forward = (at - eye).normalized();
  const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
  world_from_cam << right, forward.cross(right), forward;  // x right, y down, z forward
  return Rigid3{Eigen::Quaterniond(world_from_cam), eye}.inverse();
}

Region whole(const CameraModel& camera) {
  return {0, 0, camera.width, camera.height};
}

// The pixels about the plate, as a camera with a region of interest would read out: even edges, 8 px to spare.
Region around_plate(const CameraModel& camera, const Rigid3& cam_from_mirror, const Eigen::Vector2d& half_size) {
  constexpr double spare_px = 8;
  Eigen::Vector2d low = Eigen::Vector2d::Constant(1e9);
  Eigen::Vector2d high = -low;
  for (const double x : {-half_size.x(), half_size.x()})
    for (const double y : {-half_size.y(), half_size.y()}) {
      const Eigen::Vector2d p = camera.project(cam_from_mirror * Eigen::Vector3d(x, y, 0));
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
  const auto even = [](double v, int limit) { return std::clamp(static_cast<int>(std::floor(v / 2)) * 2, 0, limit); };
  return {even(low.x() - spare_px, camera.width), even(low.y() - spare_px, camera.height),
          even(high.x() + spare_px, camera.width), even(high.y() + spare_px, camera.height)};
}

// Everything that the parts of a recording share.
struct Rig {
  CaptureOptions options;
  Scene scene;
  MirrorPlate plate{desk_mirror(), mirror_reflectance};
  Tracer tracer{scene, &plate};
  Sensor sensor = desk_sensor();
  CameraModel camera;
  Rigid3 cam_from_world = desk_cam_from_world(0);
  MotionInput motion;

  explicit Rig(const CaptureOptions& o)
      : options(o), scene(desk_scene(key(o.seed, Stream::scene))), camera(desk_camera(o.size)) {
    motion = {cam_from_world.inverse().translation, scene.lamp.centre_in_world.cast<double>(), plate.half_size_m()};
  }

  [[nodiscard]] Shot shot(const std::optional<Rigid3>& world_from_mirror, const Region& region, int samples,
                          std::uint64_t seed) const {
    return {camera, cam_from_world, world_from_mirror, region, samples, seed};
  }
};

json tag_list(const MirrorTarget& target) {
  json tags = json::array();
  for (const PlanarTag& tag : target.tags)
    tags.push_back({{"id", tag.id}, {"centre_m", {tag.centre_m.x(), tag.centre_m.y()}}});
  return tags;
}

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

void write_camera(const fs::path& folder, const Sensor& sensor) {
  write_json_file(folder / "camera.json", {{"pixel_format", pixel_format_name(sensor.format)},
                                           {"bits", sensor.format.bits},
                                           {"black_level_hint", sensor.response.black_level},
                                           {"mirror_reflectance", mirror_reflectance},
                                           {"frames_primaries", "linear BT.709 after demosaicing"}});
}

void write_frames(const fs::path& folder, const Rig& rig, const std::vector<Rigid3>& poses, const Progress& progress) {
  fs::create_directories(folder / "frames");
  json index = json::array();
  for (int i = 0; i < rig.options.frames; ++i) {
    const Rigid3& world_from_mirror = poses[static_cast<std::size_t>(i)];
    const Region region = around_plate(rig.camera, rig.cam_from_world * world_from_mirror, rig.plate.half_size_m());
    const ImageF radiance = render(
        rig.tracer, rig.shot(world_from_mirror, region, rig.options.samples, key(rig.options.seed, Stream::frame, i)));
    const ImageU16 codes =
        rig.sensor.expose(radiance, frame_exposure_s, region, key(rig.options.seed, Stream::frame_noise, i));
    const std::string name = fmt::format("{:05}.png", i);
    write_png16(folder / "frames" / name, codes);
    index.push_back(
        {{"frame", name}, {"exposure_s", frame_exposure_s}, {"time_s", std::round(i / frames_per_second * 1e4) / 1e4}});
    report_progress(progress, "frames", (i + 1.0) / rig.options.frames);
  }
  write_json_file(folder / "frames.json", index);
}

// One static scene, the lamp in the mirror, through ever denser neutral-density filters.
void write_sweep(const fs::path& folder, const Rig& rig) {
  fs::create_directories(folder / "sweep");
  const Eigen::Vector3d p(0.1, 0.03, 0);
  const Rigid3 world_from_mirror = mirror_pose(rig.motion, p, (rig.motion.lamp_in_world - p).normalized(), 0.1);
  const int samples = 3 * rig.options.samples;  // the same light for all filters: less noise, twelve times used
  const ImageF radiance =
      render(rig.tracer, rig.shot(world_from_mirror, whole(rig.camera), samples, key(rig.options.seed, Stream::sweep)));
  json index = json::array();
  for (int i = 0; i < sweep_count; ++i) {
    const double density = 0.3 * i;
    const std::string name = fmt::format("nd{:03}.png", 30 * i);
    write_png16(folder / "sweep" / name,
                rig.sensor.expose(radiance, sweep_exposure_s * std::pow(10.0, -density), whole(rig.camera),
                                  key(rig.options.seed, Stream::sweep_noise, i)));
    index.push_back({{"frame", name}, {"nd_density", density}, {"exposure_s", sweep_exposure_s}});
  }
  write_json_file(folder / "sweep.json", index);
}

// Mean over the pixels whose centres lie within a disc.
Rgb disc_mean(const ImageF& picture, const Eigen::Vector2d& centre, double radius) {
  Rgb sum = Rgb::Zero();
  int count = 0;
  for (int y = std::max(0, static_cast<int>(centre.y() - radius));
       y <= std::min(picture.height - 1, static_cast<int>(centre.y() + radius)); ++y)
    for (int x = std::max(0, static_cast<int>(centre.x() - radius));
         x <= std::min(picture.width - 1, static_cast<int>(centre.x() + radius)); ++x)
      if ((Eigen::Vector2d(x + 0.5, y + 0.5) - centre).norm() <= radius) {
        sum += Rgb(picture.at(x, y, 0), picture.at(x, y, 1), picture.at(x, y, 2));
        ++count;
      }
  return sum / static_cast<float>(std::max(1, count));
}

// The spot meter is pointed at the brightest white square of the board.
void write_reference(const fs::path& folder, const Rig& rig, const ImageF& plate) {
  constexpr int radius_px = 3;
  const Checkerboard& board = *rig.scene.world.checkerboard;
  Eigen::Vector2d best_pixel = Eigen::Vector2d::Zero();
  Rgb best = Rgb::Zero();
  for (int row = 0; row < board.squares[1]; ++row)
    for (int column = 0; column < board.squares[0]; ++column) {
      if ((row + column) % 2 == 0) continue;
      const Eigen::Vector2d in_board((column + 0.5) / board.squares[0] - 0.5, (row + 0.5) / board.squares[1] - 0.5);
      Eigen::Vector3d x_in_world = board.centre_in_world;
      x_in_world.head<2>() += in_board.cwiseProduct(board.size_m);
      const Eigen::Vector2d at = rig.camera.project(rig.cam_from_world * x_in_world);
      const Eigen::Vector2d pixel(std::floor(at.x()) + 0.5, std::floor(at.y()) + 0.5);
      const Rgb mean = disc_mean(plate, pixel, radius_px);
      if (mean.sum() <= best.sum()) continue;
      best = mean;
      best_pixel = pixel;
    }
  write_json_file(folder / "reference.json",
                  {{"frame", "scene.png"},
                   {"pixel", {best_pixel.x(), best_pixel.y()}},
                   {"radius_px", radius_px},
                   {"radiance_rgb", {best[0], best[1], best[2]}},
                   {"meaning", "a spot meter reading: mean linear radiance over that disc"}});
}

json k_matrix(const CameraModel& camera) {
  return json::array({json::array({camera.fx(), 0.0, camera.cx()}), json::array({0.0, camera.fy(), camera.cy()}),
                      json::array({0.0, 0.0, 1.0})});
}

void write_true_calibration(const fs::path& truth, const Rig& rig, const std::vector<Rigid3>& poses) {
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
void write_true_pictures(const fs::path& truth, const Rig& rig, const Progress& progress) {
  const Mesh knot = trefoil_knot(object_clearance_m);
  write_obj(truth / "knot.obj", knot);
  Scene with_object = rig.scene;
  with_object.surfaces.push_back({knot, PlainPaint{Rgb::Constant(object_albedo)}});
  const Tracer object_tracer(with_object, nullptr);
  json views = json::array();
  for (int view = 0; view < rig.options.views; ++view) {
    Shot shot = rig.shot(std::nullopt, whole(rig.camera), rig.options.truth_samples,
                         key(rig.options.seed, Stream::object, view));
    shot.cam_from_world = desk_cam_from_world(view);
    views.push_back({{"camera_from_world", rigid3_to_json(shot.cam_from_world)}, {"K", k_matrix(rig.camera)}});
    write_rgb_exr(truth / fmt::format("knot{}.exr", view), render(object_tracer, shot));
    if (view > 0) {  // view 0 without the object is the scene picture, written there
      shot.seed = key(rig.options.seed, Stream::plate, view);
      write_rgb_exr(truth / fmt::format("plate{}.exr", view), render(rig.tracer, shot));
    }
    report_progress(progress, "truth", (view + 1.0) / (rig.options.views + 1));
  }
  write_json_file(truth / "views.json", views);
  const int probe_width = rig.options.size;
  write_rgb_exr(truth / "probe_0_0_0.1.exr",
                render_probe(rig.tracer, {0, 0, 0.1F}, probe_width, rig.options.truth_samples,
                             key(rig.options.seed, Stream::probe)));
  report_progress(progress, "truth", 1);
}

void write_all(const fs::path& folder, const Rig& rig, const Progress& progress) {
  const fs::path truth = folder / "truth";
  fs::create_directories(truth);
  write_camera(folder, rig.sensor);
  write_target(folder, rig.plate.target());
  write_world(folder, rig.scene.world);
  const std::vector<Rigid3> poses = wave_mirror(rig.motion, rig.options.frames, rig.options.seed);
  write_frames(folder, rig, poses, progress);
  write_sweep(folder, rig);
  const ImageF plate = render(rig.tracer, rig.shot(std::nullopt, whole(rig.camera), rig.options.truth_samples,
                                                   key(rig.options.seed, Stream::plate)));
  write_png16(folder / "scene.png", rig.sensor.expose(plate, frame_exposure_s, whole(rig.camera),
                                                      key(rig.options.seed, Stream::plate_noise)));
  write_reference(folder, rig, plate);
  write_rgb_exr(truth / "plate0.exr", plate);
  write_true_calibration(truth, rig, poses);
  write_true_response(truth, rig.sensor.response);
  write_true_pictures(truth, rig, progress);
}

}  // namespace

std::optional<std::string> CaptureOptions::validate() const {
  if (frames < 10 || frames > 99999) return "frames must be 10 to 99999";
  if (size < 128 || size > 2048 || size % 2 != 0) return "size must be even, 128 to 2048";
  if (samples < 1 || truth_samples < 1) return "samples must be at least 1";
  if (views < 0 || views > 3) return "views must be 0 to 3";
  return std::nullopt;
}

CameraModel desk_camera(int size) {
  const double focal_px = 1055.0 / 768 * size;
  return {size, size, {focal_px, focal_px, 0.5 * size, 0.5 * size, 0, 0, 0, 0, 0}};
}

Rigid3 desk_cam_from_world(int view) {
  constexpr std::array<std::array<double, 3>, 3> eyes{{{0.05, -0.85, 0.75}, {-0.62, -0.55, 0.62}, {0.6, -0.6, 0.66}}};
  const auto& eye = eyes.at(static_cast<std::size_t>(view));
  return look_at({eye[0], eye[1], eye[2]}, {0, 0.05, 0.03});
}

void write_capture(const fs::path& folder, const CaptureOptions& options, const Progress& progress) {
  if (const auto problem = options.validate()) throw InputError("options", "", *problem);
  if (fs::exists(folder)) throw InputError(folder.string(), "", "exists already: give a new folder or remove it");
  const fs::path partial = folder.string() + ".partial";
  std::error_code error;
  fs::remove_all(partial, error);
  if (!fs::create_directories(partial, error) || error)
    throw InputError(partial.string(), "", "cannot be created: " + error.message());
  try {
    write_all(partial, Rig(options), progress);
    fs::rename(partial, folder);
  } catch (...) {
    fs::remove_all(partial, error);
    throw;
  }
}

}  // namespace mf::sim
