// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "common/camera_model.h"
#include "common/rigid3.h"
#include "hw-sim/mirror_plate.h"
#include "hw-sim/motion.h"
#include "hw-sim/tracer.h"

namespace mf::sim {

inline constexpr double mirror_reflectance = 0.92;

// What a random number is for: streams with the same seed must not meet.
enum class Stream : std::uint64_t { scene, frame, frame_noise, sweep, sweep_noise, plate, plate_noise, object, probe };
[[nodiscard]] std::uint64_t stream_key(std::uint64_t seed, Stream stream, int index = 0);

// The rig's camera: pinhole, 1.13 m from the world origin, looking down at it by 41°.
[[nodiscard]] CameraModel desk_camera(int size);
// Camera poses of the truth pictures; the first is the rig's own camera.
[[nodiscard]] Rigid3 desk_cam_from_world(int view);

[[nodiscard]] Region whole(const CameraModel&);
// The pixels about the plate, as a camera with a region of interest would read out: even edges, 8 px to spare.
[[nodiscard]] Region around_plate(const CameraModel&, const Rigid3& cam_from_mirror,
                                  const Eigen::Vector2d& half_size_m);

// The desk, the mirror, the camera above them, and the tracer that all pictures of them come from. Not to be moved: the
// tracer looks at its neighbours.
struct DeskRig {
  Scene scene;
  MirrorPlate plate{desk_mirror(), mirror_reflectance};
  Tracer tracer{scene, &plate};
  CameraModel camera;
  Rigid3 cam_from_world = desk_cam_from_world(0);
  MotionInput motion;

  // `panorama`: the distant surroundings; null: a hall with windows.
  DeskRig(int size, std::uint64_t seed, std::shared_ptr<const EnvironmentMap> panorama = nullptr);
  DeskRig(const DeskRig&) = delete;
  DeskRig& operator=(const DeskRig&) = delete;

  [[nodiscard]] Shot shot(const std::optional<Rigid3>& world_from_mirror, const Region& region, int samples,
                          std::uint64_t seed) const {
    return {camera, cam_from_world, world_from_mirror, region, samples, seed, {}};
  }
};

}  // namespace mf::sim
