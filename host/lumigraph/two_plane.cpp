// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/two_plane.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "common/atomic_file.h"
#include "common/check.h"
#include "common/error.h"
#include "common/json_file.h"
#include "host/io/image_file.h"
#include "host/lumigraph/picture_file.h"

namespace mf {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

double quantile(std::vector<double> values, double share) {
  const auto at = static_cast<std::ptrdiff_t>(std::lround(share * static_cast<double>(values.size() - 1)));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

double median(std::vector<double> values) {
  return quantile(std::move(values), 0.5);
}

// z the mean direction of sight, y the photos' mean down as far as it is square to that.
Rigid3 facing_frame(const PhotoSet& set) {
  const MeanSight sight = mean_sight(set);
  Eigen::Vector3d down = Eigen::Vector3d::Zero();
  for (const PosedPhoto& photo : set.photos)
    down += photo.cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitY();
  Eigen::Vector3d across = down.cross(sight.direction);
  // Photos turned all ways about their axes have no common down; any upright frame serves then.
  if (!(across.norm() > 1e-3 * static_cast<double>(set.photos.size()))) across = sight.direction.unitOrthogonal();
  Eigen::Matrix3d world_from_uv;
  world_from_uv.col(0) = across.normalized();
  world_from_uv.col(1) = sight.direction.cross(world_from_uv.col(0));
  world_from_uv.col(2) = sight.direction;
  return {Eigen::Quaterniond(world_from_uv), sight.centre};
}

struct Window {
  Eigen::Vector2d centre_m;
  Eigen::Vector2d size_m;
};

// Where the photos look: their middle rays meet the st plane at some points. Photos that turn as they move meet it at
// one point, photos that don't meet it square to themselves: either way all see one window, and it is as large as their
// field of view. Those that look about see more, and it grows by as much as the middle half of them looks apart.
Window fitted_window(const PhotoSet& set, const Rigid3& uv_from_world, double st_distance_m,
                     const std::array<double, 2>& field_of_view) {
  constexpr double slanted = 0.5;  // least cosine: further off, a ray meets the plane far away or not at all
  std::array<std::vector<double>, 2> at;
  std::array<std::vector<double>, 2> from_camera;
  for (const PosedPhoto& photo : set.photos) {
    const auto ray = photo.camera.unproject({photo.camera.width / 2.0, photo.camera.height / 2.0});
    if (!ray) continue;
    const Eigen::Vector3d d = uv_from_world.rotation * (photo.cam_from_world.rotation.conjugate() * ray->normalized());
    if (d.z() < slanted) continue;
    const Eigen::Vector3d centre = uv_from_world * centre_of(photo);
    const Eigen::Vector3d x = centre + (st_distance_m - centre.z()) / d.z() * d;
    for (const std::size_t i : {0U, 1U}) {
      at[i].push_back(x[static_cast<Eigen::Index>(i)]);
      from_camera[i].push_back((x - centre)[static_cast<Eigen::Index>(i)]);
    }
  }
  Window window{Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};
  for (const std::size_t i : {0U, 1U}) {
    const auto spread = [](const std::vector<double>& v) {
      return v.empty() ? 0.0 : quantile(v, 0.75) - quantile(v, 0.25);
    };
    const auto axis = static_cast<Eigen::Index>(i);
    window.size_m[axis] = st_distance_m * field_of_view[i] + std::min(spread(at[i]), spread(from_camera[i]));
    if (!at[i].empty()) window.centre_m[axis] = median(at[i]);
  }
  return window;
}

double distance_to_proxy(const Lumigraph& lumigraph, const Rigid3& world_from_uv) {
  View axis;
  axis.camera.width = axis.camera.height = 1;
  axis.camera.parameters = {1, 1, 0.5, 0.5, 0, 0, 0, 0, 0};
  axis.cam_from_world = world_from_uv.inverse();
  const auto point = lumigraph.point_at(axis, {0.5, 0.5});
  if (!point)
    throw InputError("--two-plane", "st_distance_m",
                     "is not known: the mean line of sight does not meet the proxy. Give --st-distance");
  return (axis.cam_from_world * *point).z();
}

json size_to_json(const Eigen::Vector2d& v) {
  return {v.x(), v.y()};
}

Eigen::Vector2d vector_from_json(const json& layout, const char* key, const std::string& file) {
  const auto v = json_field<std::vector<double>>(layout, key, file);
  if (v.size() != 2) throw InputError(file, key, "must be two numbers");
  return {v[0], v[1]};
}

std::array<int, 2> counts_from_json(const json& layout, const char* key, const std::string& file) {
  const auto v = json_field<std::vector<int>>(layout, key, file);
  if (v.size() != 2) throw InputError(file, key, "must be two whole numbers");
  return {v[0], v[1]};
}

// Of a frame in transforms.json: the pose with OpenGL's axes (x right, y up, z back), and the principal point.
json frame_entry(const View& view, const std::string& picture) {
  const Rigid3 cam_from_gl{Eigen::Quaterniond(0, 1, 0, 0), Eigen::Vector3d::Zero()};  // half a turn about x
  return {{"file_path", picture},
          {"transform_matrix", rigid3_to_json(view.cam_from_world.inverse() * cam_from_gl)},
          {"cx", view.camera.cx()},
          {"cy", view.camera.cy()}};
}

json transforms_of(const TwoPlane& planes) {
  const View first = grid_view(planes, 0, 0);
  return {{"camera_model", "PINHOLE"}, {"w", planes.size_px[0]},    {"h", planes.size_px[1]},
          {"fl_x", first.camera.fx()}, {"fl_y", first.camera.fy()}, {"frames", json::array()}};
}

}  // namespace

std::optional<std::string> TwoPlane::validate() const {
  for (const int n : cameras)
    if (n < 1 || n > 256) return "cameras: must be between 1 and 256 each way";
  if (!(uv_size_m.allFinite() && uv_size_m.minCoeff() >= 0)) return "uv_size_m: must be numbers ≥ 0";
  for (const Eigen::Index i : {0, 1})
    if (cameras[static_cast<std::size_t>(i)] > 1 && !(uv_size_m[i] > 0))
      return "uv_size_m: must be above 0 where more than one camera stands";
  if (!(st_distance_m > 0) || !std::isfinite(st_distance_m)) return "st_distance_m: must be above 0";
  if (!st_centre_m.allFinite()) return "st_centre_m: must be numbers";
  if (!(st_size_m.allFinite() && st_size_m.minCoeff() > 0)) return "st_size_m: must be above 0";
  for (const int n : size_px)
    if (n < 2 || n > 8192) return "size_px: must be between 2 and 8192 each way";
  return std::nullopt;
}

View grid_view(const TwoPlane& planes, int column, int row) {
  check(column >= 0 && row >= 0 && column < planes.cameras[0] && row < planes.cameras[1], "a camera of the grid");
  const auto place = [](int i, int count, double size) {
    return count > 1 ? size * (static_cast<double>(i) / (count - 1) - 0.5) : 0.0;
  };
  const double u = place(column, planes.cameras[0], planes.uv_size_m.x());
  const double v = place(row, planes.cameras[1], planes.uv_size_m.y());
  const double per_metre_x = planes.size_px[0] / planes.st_size_m.x();
  const double per_metre_y = planes.size_px[1] / planes.st_size_m.y();
  const Eigen::Vector2d corner = planes.st_centre_m - planes.st_size_m / 2;
  View view;
  view.camera.width = planes.size_px[0];
  view.camera.height = planes.size_px[1];
  view.camera.parameters = {per_metre_x * planes.st_distance_m,
                            per_metre_y * planes.st_distance_m,
                            per_metre_x * (u - corner.x()),
                            per_metre_y * (v - corner.y()),
                            0,
                            0,
                            0,
                            0,
                            0};
  view.cam_from_world =
      (planes.world_from_uv * Rigid3{Eigen::Quaterniond::Identity(), Eigen::Vector3d(u, v, 0)}).inverse();
  return view;
}

TwoPlane fitted_two_plane(const Lumigraph& lumigraph, const PhotoSet& set, std::array<int, 2> cameras,
                          std::optional<double> st_distance_m) {
  constexpr double outside =
      0.1;  // of the centres on each side: a grid that reaches to the last photo would be guessed
  TwoPlane planes;
  planes.cameras = cameras;
  planes.world_from_uv = facing_frame(set);
  const Rigid3 uv_from_world = planes.world_from_uv.inverse();
  std::array<std::vector<double>, 2> centres;
  std::array<std::vector<double>, 2> tangents;  // of the field of view
  std::vector<double> focal_px;
  for (const PosedPhoto& photo : set.photos) {
    const Eigen::Vector3d centre = uv_from_world * centre_of(photo);
    for (const Eigen::Index i : {0, 1}) centres[static_cast<std::size_t>(i)].push_back(centre[i]);
    tangents[0].push_back(photo.camera.width / photo.camera.fx());
    tangents[1].push_back(photo.camera.height / photo.camera.fy());
    focal_px.push_back(photo.camera.fx());
  }
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Index i : {0, 1}) {
    const double low = quantile(centres[static_cast<std::size_t>(i)], outside);
    const double high = quantile(centres[static_cast<std::size_t>(i)], 1 - outside);
    planes.uv_size_m[i] = high - low;
    middle[i] = (low + high) / 2;
  }
  planes.world_from_uv = planes.world_from_uv * Rigid3{Eigen::Quaterniond::Identity(), middle};
  planes.st_distance_m = st_distance_m ? *st_distance_m : distance_to_proxy(lumigraph, planes.world_from_uv);
  const Window window = fitted_window(set, planes.world_from_uv.inverse(), planes.st_distance_m,
                                      {median(tangents[0]), median(tangents[1])});
  planes.st_centre_m = window.centre_m;
  planes.st_size_m = window.size_m;
  const double per_metre = median(focal_px) / planes.st_distance_m;
  for (const std::size_t i : {0U, 1U})
    planes.size_px[i] =
        std::clamp(static_cast<int>(std::lround(per_metre * window.size_m[static_cast<Eigen::Index>(i)])), 2, 8192);
  if (const auto wrong = planes.validate())
    throw InputError("--two-plane", "", *wrong + " (fitted to the photos): give a layout");
  return planes;
}

