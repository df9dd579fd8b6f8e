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

namespace mf {

// The photos that speak for some rays: k of them each, by rows, a ray a column.
struct ChosenViews {
  std::span<const std::int32_t> pixel;  // the ray's pixel, its index in the picture; −1: not this one
  std::size_t row_length = 0;           // ≥ pixel.size()
  int k = 0;
  std::span<const float> weight;        // sums to 1 over the k, or is 0 in all: the point is in no photo's picture
  std::span<const float> sight;         // of each ray alone, 0…1: how well the photo that shows it best shows it
  std::span<const std::uint32_t> view;  // the rest is meaningless where the weight is 0
  std::span<const float> x, y, lod;     // where the photo shows the point, photo pixels, and how finely: see RayAnswers
};
using TakeChosen = std::function<void(const ChosenViews&)>;

inline constexpr int tile_side = 64;  // pixels

// See RayBundle.
struct WantedResolution {
  float focal2 = 1;
  float beyond = 0;
};

// Rays of the new view, one value each, and what they meet: see RayBundle.
struct TileRays {
  std::vector<float> dx, dy, dz, depth, nx, ny, nz;
  std::vector<std::int32_t> pixel;

  [[nodiscard]] std::size_t size() const { return pixel.size(); }
  void resize(std::size_t);
  void copy(std::size_t from, const TileRays& source, std::size_t to);
  [[nodiscard]] RayBundle bundle(std::size_t first, std::size_t count, const WantedResolution&) const;
};

struct CandidateView {
  float least = 0;  // no ray of the region gives the photo a smaller penalty
  std::uint32_t view = 0;
};
struct CandidateViews {
  std::vector<CandidateView> views;  // rising by `least`, so that ranking can stop
  float bound = 0;                   // no photo that is missing has a smaller penalty at any ray of the region
};

// One frame of a lumigraph: what all its tiles share.
struct TileFrame {
  const View& view;
  const Proxy& proxy;
  const LumigraphOptions& options;
  float depth_tolerance = 0;             // see VisibilityOptions
  std::span<const AnsweringView> views;  // every photo, for this frame's eye
  const CandidateViews& speaking;        // those that may speak, bounds 0 and infinite
  WantedResolution wanted{};
};

// The memory that a thread renders tiles with. It is worth keeping from frame to frame.
struct TileBuffers {
  TileRays rays;                                  // of the tile, block by block
  TileRays some;                                  // samples of a region, or rays that are ranked again
  std::vector<float> x, y, lod, weight, penalty;  // answers, a row a candidate
  std::vector<float> least_penalty;               // see LeastPenalties
  std::vector<std::int32_t> least_candidate;
  CandidateViews of_tile, of_block, again;
  std::vector<std::int32_t> pixel;  // see ChosenViews, as the rest
  std::vector<float> chosen_weight, chosen_sight, chosen_x, chosen_y, chosen_lod;
  std::vector<std::uint32_t> chosen_view;
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
// For the tile, and then for each block of it, photos are put in the order of the least penalty that any of its rays
// can give them; rays are ranked in that order until no photo that is left can be among any ray's k + 1 best. Blocks
// look only at photos up to the tile's bound, which some rays of it guess; a ray whose (k + 1)-th best is above the
// bound is ranked again, up to that. So every ray gets what ranking all photos would have given it.
class TileRenderer {
 public:
  TileRenderer(const TileFrame&, TileBuffers&, const TakeChosen&);

  // The tile whose first pixel is (x0, y0). Pixels where the proxy is not are not handed on.
  void render(int x0, int y0);

 private:
  struct Region {  // rays [first, end)
    std::size_t first = 0;
    std::size_t end = 0;
  };

  void shoot(int x0, int y0);
  void shoot_block(int x0, int y0, int x1, int y1);
  // The candidates that the rays can give a penalty up to `below`, in order. `from` must be of a region around them.
  void bound_from_below(const TileRays&, const Region&, const CandidateViews& from, float below, CandidateViews& to);
  void rank_for_tile();
  void choose(const TileRays&, const Region&, const CandidateViews&);
  void choose_again(float bound);
  void rank(const RayBundle&, const CandidateViews&);
  void hand_on(std::size_t rays, const CandidateViews&);

  const TileFrame& frame_;
  TileBuffers& buffers_;
  const TakeChosen& take_;
  bool plain_camera_;
  std::vector<Region> blocks_;  // of the tile's rays
};

}  // namespace mf
