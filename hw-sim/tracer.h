// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "common/camera_model.h"
#include "common/image.h"
#include "common/rigid3.h"
#include "hw-sim/mirror_plate.h"
#include "hw-sim/sampler.h"
#include "hw-sim/scene.h"

namespace mf::sim {

// A path tracer over Embree (Wald et al. 2014): Lambertian surfaces, one globe lamp sampled by its solid angle (Shirley
// et al. 1996), distant surroundings, and a perfect planar mirror. Light is followed over two diffuse surfaces;
// what a mirror throws back onto a surface from the lamp (the caustic) is left out.
class Tracer {
 public:
  // Both outlive the tracer. `plate` may be null: no mirror in the scene.
  Tracer(const Scene& scene, const MirrorPlate* plate);
  Tracer(Tracer&&) noexcept;
  ~Tracer();

  // Radiance that arrives at ray.origin from ray.direction: one random sample. Safe to call from many threads.
  // `mirror`: where the plate is; nothing when it is not there.
  [[nodiscard]] Rgb radiance(const Ray& ray, const std::optional<MirrorPlate::Placement>& mirror, Sampler&) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Pixels [x0, x1) × [y0, y1).
struct Region {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

struct Shot {
  CameraModel camera;
  Rigid3 cam_from_world;
  std::optional<Rigid3> world_from_mirror;
  Region region;    // only these pixels are traced, the rest is black
  int samples = 4;  // per pixel, spread over its square
  std::uint64_t seed = 0;
  std::vector<Rigid3> later;  // world_from_mirror at equal steps through the exposure: motion blur
};

// Three channels, linear radiance. Uses every core; the picture depends on nothing but its arguments.
[[nodiscard]] ImageF render(const Tracer&, const Shot&);

// What arrives at a point from everywhere, as a lat-long picture: centre +Y, a quarter to the left −X, top +Z (world).
[[nodiscard]] ImageF render_probe(const Tracer&, const Eigen::Vector3f& at_in_world, int width, int samples,
                                  std::uint64_t seed);

}  // namespace mf::sim
