// SPDX-License-Identifier: Apache-2.0
#include "hw-sim/take.h"

#include <algorithm>

#include "common/check.h"
#include "common/error.h"

namespace mf::sim {

namespace {

constexpr int moments = 8;  // of the mirror in one exposure

Rigid3 between(const Rigid3& a, const Rigid3& b, double share) {
  return {a.rotation.slerp(share, b.rotation), (1 - share) * a.translation + share * b.translation};
}

// The mirror's places while the shutter is open, about the frame's own moment.
std::vector<Rigid3> places(const std::vector<Rigid3>& poses, std::size_t frame, double blur) {
  std::vector<Rigid3> list;
  for (int i = 0; i < moments; ++i) {
    const double at = blur * ((i + 0.5) / moments - 0.5);
    const std::size_t other = at < 0 ? std::max<std::size_t>(frame, 1) - 1 : std::min(frame + 1, poses.size() - 1);
    list.push_back(between(poses[frame], poses[other], std::abs(at)));
  }
  return list;
}

Region united(const Region& a, const Region& b) {
  return {std::min(a.x0, b.x0), std::min(a.y0, b.y0), std::max(a.x1, b.x1), std::max(a.y1, b.y1)};
}

ImageF crop(const ImageF& picture, const Region& r) {
  ImageF part(r.x1 - r.x0, r.y1 - r.y0, 1);
  for (int y = r.y0; y < r.y1; ++y) std::copy_n(&picture.at(r.x0, y), part.width, &part.at(0, y - r.y0));
  return part;
}

}  // namespace

std::optional<std::string> TakeOptions::validate() const {
  if (frames < 10 || frames > 99999) return "frames must be 10 to 99999";
  if (samples < 1 || scene_samples < 1) return "samples must be at least 1";
  if (!(blur >= 0 && blur <= 1)) return "blur must lie from 0 to 1";
  return std::nullopt;
}

Take::Take(const DeskRig& rig, const TakeOptions& options, const SensorTraits& traits, const Progress& progress) {
  if (const auto problem = options.validate()) throw InputError("take", "", *problem);
  scene_ = render(rig.tracer, rig.shot(std::nullopt, whole(rig.camera), options.scene_samples,
                                       stream_key(options.seed, Stream::plate)));
  still_ = sensor_mosaic(scene_, traits);
  const Eigen::Vector3d middle(0, 0.02, 0);
  const Rigid3 facing_lamp = mirror_pose(rig.motion, middle, (rig.motion.lamp_in_world - middle).normalized(), 0);
  lamp_ =
      trace(rig,
            rig.shot(facing_lamp, around_plate(rig.camera, rig.cam_from_world * facing_lamp, rig.plate.half_size_m()),
                     options.samples, stream_key(options.seed, Stream::sweep)),
            traits);
  poses_ = wave_mirror(rig.motion, options.frames, options.seed);
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    const std::vector<Rigid3> mirrors = options.blur > 0 ? places(poses_, i, options.blur) : std::vector{poses_[i]};
    Region region = around_plate(rig.camera, rig.cam_from_world * mirrors.front(), rig.plate.half_size_m());
    region = united(region, around_plate(rig.camera, rig.cam_from_world * mirrors.back(), rig.plate.half_size_m()));
    Shot shot = rig.shot(mirrors.front(), region, options.samples,
                         stream_key(options.seed, Stream::frame, static_cast<int>(i)));
    shot.later.assign(mirrors.begin() + 1, mirrors.end());
    patches_.push_back(trace(rig, shot, traits));
    report_progress(progress, "frames", (static_cast<double>(i) + 1) / static_cast<double>(poses_.size()));
  }
}

Take::Patch Take::trace(const DeskRig& rig, const Shot& shot, const SensorTraits& traits) {
  return {shot.region, crop(sensor_mosaic(render(rig.tracer, shot), traits), shot.region)};
}

void Take::light(int frame, ImageF& into) const {
  check(frame >= lamp_shown && frame < frames(), "the take has this frame");
  into = still_;
  if (frame == without_mirror) return;
  const Patch& patch = frame == lamp_shown ? lamp_ : patches_[static_cast<std::size_t>(frame)];
  for (int y = 0; y < patch.light.height; ++y)
    std::copy_n(&patch.light.at(0, y), patch.light.width, &into.at(patch.region.x0, patch.region.y0 + y));
}

}  // namespace mf::sim