json to_json(const TwoPlane& planes) {
  return {{"world_from_uv", rigid3_to_json(planes.world_from_uv)},
          {"cameras", planes.cameras},
          {"uv_size_m", size_to_json(planes.uv_size_m)},
          {"st_distance_m", planes.st_distance_m},
          {"st_centre_m", size_to_json(planes.st_centre_m)},
          {"st_size_m", size_to_json(planes.st_size_m)},
          {"size_px", planes.size_px}};
}

TwoPlane two_plane_from_json(const json& layout, const std::string& file) {
  if (!layout.is_object()) throw InputError(file, "", "is no two-plane layout: see docs/lumigraph.md");
  const json known = to_json(TwoPlane{});
  for (const auto& [key, value] : layout.items())
    if (!known.contains(key))
      throw InputError(file, key, "is not known: see docs/lumigraph.md for the layout's fields");
  if (!layout.contains("world_from_uv")) throw InputError(file, "world_from_uv", "is missing: add the 4×4 pose");
  TwoPlane planes;
  planes.world_from_uv = rigid3_from_json(layout.at("world_from_uv"), "world_from_uv", file);
  planes.cameras = counts_from_json(layout, "cameras", file);
  planes.uv_size_m = vector_from_json(layout, "uv_size_m", file);
  planes.st_distance_m = json_field<double>(layout, "st_distance_m", file);
  planes.st_centre_m = vector_from_json(layout, "st_centre_m", file);
  planes.st_size_m = vector_from_json(layout, "st_size_m", file);
  planes.size_px = counts_from_json(layout, "size_px", file);
  if (const auto wrong = planes.validate()) {
    const std::size_t colon = wrong->find(": ");
    throw InputError(file, wrong->substr(0, colon), wrong->substr(colon + 2));
  }
  return planes;
}

