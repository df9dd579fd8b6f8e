// SPDX-License-Identifier: Apache-2.0
#include "host/calibration/calibration.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/json_file.h"

namespace mf {

namespace {

constexpr std::array<const char*, 5> distortion_names{"k1", "k2", "p1", "p2", "k3"};
constexpr std::array<const char*, 4> pinhole_names{"fx", "fy", "cx", "cy"};

nlohmann::json distortion_to_json(const CameraModel::Parameters& parameters) {
  nlohmann::json json;
  for (std::size_t i = 0; i < 5; ++i) json[distortion_names[i]] = parameters[4 + i];
  return json;
}

nlohmann::json frame_to_json(const MirrorPose& frame) {
  nlohmann::json json{{"name", frame.name},
                      {"used", frame.used},
                      {"rms_px", frame.rms_px},
                      {"inlier_corners", frame.inlier_corners},
                      {"outlier_corners", frame.outlier_corners}};
  if (frame.used) {
    json["cam_from_mirror"] = rigid3_to_json(frame.cam_from_mirror);
    json["rotation_sigma_rad"] = frame.rotation_sigma_rad;
    json["position_sigma_m"] = frame.position_sigma_m;
  } else {
    json["why_not"] = frame.why_not;
  }
  return json;
}

MirrorPose frame_from_json(const nlohmann::json& json, const std::string& file) {
  MirrorPose frame;
  frame.name = json_field<std::string>(json, "name", file);
  frame.used = json_field_or<bool>(json, "used", file, true);
  frame.rms_px = json_field_or<double>(json, "rms_px", file, 0);
  frame.inlier_corners = json_field_or<int>(json, "inlier_corners", file, 0);
  frame.outlier_corners = json_field_or<int>(json, "outlier_corners", file, 0);
  frame.why_not = json_field_or<std::string>(json, "why_not", file, "");
  frame.rotation_sigma_rad = json_field_or<double>(json, "rotation_sigma_rad", file, 0);
  frame.position_sigma_m = json_field_or<double>(json, "position_sigma_m", file, 0);
  if (!frame.used) return frame;
  if (!json.contains("cam_from_mirror"))
    throw InputError(file, "frames: " + frame.name + ": cam_from_mirror", "is missing though the frame is used");
  frame.cam_from_mirror = rigid3_from_json(json.at("cam_from_mirror"), frame.name + ": cam_from_mirror", file);
  return frame;
}

CameraModel camera_from_json(const nlohmann::json& json, const std::string& file) {
  CameraModel camera;
  camera.width = json_field<int>(json, "width", file);
  camera.height = json_field<int>(json, "height", file);
  if (camera.width <= 0 || camera.height <= 0) throw InputError(file, "width, height", "must be positive pixels");
  const auto k = json_field<std::vector<std::vector<double>>>(json, "K", file);
  if (k.size() != 3 || k[0].size() != 3 || k[1].size() != 3 || !(k[0][0] > 0) || !(k[1][1] > 0) || k[0][1] != 0)
    throw InputError(file, "K", "must be three rows of three numbers: fx 0 cx, 0 fy cy, 0 0 1");
  camera.parameters = {k[0][0], k[1][1], k[0][2], k[1][2], 0, 0, 0, 0, 0};
  const auto distortion = json_field_or<nlohmann::json>(json, "distortion", file, nlohmann::json::object());
  for (std::size_t i = 0; i < 5; ++i)
    camera.parameters[4 + i] = json_field_or<double>(distortion, distortion_names[i], file, 0);
  for (const double p : camera.parameters)
    if (!std::isfinite(p)) throw InputError(file, "K, distortion", "must be finite numbers");
  return camera;
}

}  // namespace

Calibration read_calibration(const std::filesystem::path& path) {
  const std::string file = path.string();
  const nlohmann::json json = read_json_file(path);
  Calibration calibration;
  calibration.camera = camera_from_json(json, file);
  const auto sigma = json_field_or<nlohmann::json>(json, "sigma", file, nlohmann::json::object());
  for (std::size_t i = 0; i < 4; ++i)
    calibration.camera_sigma[i] = json_field_or<double>(sigma, pinhole_names[i], file, 0);
  for (std::size_t i = 0; i < 5; ++i)
    calibration.camera_sigma[4 + i] = json_field_or<double>(sigma, distortion_names[i], file, 0);
  if (json.contains("cam_from_world") && !json.at("cam_from_world").is_null())
    calibration.cam_from_world = rigid3_from_json(json.at("cam_from_world"), "cam_from_world", file);
  calibration.world_rms_px = json_field_or<double>(json, "world_rms_px", file, 0);
  calibration.world_rotation_sigma_rad = json_field_or<double>(json, "world_rotation_sigma_rad", file, 0);
  calibration.world_position_sigma_m = json_field_or<double>(json, "world_position_sigma_m", file, 0);
  calibration.rms_px = json_field_or<double>(json, "rms_px", file, 0);
  for (const nlohmann::json& frame : json_field<std::vector<nlohmann::json>>(json, "frames", file))
    calibration.frames.push_back(frame_from_json(frame, file));
  calibration.options = json_field_or<std::map<std::string, std::string>>(json, "options", file, {});
  return calibration;
}

void write_calibration(const std::filesystem::path& path, const Calibration& calibration) {
  const CameraModel& camera = calibration.camera;
  nlohmann::json sigma = distortion_to_json(calibration.camera_sigma);
  for (std::size_t i = 0; i < 4; ++i) sigma[pinhole_names[i]] = calibration.camera_sigma[i];
  nlohmann::json json{{"width", camera.width},
                      {"height", camera.height},
                      {"K", {{camera.fx(), 0, camera.cx()}, {0, camera.fy(), camera.cy()}, {0, 0, 1}}},
                      {"distortion", distortion_to_json(camera.parameters)},
                      {"sigma", sigma},
                      {"rms_px", calibration.rms_px},
                      {"frames", nlohmann::json::array()},
                      {"options", calibration.options}};
  if (calibration.cam_from_world) {
    json["cam_from_world"] = rigid3_to_json(*calibration.cam_from_world);
    json["world_rms_px"] = calibration.world_rms_px;
    json["world_rotation_sigma_rad"] = calibration.world_rotation_sigma_rad;
    json["world_position_sigma_m"] = calibration.world_position_sigma_m;
  }
  for (const MirrorPose& frame : calibration.frames) json["frames"].push_back(frame_to_json(frame));
  write_json_file(path, json);
}

}  // namespace mf
