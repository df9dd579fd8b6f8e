// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "host/lumigraph/lumigraph.h"
#include "host/lumigraph/ray_answers.h"

namespace mf {

// One frame of a lumigraph: what all its tiles share.
struct TileFrame {
  const View& view;
  const Proxy& proxy;
  const LumigraphOptions& options;
  float depth_tolerance = 0;                // see VisibilityOptions
  std::span<const AnsweringView> views;     // every photo, for this frame's eye
  std::span<const std::uint32_t> speaking;  // those that may speak
};

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

// Chooses the photos for the pixels of one tile after another. It holds the working memory: one a thread.
//
// Photos are ranked for the tile, then for each block of it. What is dropped for a region is a photo whose penalty is
// nowhere there below `bound`. A ray whose k + 1 best are not all below the bound is ranked again, among all photos that
// could be better than its (k + 1)-th: so every ray gets what ranking all photos would have given it.
class TileRenderer {
 public:
  TileRenderer(const TileFrame&, TakeChosen);

  // The tile whose first pixel is (x0, y0). Pixels where the proxy is not are not handed on.
  void render(int x0, int y0);

 private:
  struct Rays {  // one value a ray
    std::vector<float> dx, dy, dz, depth, nx, ny, nz;
    std::vector<std::int32_t> pixel;

    [[nodiscard]] std::size_t size() const { return pixel.size(); }
    void resize(std::size_t);
    void copy(std::size_t from, const Rays& source, std::size_t to);
    [[nodiscard]] RayBundle bundle(std::size_t first, std::size_t count, float focal2) const;
  };
  struct Candidate {
    float least = 0;  // no ray of the region gives it a smaller penalty
    std::uint32_t view = 0;
  };
  struct Candidates {
    std::vector<Candidate> views;  // rising by `least`, so that ranking can stop
    float bound = 0;               // no other photo has a smaller penalty at any ray of the region
  };
  struct Region {  // rays [first, end) of a tile's
    std::size_t first = 0;
    std::size_t end = 0;
  };

  void shoot(int x0, int y0);
  void shoot_block(int x0, int y0, int x1, int y1);
  // The candidates that the rays can give a penalty up to `below`, in order.
  void bound_from_below(const Rays&, const Region&, const Candidates& from, float below, Candidates& to);
  void narrow(const Candidates& from, const Region&, Candidates& to);
  void choose(const Rays&, const Region&, const Candidates&);
  void choose_again(const Rays&, float bound);
  void rank(const RayBundle&, const Candidates&);
  void hand_on(std::size_t rays, const Candidates&);

  const TileFrame& frame_;
  TakeChosen take_;
  float focal2_;
  bool plain_camera_;

  Rays rays_;                    // of the tile, block by block
  std::vector<Region> blocks_;   // of the rays
  Candidates all_;
  Candidates of_tile_, of_block_, again_;
  std::vector<float> answers_x_, answers_y_, answers_lod_, answers_weight_, answers_penalty_;  // a row a candidate
  std::vector<float> least_penalty_;
  std::vector<std::int32_t> least_candidate_;
  std::vector<std::int32_t> pixel_;
  std::vector<float> weight_, sight_, x_, y_, lod_;
  std::vector<std::uint32_t> view_;
};

}  // namespace mf
