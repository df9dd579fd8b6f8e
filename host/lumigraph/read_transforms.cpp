// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>

#include "common/error.h"
#include "common/json_file.h"
#include "host/lumigraph/picture_file.h"
#include "host/lumigraph/read_photos.h"

namespace mf {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// A number of the frame, else of the whole file.
class Intrinsics {
 public:
  Intrinsics(const json& frame, const json& all, std::string file) : frame_(frame), all_(all), file_(std::move(file)) {}

  [[nodiscard]] std::optional<double> find(const std::string& key) const {
    const json& holder = frame_.contains(key) ? frame_ : all_;
    if (!holder.contains(key) || holder.at(key).is_null()) return std::nullopt;
    return json_field<double>(holder, key, file_);
  }

 private:
  const json& frame_;
  const json& all_;
  std::string file_;
};

double focal_of_angle(double angle, int size) {
  return 0.5 * size / std::tan(0.5 * angle);
}

CameraModel camera_of(const Intrinsics& known, int width, int height, const std::string& file,
                      const std::string& name) {
  CameraModel camera;
  camera.width = width;
  camera.height = height;
  // The numbers refer to a picture of w × h.
  const double to_x = width / known.find("w").value_or(width);
  const double to_y = height / known.find("h").value_or(height);
  if (std::abs(to_x / to_y - 1) > 0.02)
    throw InputError(file, name, fmt::format("is {} × {}, another aspect than w and h say: mend them", width, height));
  std::optional<double> fx = known.find("fl_x");
  if (fx)
    *fx *= to_x;
  else if (const auto angle = known.find("camera_angle_x"))
    fx = focal_of_angle(*angle, width);
  if (!fx) throw InputError(file, "fl_x", "is missing, and camera_angle_x too: add one of them");
  std::optional<double> fy = known.find("fl_y");
  if (fy)
    *fy *= to_y;
  else if (const auto angle = known.find("camera_angle_y"))
    fy = focal_of_angle(*angle, height);
  const auto cx = known.find("cx");
  const auto cy = known.find("cy");
  camera.parameters = {*fx,
                       fy.value_or(*fx),
                       cx ? *cx * to_x : width / 2.0,
                       cy ? *cy * to_y : height / 2.0,
                       known.find("k1").value_or(0),
                       known.find("k2").value_or(0),
                       known.find("p1").value_or(0),
                       known.find("p2").value_or(0),
                       known.find("k3").value_or(0)};
  return camera;
}

fs::path picture_file(const fs::path& folder, const std::string& path) {
  const fs::path file = folder / path;
  if (fs::is_regular_file(file)) return file;
  for (const char* extension : {".png", ".jpg", ".jpeg", ".exr"})
    if (fs::path with = file.string() + extension; fs::is_regular_file(with)) return with;
  return file;  // whose absence is reported when it is read
}

// world_from_camera of OpenGL's axes (x right, y up, z back) → cam_from_world of ours.
Rigid3 pose_of(const json& frame, const std::string& prefix, const std::string& file) {
  if (!frame.contains("transform_matrix"))
    throw InputError(file, prefix + "transform_matrix", "is missing: add the 4×4 pose");
  const Rigid3 world_from_gl = rigid3_from_json(frame.at("transform_matrix"), prefix + "transform_matrix", file);
  const Rigid3 gl_from_cam{Eigen::Quaterniond(0, 1, 0, 0), Eigen::Vector3d::Zero()};  // half a turn about x
  return (world_from_gl * gl_from_cam).inverse();
}

void check_camera_model(const json& all, const std::string& file) {
  const auto model = json_field_or<std::string>(all, "camera_model", file, "OPENCV");
  for (const char* known : {"OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL"})
    if (model == known) return;
  throw InputError(file, "camera_model", model + " is not read: undistort the photos, or use PINHOLE or OPENCV");
}

}  // namespace

PhotoSet read_transforms(const fs::path& path) {
  const std::string file = path.string();
  const json all = read_json_file(path);
  if (!all.is_object() || !all.contains("frames") || !all.at("frames").is_array())
    throw InputError(file, "frames", "is missing: it lists the photos");
  check_camera_model(all, file);
  PhotoSet set;
  set.source = file;
  std::vector<PhotoFiles> files;
  const json& frames = all.at("frames");
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const json& frame = frames[i];
    PosedPhoto photo;
    photo.name = json_field<std::string>(frame, "file_path", file);
    photo.cam_from_world = pose_of(frame, fmt::format("frames[{}].", i), file);
    if (frame.contains("time")) photo.time_s = json_field<double>(frame, "time", file);
    PhotoFiles of_frame{picture_file(path.parent_path(), photo.name), {}};
    if (frame.contains("mask_path"))
      of_frame.mask = path.parent_path() / json_field<std::string>(frame, "mask_path", file);
    files.push_back(of_frame);
    set.photos.push_back(std::move(photo));
  }
  read_pictures(files, set.photos);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    PosedPhoto& photo = set.photos[i];
    photo.camera =
        camera_of({frames[i], all, file}, width_of(photo.picture), height_of(photo.picture), file, photo.name);
  }
  check_photos(set);
  return set;
}

PhotoSet read_posed_photos(const std::filesystem::path& colmap_folder, const std::filesystem::path& transforms_file) {
  PhotoSet set = colmap_folder.empty() ? read_transforms(transforms_file) : read_colmap(colmap_folder);
  if (set.photos.size() < 2)
    throw InputError(set.source, "", "holds one photo only: add at least another to interpolate");
  return set;
}

}  // namespace mf
