// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "host/lumigraph/lumigraph.h"
#include "host/lumigraph/photo_pyramid.h"

namespace mf::bench {

// The renderer of Buehler et al. 2001, §4.2–4.3, to compare with: the blending field is evaluated at a grid's points,
// at the photos' projected centres and at the ends of the proxy's edges; these are triangulated (Delaunay; an edge of
// the proxy that the triangulation does not hold gets points until it does), and every triangle is drawn once for each
// photo that speaks at one of its corners, with projective texture and weights that are linear over the picture.
struct VertexField {
  struct Edge {
    Eigen::Vector3d from, to;  // world
  };
  const std::vector<Lumigraph::Source>& sources;
  const std::vector<PhotoPyramid<std::uint8_t>>& photos;
  const Proxy& proxy;  // one that hides nothing of itself
  std::vector<Edge> edges{};
  int grid_px = 32;
};

[[nodiscard]] ImageU8 render_by_vertices(const VertexField&, const View&, const LumigraphOptions&);

}  // namespace mf::bench
