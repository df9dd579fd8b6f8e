// SPDX-License-Identifier: Apache-2.0
#include "host/io/view.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/json_file.h"

namespace mf {

namespace {

using Rows = std::vector<std::vector<double>>;

CameraModel read_camera(const nlohmann::json& entry, const std::string& prefix, const std::string& file) {
  if (!entry.is_object() || !entry.contains("K"))
    throw InputError(file, prefix + "K", "is missing: add the 3×3 matrix");
  const auto rows = json_field<Rows>(entry, "K", file);
  const bool shape = rows.size() == 3 && rows[0].size() == 3 && rows[1].size() == 3 && rows[2].size() == 3;
  if (!shape) throw InputError(file, prefix + "K", "is no 3×3 matrix: give three rows of three numbers");
  if (!(rows[0][0] > 0 && rows[1][1] > 0 && std::isfinite(rows[0][0]) && std::isfinite(rows[1][1])))
    throw InputError(file, prefix + "K", "has a focal length that is not positive: give it in pixels");
  CameraModel camera;
  camera.parameters = {rows[0][0], rows[1][1], rows[0][2], rows[1][2], 0, 0, 0, 0, 0};
  const auto distortion = json_field_or<std::vector<double>>(entry, "distortion", file, {});
  if (!distortion.empty() && distortion.size() != 5)
    throw InputError(file, prefix + "distortion", "needs five numbers: k1, k2, p1, p2, k3");
  std::copy(distortion.begin(), distortion.end(), camera.parameters.begin() + 4);
  return camera;
}

std::array<int, 2> picture_size(const nlohmann::json& entry, const CameraModel& camera, const std::string& prefix,
                                const std::string& file) {
  const std::array<int, 2> centred{static_cast<int>(std::lround(2 * camera.cx())),
                                   static_cast<int>(std::lround(2 * camera.cy()))};
  const auto size = json_field_or<std::array<int, 2>>(entry, "size", file, centred);
  constexpr int largest = 32768;  // a slip in the file rather than a picture
  if (size[0] < 1 || size[1] < 1 || size[0] > largest || size[1] > largest)
    throw InputError(file, prefix + "size", "is no picture size: give [width, height] in pixels");
  return size;
}

}  // namespace

View read_view(const std::filesystem::path& path, int index, std::optional<std::array<int, 2>> size_px) {
  const std::string file = path.string();
  const nlohmann::json views = read_json_file(path);
  if (!views.is_array() || views.empty()) throw InputError(file, "", "is no list of views: see docs/rendering.md");
  const int count = static_cast<int>(views.size());
  if (index < 0 || index >= count)
    throw InputError(file, "", fmt::format("has no view {}: choose one of 0 to {}", index, count - 1));
  return view_from_json(views[static_cast<std::size_t>(index)], fmt::format("[{}].", index), file, size_px);
}

View view_from_json(const nlohmann::json& entry, const std::string& prefix, const std::string& file,
                    std::optional<std::array<int, 2>> size_px) {
  View view;
  view.camera = read_camera(entry, prefix, file);
  if (!entry.contains("camera_from_world"))
    throw InputError(file, prefix + "camera_from_world", "is missing: add the 4×4 pose");
  view.cam_from_world = rigid3_from_json(entry.at("camera_from_world"), prefix + "camera_from_world", file);
  const std::array<int, 2> size = size_px ? *size_px : picture_size(entry, view.camera, prefix, file);
  view.camera.width = size[0];
  view.camera.height = size[1];
  if (!(view.camera.cx() > 0 && view.camera.cx() < size[0] && view.camera.cy() > 0 && view.camera.cy() < size[1]))
    throw InputError(
        file, prefix + "K",
        fmt::format("has its principal point outside of the {}×{} picture: is it another camera's?", size[0], size[1]));
  if (entry.contains("size") && size_px && picture_size(entry, view.camera, prefix, file) != size)
    throw InputError(file, prefix + "size", fmt::format("differs from the plate's {}×{} pixels", size[0], size[1]));
  return view;
}

}  // namespace mf
