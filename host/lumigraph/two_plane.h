// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/progress.h"
#include "common/rigid3.h"
#include "host/io/view.h"
#include "host/lumigraph/frame_renderer.h"

namespace mf {

// The two-plane parameterization of a light field (Levoy, Hanrahan 1996; Gortler et al. 1996): a ray is where it
// crosses the uv plane, on which cameras stand in a regular grid, and the st plane, a window that all of them look
// through. Every picture is of that window, so that a pixel is the same point of the st plane in all of them.
//
// The uv frame: x right, y down, z from the uv plane (z = 0) to the st plane (z = st_distance_m), metres. A camera at
// (u, v, 0) is a pinhole off its axis: with s pixels a metre of the window, whose corner is (x₀, y₀),
//   f = s · st_distance_m,   c_x = s_x · (u − x₀),   c_y = s_y · (v − y₀)
struct TwoPlane {
  Rigid3 world_from_uv;
  std::array<int, 2> cameras{8, 8};                       // columns along x, rows along y; ≥ 1
  Eigen::Vector2d uv_size_m = Eigen::Vector2d::Ones();    // from the first to the last camera, about the origin
  double st_distance_m = 1;                               // > 0
  Eigen::Vector2d st_centre_m = Eigen::Vector2d::Zero();  // of the window, x and y
  Eigen::Vector2d st_size_m = Eigen::Vector2d::Ones();    // > 0
  std::array<int, 2> size_px{512, 512};                   // of each picture; 2 to 8192

  // What is wrong, in words that name the field; nothing when all is well.
  [[nodiscard]] std::optional<std::string> validate() const;
};

// The camera of a column and a row.
[[nodiscard]] View grid_view(const TwoPlane&, int column, int row);

// Planes that fit a lumigraph: uv through the mean of the photos' centres, square to their mean direction of sight and
// upright as they are; as large as the middle four fifths of the centres reach; st where the mean line of sight meets
// the proxy (or at `st_distance_m`), its window as large as the median photo's field of view there and as finely
// sampled as it; larger where photos look apart from each other. Throws InputError when the photos look all around or
// the proxy is not met: give a layout then.
[[nodiscard]] TwoPlane fitted_two_plane(const Lumigraph&, const PhotoSet&, std::array<int, 2> cameras,
                                        std::optional<double> st_distance_m);

// The layout as JSON: the fields of TwoPlane by name. Throws InputError naming `file` and the field.
[[nodiscard]] nlohmann::json to_json(const TwoPlane&);
[[nodiscard]] TwoPlane two_plane_from_json(const nlohmann::json&, const std::string& file);

struct TwoPlaneSummary {
  int pictures = 0;
  double covered = 0;  // share of all pixels that the photos show
};

// Renders every picture of the grid into `folder`, which is made: VV_UU.png or .exr (row, column), VV_UU_mask.png where
// a picture is not covered all over, two_plane.json (the layout), and transforms.json, last, which names them all.
// Throws InputError naming the file, or when no picture shows anything.
TwoPlaneSummary write_two_plane(const std::filesystem::path& folder, const FrameRenderer&, const TwoPlane&,
                                const LumigraphOptions&, const Progress&);

}  // namespace mf
