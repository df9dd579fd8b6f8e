// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/field_views.h"

#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>

#include "common/demosaic.h"
#include "common/error.h"
#include "common/virtual_view.h"

namespace mf {

namespace {

// A rectangle of level-0 pixels.
struct PixelBox {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  [[nodiscard]] bool empty() const { return x1 <= x0 || y1 <= y0; }
};

PixelBox opening_box(const Polygon2& opening, double scale, int width, int height) {
  if (opening.empty()) return {};
  Eigen::Vector2d low = opening.front(), high = opening.front();
  for (const Eigen::Vector2d& p : opening) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return {std::max(0, static_cast<int>(std::floor(low.x() * scale))),
          std::max(0, static_cast<int>(std::floor(low.y() * scale))),
          std::min(width, static_cast<int>(std::ceil(high.x() * scale))),
          std::min(height, static_cast<int>(std::ceil(high.y() * scale)))};
}

double smooth_step(double x) {
  const double t = std::clamp(x, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

// The mirror's surface as seen by an ideal pinhole: ray (x, y, 1) in the camera → (x·w, y·w, w) on the mirror, metres.
Eigen::Matrix3d mirror_from_ray(const Rigid3& cam_from_mirror) {
  const Eigen::Matrix3d r = cam_from_mirror.rotation.toRotationMatrix();
  Eigen::Matrix3d cam_from_surface;
  cam_from_surface << r.col(0), r.col(1), cam_from_mirror.translation;
  return cam_from_surface.inverse();
}

Eigen::Vector3f bilinear_rgb(const ImageF& image, double u, double v) {
  const double x = std::clamp(u - 0.5, 0.0, image.width - 1.0), y = std::clamp(v - 0.5, 0.0, image.height - 1.0);
  const int x0 = std::min(static_cast<int>(x), std::max(image.width - 2, 0));
  const int y0 = std::min(static_cast<int>(y), std::max(image.height - 2, 0));
  const int x1 = std::min(x0 + 1, image.width - 1), y1 = std::min(y0 + 1, image.height - 1);
  const float fx = static_cast<float>(x - x0), fy = static_cast<float>(y - y0);
  Eigen::Vector3f out;
  for (int c = 0; c < 3; ++c) {
    const int channel = image.channels == 1 ? 0 : c;
    const float top = image.at(x0, y0, channel) * (1 - fx) + image.at(x1, y0, channel) * fx;
    const float bottom = image.at(x0, y1, channel) * (1 - fx) + image.at(x1, y1, channel) * fx;
    out[c] = top * (1 - fy) + bottom * fy;
  }
  return out;
}

struct ViewGeometry {
  const CameraModel* camera;
  const MirrorTarget* target;
  Eigen::Matrix3d mirror_from_ray;
  double scale;  // level-0 pixels per camera pixel
};

// Buehler's field-of-view weight at a camera pixel whose ideal ray is given.
double view_weight(const ViewGeometry& g, const FieldViewOptions& options, const Eigen::Vector3d& ray,
                   const Eigen::Vector2d& pixel) {
  const Eigen::Vector3d h = g.mirror_from_ray * ray;
  if (h.z() <= 0) return 0;
  const Eigen::Vector2d inside = 0.5 * g.target->opening_m - h.hnormalized().cwiseAbs();  // to the edges, metres
  const double border = options.border_fraction * g.target->opening_m.minCoeff();
  // Metres on the mirror per pixel, from the change of the surface point along one pixel step in each direction.
  const double px = 1.0 / g.camera->fx();
  const Eigen::Vector2d step = (g.mirror_from_ray * (ray + Eigen::Vector3d(px, 0, 0))).hnormalized() - h.hnormalized();
  const Eigen::Vector2d step_y =
      (g.mirror_from_ray * (ray + Eigen::Vector3d(0, px, 0))).hnormalized() - h.hnormalized();
  const Eigen::Vector2d per_px = step.cwiseAbs() + step_y.cwiseAbs();
  const Eigen::Vector2d clear = inside - options.inset_px * per_px;
  if (clear.minCoeff() <= 0) return 0;
  const double mirror_edge = border > 0 ? smooth_step(clear.minCoeff() / border) : 1.0;
  const double picture_edge =
      std::min({pixel.x(), pixel.y(), g.camera->width - pixel.x(), g.camera->height - pixel.y()});
  constexpr double picture_border_px = 12;  // a frame that cuts the mirror fades out as softly as the mirror's edge
  return mirror_edge * smooth_step((picture_edge - options.inset_px) / picture_border_px);
}

PremultipliedImage crop_opening(const ImageF& radiance, const PixelBox& box, const ViewGeometry& g,
                                const FieldViewOptions& options, float gain) {
  PremultipliedImage out(box.x1 - box.x0, box.y1 - box.y0);
  const bool straight = !g.camera->has_distortion();
  for (int y = 0; y < out.height(); ++y)
    for (int x = 0; x < out.width(); ++x) {
      const Eigen::Vector2d ideal((box.x0 + x + 0.5) / g.scale, (box.y0 + y + 0.5) / g.scale);
      const Eigen::Vector3d ray((ideal.x() - g.camera->cx()) / g.camera->fx(),
                                (ideal.y() - g.camera->cy()) / g.camera->fy(), 1);
      const Eigen::Vector2d pixel = straight ? ideal : g.camera->project(ray);
      const float a = static_cast<float>(view_weight(g, options, ray, pixel));
      if (a <= 0) continue;
      Eigen::Vector3f colour;
      if (straight)
        for (int c = 0; c < 3; ++c) colour[c] = radiance.at(box.x0 + x, box.y0 + y, radiance.channels == 1 ? 0 : c);
      else
        colour = bilinear_rgb(radiance, pixel.x() * g.scale, pixel.y() * g.scale);
      out.at(x, y) << colour * (gain * a), a;
    }
  return out;
}

PremultipliedImage half_size(const PremultipliedImage& in) {
  PremultipliedImage out((in.width() + 1) / 2, (in.height() + 1) / 2);
  // An odd size reads the empty rim: beyond the edge nothing was seen.
  for (int y = 0; y < out.height(); ++y)
    for (int x = 0; x < out.width(); ++x)
      out.at(x, y) = 0.25F * (in.at(2 * x, 2 * y) + in.at(2 * x + 1, 2 * y) + in.at(2 * x, 2 * y + 1) +
                              in.at(2 * x + 1, 2 * y + 1));
  return out;
}

// Everything of a view but its pixels.
void set_geometry(FieldView& view, const Calibration& calibration, const PixelBox& box, const VirtualView& virtual_view,
                  double scale) {
  const CameraModel& camera = calibration.camera;
  Eigen::Matrix4d reflected_from_world = virtual_view.view_from_cam.matrix() * calibration.cam_from_world->matrix();
  if (virtual_view.flip_x) reflected_from_world.row(0) *= -1;
  Eigen::Matrix3d k = camera.k_matrix();
  k.topRows<2>() *= scale;
  k(0, 2) -= box.x0;
  k(1, 2) -= box.y0;
  view.pixel_from_world = (k * reflected_from_world.topRows<3>()).cast<float>();
  view.centre_in_world = (calibration.cam_from_world->inverse() * virtual_view.centre_in_cam()).cast<float>();
  view.focal_px = static_cast<float>(0.5 * (camera.fx() + camera.fy()) * scale);
}

}  // namespace

std::vector<FieldView> load_field_views(const SessionReader& session, const ResponseCurve& response,
                                        const Calibration& calibration, const FieldViewOptions& options,
                                        const Progress& progress) {
  const std::string source = (session.folder() / "calibration.json").string();
  if (!calibration.cam_from_world)
    throw InputError(source, "cam_from_world",
                     "is missing: import a scene picture and world.json, then calibrate again");
  const std::vector<SessionFrame> frames = session.frames(FrameRole::mirror);
  if (frames.size() != calibration.frames.size())
    throw InputError(source, "frames", "does not match the session's frames: calibrate again");
  const PixelFormat& format = session.header().format;
  // Binning a mosaic's cells needs no demosaicing; other formats bin as well, for the same scale everywhere.
  const double scale = options.full_resolution ? 1.0 : 0.5;
  const float gain = static_cast<float>(1 / session.header().mirror_reflectance);

  std::vector<FieldView> loaded(frames.size());
  std::atomic<std::size_t> done = 0;
  std::mutex reporting;
  tbb::parallel_for(std::size_t{0}, frames.size(), [&](std::size_t i) {
    const MirrorPose& pose = calibration.frames[i];
    const auto virtual_view =
        pose.used ? mirror_view(pose.cam_from_mirror, session.header().target, calibration.camera) : std::nullopt;
    const int width = static_cast<int>(calibration.camera.width * scale),
              height = static_cast<int>(calibration.camera.height * scale);
    const PixelBox box = virtual_view ? opening_box(virtual_view->opening_in_img, scale, width, height) : PixelBox{};
    if (!box.empty()) {
      const ImageF linear = linearize(session.read_frame(frames[i]), format, response);
      const ImageF radiance =
          options.full_resolution ? demosaic(linear, format.layout) : bin_cells(linear, format.layout);
      FieldView& view = loaded[i];
      view.frame = i;
      set_geometry(view, calibration, box, *virtual_view, scale);
      const ViewGeometry geometry{&calibration.camera, &session.header().target, mirror_from_ray(pose.cam_from_mirror),
                                  scale};
      view.levels.push_back(crop_opening(radiance, box, geometry, options, gain));
      while (view.levels.back().width() > 2 || view.levels.back().height() > 2)
        view.levels.push_back(half_size(view.levels.back()));
    }
    const std::size_t finished = ++done;
    const std::lock_guard lock(reporting);
    report_progress(progress, "linearizing views", static_cast<double>(finished) / static_cast<double>(frames.size()));
  });
  std::erase_if(loaded, [](const FieldView& v) { return v.levels.empty(); });
  if (loaded.empty()) throw InputError(source, "frames", "holds no usable mirror pose: look at why_not of each frame");
  return loaded;
}

}  // namespace mf
