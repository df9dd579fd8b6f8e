// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/just_in_time.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "common/check.h"
#include "host/light_field/emitter_blender.h"
#include "host/light_field/hole_filler.h"
#include "host/light_field/plane_tiles.h"
#include "host/light_field/tile_resampler.h"

namespace mf {

namespace {

// A preview's texels are no larger. The resampler looks for emitters at every fourth texel, and must not step over the
// glare beside one, which it takes to reach 12 cm.
constexpr float coarsest_texel_m = 0.05F;

constexpr int rough_guess_spacing = 4;  // texels from one guess to the next, where no view saw anything

int whole_blocks(float texels) {
  return block_side * std::max(1, static_cast<int>(std::ceil(texels / static_cast<float>(block_side))));
}

struct Rectangle {
  Eigen::Vector2f min_m, max_m;
};

// The part of [low, high] that [from, to] asks for, at least `least` wide.
void keep_inside(float low, float high, float least, float& from, float& to) {
  from = std::clamp(from, low, high - least);
  to = std::clamp(to, std::min(from + least, high), high);
}

Rectangle inside(const LightField& field, const TileRequest& request) {
  const Eigen::Vector2f low = field.plane.min_m.cast<float>(), high = field.plane.max_m.cast<float>();
  const Eigen::Vector2f texel = (high - low) / static_cast<float>(field.resolution);
  Rectangle r{request.min_m, request.max_m};
  for (int axis = 0; axis < 2; ++axis) keep_inside(low[axis], high[axis], texel[axis], r.min_m[axis], r.max_m[axis]);
  return r;
}

// An empty tile whose outermost texels' centres lie on the rectangle's sides: nothing within is extrapolated.
PlaneTile even_tile(const Rectangle& r, int texels) {
  const Eigen::Vector2f half = (r.max_m - r.min_m) / (2.F * static_cast<float>(texels - 1));
  return black_tile(r.min_m - half, r.max_m + half, texels, texels);
}

// One thread's working memory: a light field of few texels, whose rectangle is the request's.
class Worker {
 public:
  Worker(const std::vector<FieldView>& views, const LightField& focused, const ProxyVisibility& visibility,
         const EmitterBlender& emitters, const HoleFiller& filler, const PenaltyOptions& penalty,
         const JustInTimeOptions& options)
      : views_(views),
        focused_(focused),
        visibility_(visibility),
        emitters_(emitters),
        filler_(filler),
        penalty_(penalty),
        options_(options) {
    part_.directions = focused.directions;
    part_.surroundings = focused.surroundings;
    part_.surroundings.panorama = {};
  }

  PlaneTile fill(const TileRequest& request) {
    const Rectangle where = inside(focused_, request);
    part_.resolution = texels_for(where);
    PlaneTile tile = even_tile(where, part_.resolution);
    of_cell_ = tile;
    part_.plane = {focused_.plane.world_from_plane, tile.min_m.cast<double>(), tile.max_m.cast<double>()};
    TileResampler resampler(views_, part_, visibility_, emitters_, penalty_, options_.rough ? 0 : 1);
    float solid_angle = 0;
    for (const std::uint32_t cell : request.cells) solid_angle += part_.directions.solid_angles_sr[cell];
    for (const std::uint32_t cell : request.cells) {
      const float share = part_.directions.solid_angles_sr[cell] / solid_angle;
      resampler.fill(cell, of_cell_.texels.data());
      filler_.fill(cell, part_.plane, part_.resolution, of_cell_.texels.data(),
                   options_.rough ? rough_guess_spacing : 1);
      for (std::size_t t = 0; t < tile.texels.size(); ++t) tile.texels[t] += share * of_cell_.texels[t];
    }
    return tile;
  }

 private:
  // Along each side, in whole blocks of the resampler.
  [[nodiscard]] int texels_for(const Rectangle& r) const {
    const Eigen::Vector2f part = (r.max_m - r.min_m).cwiseQuotient(focused_.plane.size_m().cast<float>());
    const int as_field = whole_blocks(part.maxCoeff() * static_cast<float>(focused_.resolution));
    const int fewest = whole_blocks((r.max_m - r.min_m).maxCoeff() / coarsest_texel_m);
    return std::min(as_field, std::max(fewest, options_.most_texels));
  }

