// SPDX-License-Identifier: Apache-2.0
#include "host/viewer/lumigraph_view.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/check.h"
#include "host/io/image_file.h"

namespace mf {

namespace {

std::size_t middle_photo(const std::vector<Lumigraph::Source>& photos) {
  const auto centre = [](const Lumigraph::Source& photo) { return photo.cam_from_world.inverse().translation; };
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Lumigraph::Source& photo : photos) mean += centre(photo) / static_cast<double>(photos.size());
  const auto nearest = std::min_element(photos.begin(), photos.end(), [&](const auto& a, const auto& b) {
    return (centre(a) - mean).squaredNorm() < (centre(b) - mean).squaredNorm();
  });
  return static_cast<std::size_t>(nearest - photos.begin());
}

Eigen::Vector3d mean_up(const std::vector<Lumigraph::Source>& photos) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Lumigraph::Source& photo : photos)
    sum -= photo.cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitY();
  constexpr double undecided = 0.1;  // photos whose edges point everywhere: the world's own up will do
  return sum.norm() < undecided * static_cast<double>(photos.size()) ? Eigen::Vector3d::UnitZ()
                                                                     : Eigen::Vector3d(sum.normalized());
}

CameraModel without_distortion(CameraModel camera) {
  std::fill(camera.parameters.begin() + 4, camera.parameters.end(), 0.0);
  return camera;
}

CameraModel at_width(const CameraModel& lens, int width_px) {
  const double scale = static_cast<double>(width_px) / lens.width;
  CameraModel camera = lens;
  camera.width = width_px;
  camera.height = std::max(1, static_cast<int>(std::lround(lens.height * scale)));
  for (std::size_t i = 0; i < 4; ++i) camera.parameters[i] *= scale;
  return camera;
}

}  // namespace

LumigraphView::LumigraphView(Lumigraph lumigraph) : lumigraph_(std::move(lumigraph)) {
  navigation_.up_in_world = mean_up(lumigraph_.sources());
  jump(middle_photo(lumigraph_.sources()));
  grab();
  constexpr int glance_px = 256;
  const LumigraphPicture first = lumigraph_.render(view(glance_px), options_);
  if (const auto* linear = std::get_if<ImageF>(&first.picture)) exposure_ = display_exposure(*linear);
}

void LumigraphView::jump(std::size_t photo) {
  const Lumigraph::Source& source = lumigraph_.sources().at(photo);
  navigation_ = jumped(navigation_, source.cam_from_world.inverse());
  lens_ = without_distortion(source.camera);
}

double LumigraphView::aspect() const {
  return static_cast<double>(lens_.width) / lens_.height;
}

View LumigraphView::view(int width_px) const {
  return {at_width(lens_, width_px), navigation_.world_from_cam.inverse()};
}

double LumigraphView::depth_ahead() const {
  const View ahead = view(lens_.width);
  const auto point = lumigraph_.point_at(ahead, {ahead.camera.cx(), ahead.camera.cy()});
  return point ? (ahead.cam_from_world * *point).z() : navigation_.focus_distance;
}

void LumigraphView::grab() {
  navigation_.focus_distance = depth_ahead();
}

void LumigraphView::focus_at(double depth) {
  check(depth > 0, "the focus lies before the camera");
  navigation_.focus_distance = depth;
  PlaneProxy plane = std::get<PlaneProxy>(lumigraph_.proxy());
  plane.offset = plane.normal.dot(navigation_.pivot_in_world().cast<float>());
  lumigraph_.set_proxy(plane);
}

void LumigraphView::face_plane() {
  grab();
  PlaneProxy plane;
  plane.normal = (navigation_.world_from_cam.rotation * Eigen::Vector3d::UnitZ()).cast<float>();
  plane.offset = plane.normal.dot(navigation_.pivot_in_world().cast<float>());
  check(has_focus(), "only a plane is turned");
  lumigraph_.set_proxy(plane);
}

void LumigraphView::set_options(const LumigraphOptions& options) {
  check(!options.validate(), "the lumigraph's options are valid");
  options_ = options;
}

ImageU8 LumigraphView::render(const View& view, double stops) const {
  LumigraphPicture made = lumigraph_.render(view, options_);
  if (auto* codes = std::get_if<ImageU8>(&made.picture)) return std::move(*codes);
  return to_srgb8(std::get<ImageF>(made.picture), exposure_ * std::exp2(stops));
}

std::vector<ViewWeight> LumigraphView::weights_at(const Eigen::Vector2d& position, int width_px) const {
  const View whole = view(width_px);
  return lumigraph_.weights_at(whole, {position.x() * whole.camera.width, position.y() * whole.camera.height},
                               options_);
}

void Pace::took(double seconds, int divisor) {
  constexpr double wanted_s = 1.0 / 30;
  const double full_size_s = seconds * divisor * divisor;  // time goes with the pixels
  divisor_ = full_size_s <= wanted_s ? 1 : full_size_s <= 4 * wanted_s ? 2 : 4;
}

}  // namespace mf
