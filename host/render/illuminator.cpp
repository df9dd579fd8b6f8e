// SPDX-License-Identifier: Apache-2.0
#include "host/render/illuminator.h"

#include "common/error.h"

namespace mf {

struct Illuminator::Gl {};

std::optional<Backend> parse_backend(std::string_view name) {
  if (name == "auto") return Backend::automatic;
  if (name == "gl") return Backend::gl;
  if (name == "cpu") return Backend::cpu;
  return std::nullopt;
}

Illuminator::Illuminator(Backend, const TriangleMesh&, const RayScene& scene) : scene_(&scene), description_("cpu") {}
Illuminator::Illuminator(Illuminator&&) noexcept = default;
Illuminator::~Illuminator() = default;

std::vector<Eigen::Vector3f> Illuminator::irradiance(std::span<const SurfacePoint> points, const LightSet& lights,
                                                     LightSum sum, const Progress& progress) {
  return irradiance_cpu(*scene_, points, lights, sum, progress);
}

}  // namespace mf
