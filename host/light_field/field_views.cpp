// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/field_views.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>

#include "common/demosaic.h"
#include "common/error.h"
#include "common/virtual_view.h"
#include "host/light_field/binned_radiance.h"

namespace mf {

// ---- levels ----

void PremultipliedImage::set(int x, int y, const Eigen::Vector4f& texel) {
  const float scale = 1 / unit_;
  texels_[index(x, y)] = Texel{to_normal_half(texel.x() * scale), to_normal_half(texel.y() * scale),
                               to_normal_half(texel.z() * scale), to_normal_half(texel.w())};
}

namespace {

// Texels by rows, as floats: levels are made from each other before they are rounded.
struct FloatTexels {
  int width = 0;
  int height = 0;
  std::vector<Eigen::Vector4f> texels;
};

void encode(std::span<const Eigen::Vector4f> texels, PremultipliedImage& image) {
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x)
      image.set(
          x, y,
          texels[static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width()) + static_cast<std::size_t>(x)]);
}

void half_size(std::span<const Eigen::Vector4f> in, int width, int height, FloatTexels& out) {
  out.width = (width + 1) / 2;
  out.height = (height + 1) / 2;
  out.texels.resize(static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height));
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x) {
      const bool right = 2 * x + 1 < width, below = 2 * y + 1 < height;  // beyond the edge nothing was seen
      const Eigen::Vector4f* at =
          &in[static_cast<std::size_t>(2 * y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(2 * x)];
      Eigen::Vector4f sum = at[0];
      if (right) sum += at[1];
      if (below) sum += at[width];
      if (right && below) sum += at[width + 1];
      out.texels[static_cast<std::size_t>(y) * static_cast<std::size_t>(out.width) + static_cast<std::size_t>(x)] =
          0.25F * sum;
    }
}

// The power of two in which the brightest texel is just below half the largest half float.
float unit_for(std::span<const Eigen::Vector4f> texels) {
  Eigen::Vector4f most = Eigen::Vector4f::Zero();
  for (const Eigen::Vector4f& t : texels) most = most.cwiseMax(t);
  const float brightest = most.head<3>().maxCoeff();
  if (!(brightest > 0) || !std::isfinite(brightest)) return 1;
  constexpr int target_exponent = 14;
  return std::ldexp(1.0F, std::clamp(std::ilogb(brightest) - target_exponent, -120, 120));
}

}  // namespace

namespace {

std::vector<PremultipliedImage> empty_levels(int width, int height, float unit) {
  std::vector<PremultipliedImage> levels;
  levels.emplace_back(width, height, unit);
  while (width > 2 || height > 2) {
    width = (width + 1) / 2;
    height = (height + 1) / 2;
    levels.emplace_back(width, height, unit);
  }
  return levels;
}

}  // namespace

std::vector<PremultipliedImage> make_levels(int width, int height, std::span<const Eigen::Vector4f> texels) {
  std::vector<PremultipliedImage> levels = empty_levels(width, height, unit_for(texels));
  encode(texels, levels.front());
  FloatTexels level, next;
  std::span<const Eigen::Vector4f> finer = texels;
  for (std::size_t i = 1; i < levels.size(); ++i) {
    half_size(finer, levels[i - 1].width(), levels[i - 1].height(), next);
    std::swap(level, next);
    finer = level.texels;
    encode(finer, levels[i]);
  }
  return levels;
}

// ---- one frame ----

namespace {

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

// Where each level-0 pixel of an ideal pinhole lies in the picture as taken, camera pixels. The same for every frame.
struct TakenPositions {
  int width = 0;  // level-0 pixels
  int height = 0;
  std::vector<float> u, v;

  TakenPositions(const CameraModel& camera, double scale)
      : width(static_cast<int>(camera.width * scale)), height(static_cast<int>(camera.height * scale)) {
    u.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    v.resize(u.size());
    tbb::parallel_for(0, height, [&](int y) {
      for (int x = 0; x < width; ++x) {
        const Eigen::Vector2d ideal((x + 0.5) / scale, (y + 0.5) / scale);
        const Eigen::Vector3d ray((ideal.x() - camera.cx()) / camera.fx(), (ideal.y() - camera.cy()) / camera.fy(), 1);
        const Eigen::Vector2d taken = camera.has_distortion() ? camera.project(ray) : ideal;
        u[index(x, y)] = static_cast<float>(taken.x());
        v[index(x, y)] = static_cast<float>(taken.y());
      }
    });
  }
  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  }
};

