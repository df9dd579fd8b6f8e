// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <map>
#include <sstream>

#include "common/error.h"
#include "common/file_bytes.h"
#include "host/lumigraph/picture_file.h"
#include "host/lumigraph/read_photos.h"

namespace mf {

namespace {

namespace fs = std::filesystem;

// The lines of a COLMAP text file without its comments; empty lines stay, they are a photo without points.
class ColmapLines {
 public:
  explicit ColmapLines(const fs::path& path) : file_(path.string()), text_(read_file_bytes(path)) {}

  bool next() {
    while (std::getline(text_, line_)) {
      ++number_;
      if (!line_.starts_with('#')) return true;
    }
    return false;
  }
  [[nodiscard]] const std::string& line() const { return line_; }
  [[nodiscard]] bool blank() const { return line_.find_first_not_of(" \t\r") == std::string::npos; }
  [[noreturn]] void fail(const std::string& problem) const {
    throw InputError(file_, fmt::format("line {}", number_), problem);
  }

 private:
  std::string file_;
  std::istringstream text_;
  std::string line_;
  int number_ = 0;
};

// Where each of COLMAP's parameters goes in ours (fx fy cx cy k1 k2 p1 p2 k3); a focal length of both axes is −1.
struct ColmapModel {
  std::string_view name;
  std::vector<int> parameters;
};
constexpr int both_focal = -1;
const std::array<ColmapModel, 5>& colmap_models() {
  static const std::array<ColmapModel, 5> models{{{"SIMPLE_PINHOLE", {both_focal, 2, 3}},
                                                  {"PINHOLE", {0, 1, 2, 3}},
                                                  {"SIMPLE_RADIAL", {both_focal, 2, 3, 4}},
                                                  {"RADIAL", {both_focal, 2, 3, 4, 5}},
                                                  {"OPENCV", {0, 1, 2, 3, 4, 5, 6, 7}}}};
  return models;
}

const ColmapModel& find_model(const ColmapLines& lines, std::string_view name) {
  for (const ColmapModel& model : colmap_models())
    if (model.name == name) return model;
  lines.fail(
      fmt::format("{} is a camera model that is not read: undistort the photos (colmap image_undistorter), or "
                  "estimate SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL or OPENCV",
                  name));
}

std::map<int, CameraModel> read_cameras(const fs::path& path) {
  ColmapLines lines(path);
  std::map<int, CameraModel> cameras;
  while (lines.next()) {
    if (lines.blank()) continue;
    std::istringstream words(lines.line());
    int id = 0;
    std::string name;
    CameraModel camera;
    if (!(words >> id >> name >> camera.width >> camera.height) || camera.width < 1 || camera.height < 1)
      lines.fail("is no camera: CAMERA_ID MODEL WIDTH HEIGHT PARAMS...");
    for (const int index : find_model(lines, name).parameters) {
      double value = 0;
      if (!(words >> value) || !std::isfinite(value)) lines.fail("has too few parameters for " + name);
      if (index == both_focal) camera.parameters[1] = value;
      camera.parameters[static_cast<std::size_t>(std::max(index, 0))] = value;
    }
    if (!(camera.fx() > 0 && camera.fy() > 0)) lines.fail("has a focal length that is not positive");
    cameras[id] = camera;
  }
  if (cameras.empty()) throw InputError(path.string(), "", "lists no camera: export the model again");
  return cameras;
}

PosedPhoto read_image_line(const ColmapLines& lines, const std::map<int, CameraModel>& cameras) {
  std::istringstream words(lines.line());
  int id = 0;
  int camera_id = 0;
  double w = 0, x = 0, y = 0, z = 0;
  PosedPhoto photo;
  Eigen::Vector3d& t = photo.cam_from_world.translation;
  if (!(words >> id >> w >> x >> y >> z >> t.x() >> t.y() >> t.z() >> camera_id >> std::ws) ||
      !std::getline(words, photo.name))
    lines.fail("is no image: IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME");
  photo.name.erase(photo.name.find_last_not_of(" \t\r") + 1);
  const double length = std::sqrt(w * w + x * x + y * y + z * z);
  if (!t.allFinite()) lines.fail("has a translation that is not finite: export the model again");
  if (!(std::abs(length - 1) < 1e-2)) lines.fail("has a quaternion that is not of unit length: export the model again");
  photo.cam_from_world.rotation = Eigen::Quaterniond(w, x, y, z).normalized();
  const auto camera = cameras.find(camera_id);
  if (camera == cameras.end()) lines.fail(fmt::format("names camera {}, which cameras.txt does not have", camera_id));
  photo.camera = camera->second;
  return photo;
}

std::vector<Eigen::Vector3f> read_points(const fs::path& path) {
  if (!fs::exists(path)) return {};
  ColmapLines lines(path);
  std::vector<Eigen::Vector3f> points;
  while (lines.next()) {
    if (lines.blank()) continue;
    std::istringstream words(lines.line());
    long long id = 0;
    Eigen::Vector3f point;
    if (!(words >> id >> point.x() >> point.y() >> point.z()) || !point.allFinite())
      lines.fail("is no point: POINT3D_ID X Y Z ...");
    points.push_back(point);
  }
  return points;
}

fs::path model_folder(const fs::path& folder) {
  for (const fs::path& candidate : {folder, folder / "sparse" / "0", folder / "sparse"})
    if (fs::is_regular_file(candidate / "cameras.txt")) return candidate;
  const bool binary = fs::exists(folder / "cameras.bin") || fs::exists(folder / "sparse" / "0" / "cameras.bin");
  throw InputError(folder.string(), "cameras.txt",
                   binary ? "is missing: convert the binary model (colmap model_converter --output_type TXT)"
                          : "is missing, also in sparse/0: name the folder of a COLMAP text model");
}

PhotoFiles files_of(const fs::path& folder, const PosedPhoto& photo) {
  PhotoFiles files{folder / "images" / photo.name, folder / "masks" / (photo.name + ".png")};
  if (!fs::exists(files.picture) && fs::exists(folder / photo.name)) files.picture = folder / photo.name;
  if (!fs::exists(files.mask)) files.mask.clear();
  return files;
}

// See read_colmap: the camera of the picture as it is.
CameraModel fitted(CameraModel camera, int width, int height) {
  if (camera.width == width && camera.height == height) return camera;
  const double scale = static_cast<double>(width) / camera.width;
  const bool same_aspect = std::abs(camera.height * scale - height) <= 0.5;
  camera.parameters[0] *= scale;
  camera.parameters[1] *= scale;
  camera.parameters[2] = same_aspect ? camera.cx() * scale : width / 2.0;
  camera.parameters[3] = same_aspect ? camera.cy() * scale : height / 2.0;
  camera.width = width;
  camera.height = height;
  return camera;
}

}  // namespace

PhotoSet read_colmap(const fs::path& folder) {
  const fs::path model = model_folder(folder);
  const std::map<int, CameraModel> cameras = read_cameras(model / "cameras.txt");
  PhotoSet set;
  set.source = folder.string();
  std::vector<PhotoFiles> files;
  ColmapLines lines(model / "images.txt");
  while (lines.next()) {
    if (lines.blank()) continue;
    set.photos.push_back(read_image_line(lines, cameras));
    files.push_back(files_of(folder, set.photos.back()));
    lines.next();  // the photo's points, which are not used
  }
  if (set.photos.empty())
    throw InputError((model / "images.txt").string(), "", "lists no photo: export the model again");
  set.points = read_points(model / "points3D.txt");
  read_pictures(files, set.photos);
  for (PosedPhoto& photo : set.photos)
    photo.camera = fitted(photo.camera, width_of(photo.picture), height_of(photo.picture));
  check_photos(set);
  return set;
}

}  // namespace mf
