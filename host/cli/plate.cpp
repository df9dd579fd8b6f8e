// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/demosaic.h"
#include "common/error.h"
#include "common/json_file.h"
#include "common/session.h"
#include "host/calibration/calibration.h"
#include "host/cli/command.h"
#include "host/cli/session_files.h"
#include "host/io/exr.h"

namespace mf {

namespace {

struct PlateArguments {
  std::filesystem::path session;
  std::filesystem::path output;
  std::filesystem::path cameras;
};

float bilinear(const ImageF& picture, const Eigen::Vector2d& at, int channel) {
  const double x = std::clamp(at.x() - 0.5, 0.0, picture.width - 1.0);
  const double y = std::clamp(at.y() - 0.5, 0.0, picture.height - 1.0);
  const int x0 = std::min(static_cast<int>(x), picture.width - 2),
            y0 = std::min(static_cast<int>(y), picture.height - 2);
  const auto fx = static_cast<float>(x - x0), fy = static_cast<float>(y - y0);
  const auto value = [&](int dx, int dy) { return picture.at(x0 + dx, y0 + dy, channel); };
  return (1 - fy) * ((1 - fx) * value(0, 0) + fx * value(1, 0)) + fy * ((1 - fx) * value(0, 1) + fx * value(1, 1));
}

// As a pinhole with the same K would have seen it: what renderers can match.
ImageF without_distortion(const ImageF& picture, const CameraModel& camera) {
  if (!camera.has_distortion()) return picture;
  ImageF straight(picture.width, picture.height, picture.channels);
  for (int y = 0; y < straight.height; ++y)
    for (int x = 0; x < straight.width; ++x) {
      const Eigen::Vector3d ray((x + 0.5 - camera.cx()) / camera.fx(), (y + 0.5 - camera.cy()) / camera.fy(), 1);
      for (int c = 0; c < straight.channels; ++c) straight.at(x, y, c) = bilinear(picture, camera.project(ray), c);
    }
  return straight;
}

void write_camera(const std::filesystem::path& file, const Calibration& calibration) {
  const Eigen::Matrix3d k = calibration.camera.k_matrix();
  nlohmann::json rows = nlohmann::json::array();
  for (int i = 0; i < 3; ++i) rows.push_back({k(i, 0), k(i, 1), k(i, 2)});
  write_json_file(
      file, nlohmann::json::array({{{"camera_from_world", rigid3_to_json(*calibration.cam_from_world)}, {"K", rows}}}));
}

void run(const PlateArguments& a) {
  const SessionReader session = open_session(a.session);
  const Calibration calibration = calibration_of(session);
  const std::vector<SessionFrame> scenes = session.frames(FrameRole::scene);
  if (scenes.empty())
    throw InputError(a.session.string(), "frames", "none is a picture of the scene without the mirror: record one");
  if (!calibration.cam_from_world)
    throw InputError((a.session / "calibration.json").string(), "cam_from_world",
                     "is missing: the session needs world tags");
  const PixelFormat& format = session.header().format;
  const ImageF linear = linearize(session.read_frame(scenes.front()), format, response_of(session));
  write_exr(a.output, without_distortion(demosaic(linear, format.layout), calibration.camera));
  if (!a.cameras.empty()) write_camera(a.cameras, calibration);
  fmt::print("{}: {} x {}, in the light field's units\n", a.output.string(), linear.width, linear.height);
}

}  // namespace

void add_plate_command(CommandLine& program) {
  const auto arguments = std::make_shared<PlateArguments>();
  CommandLine command = program.command(
      "plate", "the session's scene picture as linear radiance, for composite: the same units, a pinhole's picture");
  command.option("session", arguments->session, "session with response.json and calibration.json", Presence::required);
  command.option("-o,--output", arguments->output, "the picture, OpenEXR", Presence::required);
  command.option("--cameras", arguments->cameras, "where to write its camera, as render and composite read it");
  command.on_run([arguments] { run(*arguments); });
}

}  // namespace mf