  const std::vector<FieldView>& views_;
  const LightField& focused_;
  const ProxyVisibility& visibility_;
  const EmitterBlender& emitters_;
  const HoleFiller& filler_;
  PenaltyOptions penalty_;
  JustInTimeOptions options_;
  LightField part_;
  PlaneTile of_cell_;  // what the cell at hand shows; w: confidence
};

// With the plane as proxy a point of it is one pixel of a view for all directions: the views are warped onto it once.
std::vector<PlaneTile> over_the_plane(const std::vector<FieldView>& views, const LightField& focused, int k,
                                      std::span<const TileRequest> requests, int most_texels) {
  constexpr std::size_t cells_at_once = 32;  // of a request that may be all of the hemisphere
  LightField part;
  part.plane = focused.plane;
  part.directions = focused.directions;
  const int coarsest = whole_blocks(static_cast<float>(focused.plane.size_m().maxCoeff()) / coarsest_texel_m);
  part.resolution = std::min(focused.resolution, std::max(coarsest, most_texels));
  const RectifiedViews rectified(views, part.plane, part.resolution);
  const HoleFiller filler(part);
  tbb::enumerable_thread_specific<PlaneTiles> resamplers([&] { return PlaneTiles(rectified, part, k); });
  std::vector<PlaneTile> tiles(requests.size());
  tbb::parallel_for(std::size_t{0}, requests.size(), [&](std::size_t i) {
    PlaneTile& tile = tiles[i];
    tile = black_tile(part.plane.min_m.cast<float>(), part.plane.max_m.cast<float>(), part.resolution, part.resolution);
    const std::vector<std::size_t> cells(requests[i].cells.begin(), requests[i].cells.end());
    std::vector<Eigen::Vector4f> of_cells(std::min(cells_at_once, cells.size()) * part.texel_count());
    float solid_angle = 0;
    for (std::size_t first = 0; first < cells.size(); first += cells_at_once) {
      const auto some = std::span(cells).subspan(first, std::min(cells_at_once, cells.size() - first));
      resamplers.local().fill(some, of_cells.data());
      for (std::size_t c = 0; c < some.size(); ++c) {
        Eigen::Vector4f* of_cell = of_cells.data() + c * part.texel_count();
        filler.fill(some[c], of_cell);
        solid_angle += part.directions.solid_angles_sr[some[c]];
        for (std::size_t t = 0; t < part.texel_count(); ++t)
          tile.texels[t] += part.directions.solid_angles_sr[some[c]] * of_cell[t];
      }
    }
    for (Eigen::Vector4f& texel : tile.texels) texel /= solid_angle;
  });
  return tiles;
}

}  // namespace

std::vector<PlaneTile> resample_just_in_time(const std::vector<FieldView>& views, const LightField& focused,
                                             const PenaltyOptions& penalty, std::span<const TileRequest> requests,
                                             const JustInTimeOptions& options) {
  check(options.most_texels >= 8 && options.most_texels % 8 == 0, "a multiple of 8 texels");
  if (focused.surroundings.is_plane()) return over_the_plane(views, focused, penalty.k, requests, options.most_texels);
  const ProxyVisibility visibility(views, focused.surroundings, focused.plane);
  // Emitters are black here, and views that show their glare have no say.
  const EmitterBlender emitters(views, focused.surroundings, focused.emitters, EmitterBlender::Lit::no);
  const HoleFiller filler(focused);
  tbb::enumerable_thread_specific<Worker> workers(
      [&] { return Worker(views, focused, visibility, emitters, filler, penalty, options); });
  std::vector<PlaneTile> tiles(requests.size());
  tbb::parallel_for(std::size_t{0}, requests.size(),
                    [&](std::size_t i) { tiles[i] = workers.local().fill(requests[i]); });
  return tiles;
}

}  // namespace mf
