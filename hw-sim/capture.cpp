// SPDX-License-Identifier: Apache-2.0
#include "hw-sim/capture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/json_file.h"
#include "hw-sim/desk_rig.h"
#include "hw-sim/motion.h"
#include "hw-sim/picture_files.h"
#include "hw-sim/sensor.h"
#include "hw-sim/tracer.h"
#include "hw-sim/truth_files.h"

namespace mf::sim {

namespace {

using nlohmann::json;
namespace fs = std::filesystem;

constexpr double frame_exposure_s = 0.01;
constexpr double sweep_exposure_s = 0.014;
constexpr double frames_per_second = 12;
constexpr int sweep_count = 12;

// Everything that the parts of a recording share.
struct Rig : DeskRig {
  explicit Rig(const CaptureOptions& o) : DeskRig(o.size, o.seed), options(o) {}
  CaptureOptions options;
  Sensor sensor = desk_sensor();
};

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
    const ImageF radiance = render(rig.tracer, rig.shot(world_from_mirror, region, rig.options.samples,
                                                        stream_key(rig.options.seed, Stream::frame, i)));
    const ImageU16 codes =
        rig.sensor.expose(radiance, frame_exposure_s, region, stream_key(rig.options.seed, Stream::frame_noise, i));
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
  const ImageF radiance = render(
      rig.tracer, rig.shot(world_from_mirror, whole(rig.camera), samples, stream_key(rig.options.seed, Stream::sweep)));
  json index = json::array();
  for (int i = 0; i < sweep_count; ++i) {
    const double density = 0.3 * i;
    const std::string name = fmt::format("nd{:03}.png", 30 * i);
    write_png16(folder / "sweep" / name,
                rig.sensor.expose(radiance, sweep_exposure_s * std::pow(10.0, -density), whole(rig.camera),
                                  stream_key(rig.options.seed, Stream::sweep_noise, i)));
    index.push_back({{"frame", name}, {"nd_density", density}, {"exposure_s", sweep_exposure_s}});
  }
  write_json_file(folder / "sweep.json", index);
}

// Mean over the pixels that a disc touches.
Rgb disc_mean(const ImageF& picture, const Eigen::Vector2d& centre, double radius) {
  Rgb sum = Rgb::Zero();
  int count = 0;
  for (int y = std::max(0, static_cast<int>(centre.y() - radius));
       y <= std::min(picture.height - 1, static_cast<int>(centre.y() + radius)); ++y)
    for (int x = std::max(0, static_cast<int>(centre.x() - radius));
         x <= std::min(picture.width - 1, static_cast<int>(centre.x() + radius)); ++x)
      if (std::hypot(std::clamp(centre.x(), x + 0., x + 1.) - centre.x(),
                     std::clamp(centre.y(), y + 0., y + 1.) - centre.y()) < radius) {
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

void write_all(const fs::path& folder, const Rig& rig, const Progress& progress) {
  write_camera(folder, rig.sensor);
  write_target(folder, rig.plate.target());
  write_world(folder, rig.scene.world);
  const std::vector<Rigid3> poses = wave_mirror(rig.motion, rig.options.frames, rig.options.seed);
  write_frames(folder, rig, poses, progress);
  write_sweep(folder, rig);
  const ImageF plate = render(rig.tracer, rig.shot(std::nullopt, whole(rig.camera), rig.options.truth_samples,
                                                   stream_key(rig.options.seed, Stream::plate)));
  write_png16(folder / "scene.png", rig.sensor.expose(plate, frame_exposure_s, whole(rig.camera),
                                                      stream_key(rig.options.seed, Stream::plate_noise)));
  write_reference(folder, rig, plate);
  write_truth(folder / "truth", rig, poses, rig.sensor.response, plate,
              {rig.options.seed, rig.options.truth_samples, rig.options.views}, progress);
}

}  // namespace

std::optional<std::string> CaptureOptions::validate() const {
  if (frames < 10 || frames > 99999) return "frames must be 10 to 99999";
  if (size < 128 || size > 2048 || size % 2 != 0) return "size must be even, 128 to 2048";
  if (samples < 1 || truth_samples < 1) return "samples must be at least 1";
  if (views < 0 || views > 3) return "views must be 0 to 3";
  return std::nullopt;
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
