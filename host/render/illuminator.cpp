// SPDX-License-Identifier: Apache-2.0
#include "host/render/illuminator.h"

#include "common/error.h"
#include "host/gl/egl_context.h"
#include "host/render/irradiance_gl.h"

namespace mf {

struct Illuminator::Gl {
  EglContext context;
  GlIrradiance irradiance;

  Gl(EglContext&& opened, const TriangleMesh& mesh) : context(std::move(opened)), irradiance(context, mesh, {}) {}
};

std::optional<Backend> parse_backend(std::string_view name) {
  if (name == "auto") return Backend::automatic;
  if (name == "gl") return Backend::gl;
  if (name == "cpu") return Backend::cpu;
  return std::nullopt;
}

Illuminator::Illuminator(Backend backend, const TriangleMesh& mesh, const RayScene& scene)
    : scene_(&scene), description_("cpu") {
  if (backend == Backend::cpu) return;
  auto opened = EglContext::open();
  if (const auto* missing = std::get_if<GlUnavailable>(&opened)) {
    if (backend == Backend::automatic) return;
    throw InputError("OpenGL", "--backend gl",
                     "is not to be had here: " + missing->reason + "; use --backend cpu, the pictures are the same");
  }
  auto& context = std::get<EglContext>(opened);
  // Embree is faster than a rasterizer that runs on the same processor.
  if (backend == Backend::automatic && context.is_software()) return;
  description_ = "gl (" + context.renderer() + ")";
  gl_ = std::make_unique<Gl>(std::move(context), mesh);
}
Illuminator::Illuminator(Illuminator&&) noexcept = default;
Illuminator::~Illuminator() = default;

std::vector<Eigen::Vector3f> Illuminator::irradiance(std::span<const SurfacePoint> points, const LightSet& lights,
                                                     LightSum sum, const Progress& progress) {
  return gl_ ? gl_->irradiance.irradiance(points, lights, sum, progress)
             : irradiance_cpu(*scene_, points, lights, sum, progress);
}

}  // namespace mf
