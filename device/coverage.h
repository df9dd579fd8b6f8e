// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/image.h"
#include "common/mirror_target.h"
#include "common/rigid3.h"
#include "device/direction_grid.h"
#include "device/mirror_reach.h"
#include "device/radiance_map.h"
#include "device/rig_status.h"

namespace mf {

// The light-field plane: a rectangle of the world's z = 0, along its axes.
struct LightPlane {
  Eigen::Vector2d centre_in_world = Eigen::Vector2d::Zero();
  Eigen::Vector2d size_m = Eigen::Vector2d(0.4, 0.4);  // > 0
};
// The rectangle between the world's tags, half a tag inside of their middles; 0.4 × 0.4 m about their mean where they
// span less than 0.1 m.
[[nodiscard]] LightPlane plane_between(const WorldTarget&);

struct CoverageOptions {
  LightPlane plane;
  int cells = 6;          // along each edge of the plane, 1 to 16
  double patch_deg = 8;   // edge of a patch of directions, 2 to 30; each is 2 × 2 directions
  double reach = 0.3;     // > 0, of the plane's shorter edge: how far the view of a direction of mean radiance holds
  double bright = 4;      // > 1, times the mean radiance: from here on a cell wants two views
  double done_at = 0.95;  // 0 to 1; share of the light
  double least_step_m = 0.012;  // ≥ 0; of the virtual camera, for a view to be a new one

  // What is wrong, or nothing.
  [[nodiscard]] std::optional<std::string> validate() const;
};

// What of the light that arrives at the plane has been seen: a map over cells i of the plane × directions j of the
// hemisphere. A posed frame saw, through every point of the mirror's opening, the ray from the virtual centre through
// that point; it crosses the plane in a cell, in a direction (DESIGN of the light field: it is the light that arrives
// there from there). Each frame counts once for every (i, j) that a ray of it met.
//
//   w_ij = L_ij Ω_j                            its share of the light: radiance times projected solid angle
//   L̄    = Σ w_ij / Σ Ω_j                      the mean radiance, as the plane feels it
//   ρ_ij = reach · L̄ / L_ij                    how near to the cell a view must pass
//   N_ij = 1, or 2 where L_ij ≥ bright · L̄     how many views it takes: a lamp's only one could be blurred
//   c_ij = min(1, n_ij / N_ij)                 n_ij: views of direction j that crossed the plane within ρ_ij of cell i
//
//   covered = Σ w_ij c_ij / Σ w_ij,   done when that is done_at (and again not when it falls 2 % below)
//
// Why ρ: a ray that passes beside the point answers for it with an error that grows with the distance and with the
// light it carries; so twice the radiance asks for half the distance. A lamp must be seen from every cell, a dark wall
// once from anywhere. Only what a mirror can show counts (MirrorReach::showing); the rest cannot be captured.
//
// L_ij is RadianceMap's: it knows what was seen, and takes what was not for as bright as the mean of what was: an
// unseen direction may hold a lamp. Radiance is relative: exposure and response must not change in a recording.
class Coverage {
 public:
  // Throws InputError for options that are wrong. Takes some 50 ms: it tries where the mirror can be held.
  Coverage(const CoverageOptions&, const MirrorReach&);

  // One posed frame, with its linear luminance (FrameLevels::luminance) of frame pixels / reduction. Some 0.2 ms.
  void add(const Rigid3& cam_from_mirror, const ImageF& luminance, int reduction);

  // Without advice (Guidance gives it). Patches that the mirror cannot show are left out. Some 1 ms after a new frame.
  [[nodiscard]] CoverageStatus status();

  [[nodiscard]] std::int64_t views() const { return views_; }  // that counted
  [[nodiscard]] const MirrorReach& reach() const { return reach_; }
  [[nodiscard]] const DirectionGrid& directions() const { return grid_; }
  [[nodiscard]] int cell_count() const { return options_.cells * options_.cells; }
  [[nodiscard]] Eigen::Vector3d cell_centre(int cell) const;  // in the world

  // What a view of patch `patch` through cell `cell` would add to `covered` at most; 0 where the mirror cannot show it.
  [[nodiscard]] double wanted(int patch, int cell);
  // What the mirror, held like this one after the other, would add to `covered`, about.
  [[nodiscard]] double gain(std::span<const Rigid3> world_from_mirror);
  // Can the mirror show what arrives in the cell from the patch?
  [[nodiscard]] bool reachable(int patch, int cell) const { return reachable_[pair_of(patch, cell)]; }

 private:
  struct RaySeen {
    int direction = 0;
    bool on_rim = false;       // of the opening: a pixel of a reduced picture is half paper there
    int cell = -1;             // −1: beside the plane
    Eigen::Vector3d on_plane;  // from the plane's centre
    Eigen::Vector3d unit;
    Eigen::Vector3d on_mirror;  // in the world
  };
  // The rays through a grid of points in the opening, those that come from above.
  void cast(const Rigid3& world_from_mirror, int columns, int rows);
  [[nodiscard]] std::size_t pair_of(int direction, int cell) const {
    return static_cast<std::size_t>(direction) * static_cast<std::size_t>(cell_count()) +
           static_cast<std::size_t>(cell);
  }
  [[nodiscard]] Eigen::Vector3d cell_in_plane(int cell) const;  // from the plane's centre
  [[nodiscard]] std::span<const int> cells_within(int cell, double near_m) const;
  void find_places();
  void evaluate();
  void evaluate_direction(int direction, double mean_radiance, double light);
  void report_patches(double light);

  CoverageOptions options_;
  MirrorReach reach_;
  DirectionGrid grid_;
  RadianceMap radiance_;
  std::vector<bool> reachable_;               // by patch and cell
  std::vector<std::vector<int>> neighbours_;  // of a cell, itself first, nearest first
  std::vector<double> apart_m_;               // between two cells, by cell and cell
  std::vector<std::int32_t> places_;          // on the radiance map, by direction and cell
  double places_radius_m_ = 0;                // for which they hold
  std::vector<std::uint16_t> seen_;           // views, by direction and cell
  std::vector<std::uint32_t> stamp_;          // the last view (or question) that met a pair
  std::uint32_t now_ = 0;
  std::vector<RaySeen> rays_;  // of the last cast
  std::int64_t views_ = 0;
  std::optional<Eigen::Vector3d> last_centre_;

  bool stale_ = true;          // what follows is older than seen_
  std::vector<float> weight_;  // w_ij
  std::vector<float> covered_ij_;
  std::vector<float> own_;     // missing that only a view through this very cell mends, by direction and cell
  std::vector<float> wide_;    // missing in all cells that a view through this one would mend
  std::vector<float> widest_;  // gain()'s own, by direction
  std::vector<float> wanted_;  // by patch and cell
  std::vector<CoveragePatch> patches_;
  double covered_ = 0;
  bool done_ = false;
};

}  // namespace mf
