// SPDX-License-Identifier: Apache-2.0
#include "host/render/illuminator.h"

#include <utility>

#include "host/render/irradiance_gl.h"

namespace mf {

struct Illuminator::Gl {
  EglContext context;
  GlIrradiance irradiance;

  Gl(EglContext&& opened, const TriangleMesh& mesh) : context(std::move(opened)), irradiance(context, mesh, {}) {}
};

Illuminator::Illuminator(Backend backend, const TriangleMesh& mesh, const RayScene& scene) : scene_(&scene) {
  auto context = open_backend(backend);
  description_ = describe(context);
  if (context) gl_ = std::make_unique<Gl>(std::move(*context), mesh);
}
Illuminator::Illuminator(Illuminator&&) noexcept = default;
Illuminator::~Illuminator() = default;

std::vector<Eigen::Vector3f> Illuminator::irradiance(std::span<const SurfacePoint> points, const LightSet& lights,
                                                     LightSum sum, const Progress& progress) {
  return gl_ ? gl_->irradiance.irradiance(points, lights, sum, progress)
             : irradiance_cpu(*scene_, points, lights, sum, progress);
}

}  // namespace mf
