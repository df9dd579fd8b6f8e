// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/session_photos.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>

#include "common/check.h"
#include "common/demosaic.h"
#include "common/error.h"
#include "common/mirror_picture.h"

namespace mf {

namespace {

constexpr int least_side_px = 16;  // less of a mirror shows nothing that its border leaves

struct PixelBox {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;  // [x0, x1) × [y0, y1)
};

PixelBox box_about(const Polygon2& polygon, int width, int height) {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector2d high = -low;
  for (const Eigen::Vector2d& corner : polygon) {
    low = low.cwiseMin(corner);
    high = high.cwiseMax(corner);
  }
  const auto within = [](double value, int size) { return static_cast<int>(std::clamp<double>(value, 0, size)); };
  return {within(std::floor(low.x()), width), within(std::floor(low.y()), height), within(std::ceil(high.x()), width),
          within(std::ceil(high.y()), height)};
}

template <typename T>
Image<T> cut(const Image<T>& image, const PixelBox& box) {
  Image<T> out(box.x1 - box.x0, box.y1 - box.y0, image.channels);
  for (int y = 0; y < out.height; ++y) {
    const auto row = image.row(box.y0 + y).subspan(static_cast<std::size_t>(box.x0 * image.channels));
    std::copy_n(row.begin(), out.row(y).size(), out.row(y).begin());
  }
  return out;
}

double distance_to_side(const Eigen::Vector2d& x, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector2d side = b - a;
  const double along = std::clamp(side.dot(x - a) / std::max(side.squaredNorm(), 1e-12), 0.0, 1.0);
  return (x - a - along * side).norm();
}

double distance_to_outline(const Eigen::Vector2d& x, const Polygon2& polygon) {
  double distance = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < polygon.size(); ++i)
    distance = std::min(distance, distance_to_side(x, polygon[i], polygon[(i + 1) % polygon.size()]));
  return distance;
}

double shorter_side(const Polygon2& polygon) {  // of the opening's four, however many corners distortion gives them
  const std::size_t steps = polygon.size() / 4;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < 4; ++i)
    least = std::min(least, (polygon[i * steps] - polygon[(i + 1) * steps % polygon.size()]).norm());
  return least;
}

// How much each pixel of the frame shows of the mirror: 0 outside and within the inset, then rising smoothly.
ImageU8 opening_mask(const Polygon2& opening, int width, int height, const SessionPhotoOptions& options) {
  ImageU8 mask = mask_of(opening, width, height);
  const double ramp = std::max(options.border_fraction * shorter_side(opening), 1e-3);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      if (mask.at(x, y) == 0) continue;
      const double inside = distance_to_outline({x + 0.5, y + 0.5}, opening) - options.inset_px;
      const double t = std::clamp(inside / ramp, 0.0, 1.0);
      mask.at(x, y) = static_cast<std::uint8_t>(std::lround(255 * t * t * (3 - 2 * t)));
    }
  return mask;
}

class SessionPhotos {
 public:
  SessionPhotos(const SessionReader& session, const ResponseCurve& response, const Calibration& calibration,
                const SessionPhotoOptions& options)
      : session_(session), response_(response), calibration_(calibration), options_(options) {}

  [[nodiscard]] PosedPhoto scene(const SessionFrame& frame) const {
    return finished(
        {"scene/" + frame.info.name, calibration_.camera, cam_from_world(), read(frame), {}, frame.info.time_s});
  }