TwoPlaneSummary write_two_plane(const fs::path& folder, const FrameRenderer& renderer, const TwoPlane& planes,
                                const LumigraphOptions& options, const Progress& progress) {
  check(!planes.validate(), "the two planes are valid");
  make_folder(folder);
  json transforms = transforms_of(planes);
  TwoPlaneSummary summary;
  std::size_t covered = 0;
  const int count = planes.cameras[0] * planes.cameras[1];
  for (int i = 0; i < count; ++i) {
    report_progress(progress, "two-plane pictures", static_cast<double>(i) / count);
    const View view = grid_view(planes, i % planes.cameras[0], i / planes.cameras[0]);
    const LumigraphPicture shown = renderer.render(view, options);
    const std::string name = fmt::format("{:02}_{:02}", i / planes.cameras[0], i % planes.cameras[0]);
    json entry = frame_entry(view, write_picture(folder / name, shown.picture).filename().string());
    ImageU8 mask = shown.covered;
    for (std::uint8_t& value : mask.data) value = value == Covered::nothing ? 0 : 255;
    const auto here = static_cast<std::size_t>(std::count(mask.data.begin(), mask.data.end(), std::uint8_t{255}));
    if (here < mask.data.size()) {
      entry["mask_path"] = name + "_mask.png";
      write_png(folder / (name + "_mask.png"), mask);
    }
    covered += here;
    transforms["frames"].push_back(std::move(entry));
    ++summary.pictures;
  }
  if (covered == 0)
    throw InputError(
        folder.string(), "",
        "would show nothing: no photo sees what lies beyond the st window. Give another layout or --proxy");
  summary.covered = static_cast<double>(covered) / (static_cast<double>(count) * planes.size_px[0] * planes.size_px[1]);
  write_json_file(folder / "two_plane.json", to_json(planes));
  write_json_file(folder / "transforms.json", transforms);
  report_progress(progress, "two-plane pictures", 1);
  return summary;
}

}  // namespace mf