// What every frame shares.
struct Loader {
  const SessionReader& session;
  const ResponseCurve& response;
  const Calibration& calibration;
  const FieldViewOptions& options;
  double scale;
  TakenPositions taken;
};

// The part of the taken picture that a box of ideal pixels needs, level-0 pixels.
PixelBox taken_box(const Loader& l, const PixelBox& box) {
  float u0 = INFINITY, v0 = INFINITY, u1 = -INFINITY, v1 = -INFINITY;
  const auto include = [&](int x, int y) {
    const std::size_t i = l.taken.index(x, y);
    u0 = std::min(u0, l.taken.u[i]);
    u1 = std::max(u1, l.taken.u[i]);
    v0 = std::min(v0, l.taken.v[i]);
    v1 = std::max(v1, l.taken.v[i]);
  };
  for (int x = box.x0; x < box.x1; ++x)
    for (const int y : {box.y0, box.y1 - 1}) include(x, y);
  for (int y = box.y0; y < box.y1; ++y)
    for (const int x : {box.x0, box.x1 - 1}) include(x, y);
  const float s = static_cast<float>(l.scale);
  constexpr int margin = 2;  // an interpolation's neighbours, and edges that bulge between two pixels
  const auto column = [&](float u, int more) {
    return std::clamp(static_cast<int>(std::floor(u * s)) + more, 0, l.taken.width);
  };
  const auto row = [&](float v, int more) {
    return std::clamp(static_cast<int>(std::floor(v * s)) + more, 0, l.taken.height);
  };
  return {column(u0, -margin), row(v0, -margin), column(u1, margin + 1), row(v1, margin + 1)};
}

// Radiance of the taken picture in a box of level-0 pixels. Frames are decoded only where needed.
ImageF radiance_in(const Loader& l, const SessionFrame& frame, const PixelBox& box) {
  const PixelFormat& format = l.session.header().format;
  if (!l.options.full_resolution)
    return binned_radiance(l.session.read_frame(frame, {2 * box.y0, 2 * box.y1}), format, l.response, box);
  const ImageF all = demosaic(linearize(l.session.read_frame(frame), format, l.response), format.layout);
  ImageF out(box.width(), box.height(), all.channels);
  for (int y = 0; y < out.height; ++y)
    std::copy_n(&all.data[all.index(box.x0, box.y0 + y)], out.row(y).size(), out.row(y).data());
  return out;
}

// Bilinear; texel centres at +0.5; the edge's colour beyond it.
Eigen::Vector3f bilinear_rgb(const ImageF& image, float u, float v) {
  const float x = std::clamp(u - 0.5F, 0.0F, static_cast<float>(image.width - 1));
  const float y = std::clamp(v - 0.5F, 0.0F, static_cast<float>(image.height - 1));
  const int x0 = std::min(static_cast<int>(x), std::max(image.width - 2, 0));
  const int y0 = std::min(static_cast<int>(y), std::max(image.height - 2, 0));
  const int x1 = std::min(x0 + 1, image.width - 1), y1 = std::min(y0 + 1, image.height - 1);
  const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
  const auto pixel = [&](int at_x, int at_y) -> Eigen::Vector3f {
    const float* p = &image.data[image.index(at_x, at_y)];
    return image.channels == 1 ? Eigen::Vector3f::Constant(p[0]) : Eigen::Vector3f(p[0], p[1], p[2]);
  };
  return (pixel(x0, y0) * (1 - fx) + pixel(x1, y0) * fx) * (1 - fy) +
         (pixel(x0, y1) * (1 - fx) + pixel(x1, y1) * fx) * fy;
}

