// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "host/gl/backend.h"
#include "host/render/irradiance.h"

namespace mf {

// One mesh, lit by whichever back end was chosen. `mesh` and `scene` are the same surface and outlive it.
class Illuminator {
 public:
  // Throws InputError when gl is asked for and OpenGL 4.3 is not to be had.
  Illuminator(Backend, const TriangleMesh&, const RayScene&);
  Illuminator(Illuminator&&) noexcept;
  ~Illuminator();

  // See irradiance_cpu: both back ends compute the same sum.
  [[nodiscard]] std::vector<Eigen::Vector3f> irradiance(std::span<const SurfacePoint>, const LightSet&, LightSum,
                                                        const Progress& = {});

  // "cpu", or "gl" with the renderer's name.
  [[nodiscard]] const std::string& description() const { return description_; }

 private:
  struct Gl;
  const RayScene* scene_;
  std::unique_ptr<Gl> gl_;  // empty: cpu
  std::string description_;
};

}  // namespace mf
