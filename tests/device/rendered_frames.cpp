// SPDX-License-Identifier: Apache-2.0
#include "tests/device/rendered_frames.h"

#include <algorithm>
#include <cmath>

#include "hw-sim/desk_rig.h"
#include "hw-sim/mirror_plate.h"
#include "hw-sim/motion.h"
#include "hw-sim/sensor.h"
#include "hw-sim/tracer.h"

namespace mf::test {

RenderedViews rendered_views(int size, int count, int samples) {
  RenderedViews out;
  const sim::Scene scene = sim::desk_scene(1);
  const sim::MirrorPlate plate(sim::desk_mirror(), sim::mirror_reflectance);
  const sim::Tracer tracer(scene, &plate);
  out.camera = sim::desk_camera(size);
  out.mirror = plate.target();
  out.world = scene.world;
  out.cam_from_world = sim::desk_cam_from_world(0);
  const sim::MotionInput input{out.cam_from_world.inverse().translation, scene.lamp.centre_in_world.cast<double>(),
                               plate.half_size_m()};
  constexpr int of_motion = 200;
  const std::vector<Rigid3> poses = sim::wave_mirror(input, of_motion, 1);
  for (int i = 0; i < count; ++i) {
    // Spread over the motion's upper half: lower down, tags graze and leave the picture.
    const Rigid3& pose = poses[static_cast<std::size_t>(5 + i * 60 / count)];
    const auto seed = static_cast<std::uint64_t>(i) + 1;
    out.radiance.push_back(
        sim::render(tracer, {out.camera, out.cam_from_world, pose, sim::whole(out.camera), samples, seed, {}}));
    out.cam_from_mirror.push_back(out.cam_from_world * pose);
  }
  return out;
}

RenderedFrames exposed(const RenderedViews& views, const PixelFormat& format, double knee) {
  constexpr double exposure_s = 0.01, brightest = 800;
  RenderedFrames out{views, {}, format, {}};
  sim::Sensor sensor;
  sensor.format = format;
  const double black_level = format.level_count() / 64.0;
  out.response = sensor.response =
      linlog_response(format.bits, black_level, knee * exposure_s, brightest * exposure_s, format.colour_channels());
  for (const ImageF& radiance : views.radiance) {
    CameraFrame frame;
    frame.arrival.device_frame = static_cast<std::int64_t>(out.frames.size()) + 1;
    frame.codes = sensor.expose(radiance, exposure_s, sim::whole(views.camera),
                                static_cast<std::uint64_t>(frame.arrival.device_frame));
    out.frames.push_back(std::move(frame));
  }
  return out;
}

namespace {

using Corners = std::array<Eigen::Vector2d, 4>;

std::optional<Corners> true_corners(const RenderedViews& rendered, std::size_t frame, int id) {
  Corners out;
  if (const PlanarTag* tag = rendered.mirror.find(id)) {
    const auto corners = tag->corners_m();
    for (std::size_t k = 0; k < 4; ++k)
      out[k] =
          rendered.camera.project(rendered.cam_from_mirror[frame] * Eigen::Vector3d(corners[k].x(), corners[k].y(), 0));
    return out;
  }
  if (const WorldTag* tag = rendered.world.find(id)) {
    const auto corners = tag->corners_in_world();
    for (std::size_t k = 0; k < 4; ++k) out[k] = rendered.camera.project(rendered.cam_from_world * corners[k]);
    return out;
  }
  return std::nullopt;
}

}  // namespace

void add_errors(const RenderedViews& rendered, std::size_t frame, const std::vector<TagDetection>& tags,
                CornerErrors& sum) {
  double squares = sum.rms_px * sum.rms_px * sum.corners;
  for (const TagDetection& tag : tags) {
    const std::optional<Corners> truth = true_corners(rendered, frame, tag.id);
    double worst = 0;
    for (std::size_t k = 0; truth && k < 4; ++k) worst = std::max(worst, ((*truth)[k] - tag.corners_px[k]).norm());
    if (!truth || worst > 3) {
      ++sum.false_tags;
      continue;
    }
    ++sum.tags;
    for (std::size_t k = 0; k < 4; ++k) squares += ((*truth)[k] - tag.corners_px[k]).squaredNorm();
    sum.corners += 4;
  }
  for (const PlanarTag& tag : rendered.mirror.tags) {
    const Corners corners = *true_corners(rendered, frame, tag.id);
    sum.tags_in_sight += std::all_of(corners.begin(), corners.end(), [&](const Eigen::Vector2d& c) {
      constexpr double border_px = 12;
      return c.minCoeff() > border_px && c.maxCoeff() < rendered.camera.width - border_px;
    });
  }
  sum.rms_px = sum.corners > 0 ? std::sqrt(squares / sum.corners) : 0;
}

}  // namespace mf::test