std::vector<PremultipliedImage> levels_of(const Loader& l, const SessionFrame& frame, const MirrorPose& pose,
                                          const PixelBox& box) {
  const PixelBox source = taken_box(l, box);
  const ImageF radiance = radiance_in(l, frame, source);
  const ViewBorder border(l.calibration.camera, l.session.header().target, pose.cam_from_mirror, l.options.border,
                          l.scale);
  const float gain = static_cast<float>(1 / l.session.header().mirror_reflectance);
  const float scale = static_cast<float>(l.scale);
  const std::size_t width = static_cast<std::size_t>(box.width());
  std::vector<float> weights(width);
  std::vector<Eigen::Vector4f> texels;
  texels.reserve(width * static_cast<std::size_t>(box.height()));
  for (int y = box.y0; y < box.y1; ++y) {
    const std::size_t first = l.taken.index(box.x0, y);
    const std::span<const float> u(&l.taken.u[first], width), v(&l.taken.v[first], width);
    border.weigh_row(box.x0, y, u, v, weights);
    for (std::size_t x = 0; x < width; ++x) {
      Eigen::Vector4f texel = Eigen::Vector4f::Zero();
      if (weights[x] > 0)
        texel << gain * weights[x] *
                     bilinear_rgb(radiance, u[x] * scale - static_cast<float>(source.x0),
                                  v[x] * scale - static_cast<float>(source.y0)),
            weights[x];
      texels.push_back(texel);
    }
  }
  return make_levels(box.width(), box.height(), texels);
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

// Everyone gets the levels that others made: those of view i are made by rank i mod size.
void share_levels(const Team& team, std::span<const PixelBox> boxes, std::span<FieldView> views) {
  if (team.size() == 1) return;
  const auto maker = [&](std::size_t i) { return i % team.size(); };
  std::vector<float> units(views.size(), 0);
  std::vector<Team::Share> shares;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (!views[i].levels.empty()) units[i] = views[i].levels.front().unit();
    shares.push_back({std::as_writable_bytes(std::span(&units[i], 1)), maker(i)});
  }
  team.share(shares);
  constexpr std::size_t views_at_once = 64;
  for (std::size_t begin = 0; begin < views.size(); begin += views_at_once) {
    shares.clear();
    for (std::size_t i = begin; i < std::min(begin + views_at_once, views.size()); ++i) {
      if (boxes[i].empty()) continue;
      if (!team.has(i)) views[i].levels = empty_levels(boxes[i].width(), boxes[i].height(), units[i]);
      for (PremultipliedImage& level : views[i].levels)
        shares.push_back({std::as_writable_bytes(level.texels()), maker(i)});
    }
    team.share(shares);
  }
}

}  // namespace

std::vector<FieldView> load_field_views(const SessionReader& session, const ResponseCurve& response,
                                        const Calibration& calibration, const Team& team, const Progress& progress,
                                        const FieldViewOptions& options) {
  const std::string source = (session.folder() / "calibration.json").string();
  if (!calibration.cam_from_world)
    throw InputError(source, "cam_from_world",
                     "is missing: import a scene picture and world.json, then calibrate again");
  const std::vector<SessionFrame> frames = session.frames(FrameRole::mirror);
  if (frames.size() != calibration.frames.size())
    throw InputError(source, "frames", "does not match the session's frames: calibrate again");
  // Binning a mosaic's cells needs no demosaicing; other formats bin as well, for the same scale everywhere.
  const double scale = options.full_resolution ? 1.0 : 0.5;
  const Loader loader{session, response, calibration, options, scale, TakenPositions(calibration.camera, scale)};
  std::vector<FieldView> loaded(frames.size());
  std::vector<PixelBox> boxes(frames.size());
  std::atomic<std::size_t> done = 0;
  std::mutex reporting;
  tbb::parallel_for(std::size_t{0}, frames.size(), [&](std::size_t i) {
    const MirrorPose& pose = calibration.frames[i];
    const auto virtual_view =
        pose.used ? mirror_view(pose.cam_from_mirror, session.header().target, calibration.camera) : std::nullopt;
    if (virtual_view)
      boxes[i] = opening_box(virtual_view->opening_in_img, scale, loader.taken.width, loader.taken.height);
    if (!boxes[i].empty()) {
      loaded[i].frame = i;
      set_geometry(loaded[i], calibration, boxes[i], *virtual_view, scale);
      if (team.has(i)) loaded[i].levels = levels_of(loader, frames[i], pose, boxes[i]);
    }
    const std::size_t finished = ++done;
    const std::lock_guard lock(reporting);
    report_progress(progress, "linearizing views", static_cast<double>(finished) / static_cast<double>(frames.size()));
  });
  share_levels(team, boxes, loaded);
  std::erase_if(loaded, [](const FieldView& v) { return v.levels.empty(); });
  if (loaded.empty()) throw InputError(source, "frames", "holds no usable mirror pose: look at why_not of each frame");
  return loaded;
}

}  // namespace mf