  // Nothing when the frame shows too little of the mirror.
  [[nodiscard]] std::optional<PosedPhoto> mirror(const SessionFrame& frame) const {
    const auto pose = std::find_if(calibration_.frames.begin(), calibration_.frames.end(),
                                   [&](const MirrorPose& p) { return p.name == frame.info.name; });
    if (pose == calibration_.frames.end() || !pose->used) return std::nullopt;
    const auto view = mirror_view(pose->cam_from_mirror, session_.header().target, calibration_.camera);
    if (!view || view->opening_in_img.empty()) return std::nullopt;
    const int width = calibration_.camera.width;
    const int height = calibration_.camera.height;
    const PixelBox box = box_about(view->opening_in_img, width, height);
    if (box.x1 - box.x0 < least_side_px || box.y1 - box.y0 < least_side_px) return std::nullopt;
    ImageF picture = cut(read(frame), box);
    ImageU8 mask = cut(opening_mask(view->opening_in_img, width, height, options_), box);
    for (float& value : picture.data) value /= static_cast<float>(session_.header().mirror_reflectance);
    flip_x(picture);
    flip_x(mask);
    CameraModel camera = flipped_camera(calibration_.camera);
    camera.parameters[2] -= width - box.x1;  // the box is flipped too
    camera.parameters[3] -= box.y0;
    camera.width = picture.width;
    camera.height = picture.height;
    return finished({"mirror/" + frame.info.name, camera, view->view_from_cam * cam_from_world(), std::move(picture),
                     std::move(mask), frame.info.time_s});
  }

 private:
  [[nodiscard]] Rigid3 cam_from_world() const { return calibration_.cam_from_world.value_or(Rigid3{}); }

  [[nodiscard]] ImageF read(const SessionFrame& frame) const {
    const PixelFormat& format = session_.header().format;
    ImageF linear = demosaic(linearize(session_.read_frame(frame), format, response_), format.layout);
    if (linear.channels == 3) return linear;
    ImageF grey(linear.width, linear.height, 3);
    for (std::size_t i = 0; i < grey.data.size(); ++i) grey.data[i] = linear.data[i / 3];
    return grey;
  }

  // Scaled one by one: whole frames of a long session would not fit in memory.
  [[nodiscard]] PosedPhoto finished(PosedPhoto photo) const {
    PhotoSet one;
    one.photos.push_back(std::move(photo));
    return std::move(scaled(std::move(one), options_.scale).photos.front());
  }

  const SessionReader& session_;
  const ResponseCurve& response_;
  const Calibration& calibration_;
  const SessionPhotoOptions& options_;
};

}  // namespace

std::optional<std::string> SessionPhotoOptions::validate() const {
  if (!(scale > 0 && scale <= 1)) return "scale: must be above 0 and at most 1";
  if (!(inset_px >= 0 && inset_px <= 64)) return "inset: must be between 0 and 64 pixels";
  if (!(border_fraction >= 0 && border_fraction <= 0.5)) return "border: must be between 0 and 0.5 of the opening";
  return std::nullopt;
}

PhotoSet photos_of_session(const SessionReader& session, const ResponseCurve& response, const Calibration& calibration,
                           const SessionPhotoOptions& options, const Progress& progress) {
  check(!options.validate(), "session photo options are valid");
  const SessionPhotos photos(session, response, calibration, options);
  const std::vector<SessionFrame> frames = session.frames(FrameRole::mirror);
  std::vector<std::optional<PosedPhoto>> found(frames.size());
  std::mutex mutex;
  std::size_t done = 0;
  tbb::parallel_for(std::size_t{0}, frames.size(), [&](std::size_t i) {
    found[i] = photos.mirror(frames[i]);
    const std::lock_guard lock(mutex);
    report_progress(progress, "reading frames", static_cast<double>(++done) / static_cast<double>(frames.size()));
  });
  PhotoSet set;
  set.source = session.folder().string();
  for (auto& photo : found)
    if (photo) set.photos.push_back(std::move(*photo));
  if (set.photos.size() < 2)
    throw InputError(set.source, "calibration.json",
                     "uses fewer than two frames that show the mirror: calibrate again, or record more");
  if (options.scene && calibration.cam_from_world)
    for (const SessionFrame& frame : session.frames(FrameRole::scene)) set.photos.push_back(photos.scene(frame));
  check_photos(set);
  return set;
}

}  // namespace mf
