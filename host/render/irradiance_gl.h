// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "common/progress.h"
#include "host/gl/egl_context.h"
#include "host/io/mesh.h"
#include "host/render/irradiance.h"

namespace mf {

// irradiance_cpu's sum on OpenGL (Ihrke et al. 2008, §4.4): a shadow map for each direction, and the direction's tile
// as a skewed orthographic projective texture over the points.
//
// Directions go in batches: one layered draw fills a texture array of shadow maps, one pass over the points adds the
// whole batch in single precision, blending adds it to a single-precision target (half floats lose the last thousandth
// when thousands of directions add up; tiles are half floats, as the file has them). Shadow edges are as sharp as a
// texel of the map; elsewhere the sum is the CPU's.
class GlIrradiance {
 public:
  struct Options {
    int shadow_map_size = 512;  // texels a side over the mesh' extent; finer shadow edges, more to draw
  };
  // The context is current and outlives this.
  GlIrradiance(const EglContext&, const TriangleMesh&, const Options&);
  GlIrradiance(GlIrradiance&&) noexcept;
  ~GlIrradiance();

  [[nodiscard]] std::vector<Eigen::Vector3f> irradiance(std::span<const SurfacePoint>, const LightSet&, LightSum,
                                                        const Progress& = {});

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mf
