// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <tbb/enumerable_thread_specific.h>

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "host/lumigraph/lumigraph.h"
#include "host/lumigraph/ray_answers.h"
#include "host/lumigraph/view_bounds.h"

namespace mf {

// How ranked photos answer for some rays, and which of them speak: a ray a column.
struct ChosenViews {
  std::span<const std::int32_t> pixel;  // the ray's pixel, its index in the picture; −1: not this one
  int k = 0;
  std::span<const float> weight;            // k rows: sum to 1, or all 0: the point is in no photo's picture
  std::span<const std::int32_t> candidate;  // k rows: who has that weight; −1: nobody
  std::span<const std::uint32_t> view;      // of each candidate
  std::span<const float> x, y, lod;         // a row a candidate: see RayAnswers
  std::span<const float> sight;             // a row a candidate: RayAnswers' weight
};
using TakeChosen = std::function<void(const ChosenViews&)>;

inline constexpr int tile_side = 64;  // pixels

// Rays of the new view, one value each, and what they meet: see RayBundle.
struct TileRays {
  std::vector<float> dx, dy, dz, depth, nx, ny, nz;
  std::vector<std::int32_t> pixel;

  [[nodiscard]] std::size_t size() const { return pixel.size(); }
  void resize(std::size_t);
  // Repeats the last ray, for no pixel, until the rays from `first` on fill their lanes.
  void fill_lanes(std::size_t first);
  void copy(std::size_t from, const TileRays& source, std::size_t to);
  [[nodiscard]] RayBundle bundle(std::size_t first, std::size_t count, const WantedResolution&) const;
};

// One frame of a lumigraph: what all its tiles share.
struct TileFrame {
  const View& view;
  const Proxy& proxy;
  const LumigraphOptions& options;
  float depth_tolerance = 0;             // see VisibilityOptions
  std::span<const AnsweringView> views;  // every photo, for this frame's eye
  const ViewTable& speaking;             // those of them that may speak
  WantedResolution wanted{};
};

// What a ranking knows of a photo.
struct ToldOfPhoto {
  std::uint64_t ranking = 0;  // which one
  float least = 0;            // no ray gives the photo a smaller penalty; infinite: it is ranked
};

// The memory that a thread renders tiles with. It is worth keeping from frame to frame.
struct TileBuffers {
  TileRays rays;                                  // of the tile, bundle by bundle
  TileRays some;                                  // of a bundle to be, samples of the tile, or rays to rank again
  ViewTable near;                                 // the photos up to the tile's bound
  std::vector<float> least;                       // of a table's photos
  std::vector<float> of_part;                     // the same, for a part of the tile
  std::vector<std::uint32_t> heap;                // rows of the table, the least first
  std::vector<std::uint32_t> likely;              // photos that were among the best of the rays before
  std::uint64_t rankings = 0;                     // so many were started
  std::vector<ToldOfPhoto> told;                  // of each photo, by the last of them that looked at it
  std::vector<std::uint32_t> view;                // the photos that were ranked
  std::vector<std::uint8_t> is_best;              // each of those: among the best of a ray
  std::vector<float> x, y, lod, weight, penalty;  // their answers, a row each
  std::vector<float> least_penalty;               // see LeastPenalties
  std::vector<std::int32_t> least_candidate;
  std::vector<std::int32_t> pixel;  // see ChosenViews
  std::vector<float> chosen_weight;
};

class TilePool {
 public:
  // This thread's. No tile waits for others, so that a thread renders one at a time.
  [[nodiscard]] TileBuffers& local() { return buffers_.local(); }

 private:
  tbb::enumerable_thread_specific<TileBuffers> buffers_;
};

// Chooses the photos for the pixels of a tile.
//
// For the tile, and then for each bundle of 8 × 8 rays, it is told of all photos at once what penalty no ray undercuts
// (view_bounds.h); ranked are those that could yet be among the k + 1 best of a ray. Bundles look only at photos up to
// a bound, which some rays of the tile guess; where a ray's (k + 1)-th best is above the bound, the others follow,
// the likely ones first. So every ray gets what ranking all photos would have given it.
class TileRenderer {
 public:
  TileRenderer(const TileFrame&, TileBuffers&, const TakeChosen&);

  // The tile whose first pixel is (x0, y0). Pixels where the proxy is not are not handed on.
  void render(int x0, int y0);

 private:
  struct Bundle {  // rays [first, end), full lanes of them
    std::size_t first = 0;
    std::size_t end = 0;
    RaysBox box;
  };

  void shoot(int x0, int y0);
  void shoot_bundle(int x0, int y0, int x1, int y1);
  void add_bundle(std::size_t first);
  void bound_for_tile();
  void choose_for_tile();
  void choose(const Bundle&);
  void hand_on();

  // A ranking of photos for some rays: in `buffers_` and what follows here.
  void start_ranking(const RayBundle&);
  // `least`: no ray gives the photo a smaller penalty.
  void rank(std::uint32_t view, float least);
  void rank_all(const ViewTable&, const RaysBox&, float bound);
  void rank_beyond(const Bundle&);
  [[nodiscard]] RaysBox box_of_open(const Bundle&, float bound);
  void keep_best();
  RayBundle bundle_;
  LeastPenalties ranking_;
  PenaltyRange worst_;  // of each ray's (k + 1)-th best

  const TileFrame& frame_;
  TileBuffers& buffers_;
  const TakeChosen& take_;
  bool plain_camera_;
  Rigid3 world_from_cam_;
  Eigen::Matrix3f axes_;  // its rotation
  float bound_ = 0;       // of the tile: its near photos are those up to that
  std::vector<Bundle> bundles_;
};

}  // namespace mf
