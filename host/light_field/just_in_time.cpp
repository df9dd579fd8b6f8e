// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/just_in_time.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/check.h"
#include "host/light_field/emitter_blender.h"
#include "host/light_field/hole_filler.h"
#include "host/light_field/plane_tiles.h"
#include "host/light_field/tile_resampler.h"

namespace mf {

namespace {

constexpr int emitter_step = 4;  // texels of the light field between the points at which emitters are drawn, as there
// A preview's texels are no larger. The resampler looks for emitters at every fourth texel, and must not step over the
// glare beside one, which it takes to reach 12 cm.
constexpr float coarsest_texel_m = 0.05F;

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
  PlaneTile tile{r.min_m - half, r.max_m + half, texels, texels, {}};
  tile.texels.assign(static_cast<std::size_t>(texels) * static_cast<std::size_t>(texels), Eigen::Vector4f::Zero());
  return tile;
}

// Where the light field draws its emitters: at every fourth corner of its texels, counted from its top left.
class EmitterVertices {
 public:
  EmitterVertices(const LightField& field, const Rectangle& r)
      : low_(field.plane.min_m.cast<float>()),
        high_(field.plane.max_m.cast<float>()),
        step_(field.plane.size_m().cast<float>().array() *
              (static_cast<float>(emitter_step) / static_cast<float>(field.resolution))),
        texel_(step_ / static_cast<float>(emitter_step)),
        resolution_(field.resolution) {
    left_ = static_cast<int>(std::floor((r.min_m.x() - low_.x()) / step_.x()));
    right_ = std::max(left_ + 1, static_cast<int>(std::ceil((r.max_m.x() - low_.x()) / step_.x())));
    top_ = static_cast<int>(std::floor((high_.y() - r.max_m.y()) / step_.y()));
    bottom_ = std::max(top_ + 1, static_cast<int>(std::ceil((high_.y() - r.min_m.y()) / step_.y())));
  }

  // An empty tile whose texel centres are the vertices.
  [[nodiscard]] PlaneTile tile() const {
    const auto at = [](int corner, float side) { return static_cast<float>(corner) + side; };
    PlaneTile tile;
    tile.min_m = {low_.x() + at(left_, -0.5F) * step_.x(), high_.y() - at(bottom_, 0.5F) * step_.y()};
    tile.max_m = {low_.x() + at(right_, 0.5F) * step_.x(), high_.y() - at(top_, -0.5F) * step_.y()};
    tile.width = right_ - left_ + 1;
    tile.height = bottom_ - top_ + 1;
    tile.texels.assign(static_cast<std::size_t>(tile.width) * static_cast<std::size_t>(tile.height),
                       Eigen::Vector4f::Zero());
    return tile;
  }
  // The light field's own texels between the vertices, empty.
  [[nodiscard]] PlaneTile texels() const {
    const int x0 = emitter_step * left_, x1 = std::min(emitter_step * right_, resolution_);
    const int y0 = emitter_step * top_, y1 = std::min(emitter_step * bottom_, resolution_);
    PlaneTile tile;
    tile.min_m = {low_.x() + static_cast<float>(x0) * texel_.x(), high_.y() - static_cast<float>(y1) * texel_.y()};
    tile.max_m = {low_.x() + static_cast<float>(x1) * texel_.x(), high_.y() - static_cast<float>(y0) * texel_.y()};
    tile.width = x1 - x0;
    tile.height = y1 - y0;
    tile.texels.resize(static_cast<std::size_t>(tile.width) * static_cast<std::size_t>(tile.height));
    return tile;
  }

 private:
  Eigen::Array2f low_, high_;    // of the plane's rectangle
  Eigen::Array2f step_, texel_;  // metres
  int resolution_;
  int left_, top_, right_, bottom_;  // the first and last corners, in steps
};

// One thread's working memory: a light field of few texels, whose rectangle is the request's.
class Worker {
 public:
  Worker(const std::vector<FieldView>& views, const LightField& focused, const EmitterBlender& dark,
         const EmitterBlender& lit, const HoleFiller& filler, const PenaltyOptions& penalty, int most_texels)
      : views_(views),
        focused_(focused),
        dark_(dark),
        lit_(lit),
        filler_(filler),
        penalty_(penalty),
        most_texels_(most_texels) {
    all_views_.resize(views.size());
    std::iota(all_views_.begin(), all_views_.end(), 0U);
    part_.directions = focused.directions;
    part_.surroundings = focused.surroundings;
    part_.surroundings.panorama = {};
  }

  PlaneTile fill(const TileRequest& request) {
    const Rectangle where = inside(focused_, request);
    part_.resolution = texels_for(where);
    PlaneTile smooth = even_tile(where, part_.resolution);
    const EmitterVertices vertices(focused_, where);
    PlaneTile emitted = vertices.tile();
    of_cell_ = smooth;
    part_.plane = {focused_.plane.world_from_plane, smooth.min_m.cast<double>(), smooth.max_m.cast<double>()};
    TileResampler resampler(views_, part_, dark_, penalty_);
    float solid_angle = 0;
    for (const std::uint32_t cell : request.cells) solid_angle += part_.directions.solid_angles_sr[cell];
    bool any_emitter = false;
    for (const std::uint32_t cell : request.cells) {
      const float share = part_.directions.solid_angles_sr[cell] / solid_angle;
      resampler.fill(cell, of_cell_.texels.data());
      filler_.fill(cell, part_.plane, part_.resolution, of_cell_.texels.data());
      for (std::size_t t = 0; t < smooth.texels.size(); ++t) smooth.texels[t] += share * of_cell_.texels[t];
      any_emitter = add_emitters(cell, share, emitted) || any_emitter;
    }
    if (!any_emitter) return smooth;
    PlaneTile both = vertices.texels();
    for (int y = 0; y < both.height; ++y)
      for (int x = 0; x < both.width; ++x) {
        const Eigen::Vector2f at = both.position(x, y);
        both.texels[static_cast<std::size_t>(y * both.width + x)] =
            sample(smooth.image(), at) + sample(emitted.image(), at);
      }
    return both;
  }

 private:
  // Along each side, in whole blocks of the resampler.
  [[nodiscard]] int texels_for(const Rectangle& r) const {
    const Eigen::Vector2f part = (r.max_m - r.min_m).cwiseQuotient(focused_.plane.size_m().cast<float>());
    const int as_field = whole_blocks(part.maxCoeff() * static_cast<float>(focused_.resolution));
    const int fewest = whole_blocks((r.max_m - r.min_m).maxCoeff() / coarsest_texel_m);
    return std::min(as_field, std::max(fewest, most_texels_));
  }

  // Adds share · (the emitters' light, mean over the cell). Returns whether there is any.
  bool add_emitters(std::uint32_t cell, float share, PlaneTile& emitted);

  // Light of the emitters, integrated over the cell, as seen from p (world), and the solid angle of the parts that they
  // fill.
  [[nodiscard]] Eigen::Vector4f emitted_at(const Eigen::Vector3f& p, float part_angle) const;

  const std::vector<FieldView>& views_;
  const LightField& focused_;
  const EmitterBlender& dark_;
  const EmitterBlender& lit_;
  std::vector<std::uint32_t> all_views_;
  const HoleFiller& filler_;
  PenaltyOptions penalty_;
  int most_texels_;
  LightField part_;
  PlaneTile of_cell_;              // what the cell at hand shows but for the emitters; w: confidence
  std::vector<CellSample> parts_;  // of the cell at hand, directions in the world
};

Eigen::Vector4f Worker::emitted_at(const Eigen::Vector3f& p, float part_angle) const {
  Eigen::Vector4f sum = Eigen::Vector4f::Zero();
  for (const CellSample& part : parts_) {
    const ShadedEmitter* const met = lit_.met(p, part.direction);
    if (met == nullptr) continue;
    const Eigen::Vector4f seen = lit_.radiance(met, p, part.direction, part_angle, all_views_);
    sum += part.solid_angle_sr * seen.w() * Eigen::Vector4f(seen.x(), seen.y(), seen.z(), 1);
  }
  return sum;
}

bool Worker::add_emitters(std::uint32_t cell, float share, PlaneTile& emitted) {
  const Eigen::Matrix3f turn = focused_.plane.world_from_plane.rotation.toRotationMatrix().cast<float>();
  const Eigen::Vector3f origin = focused_.plane.world_from_plane.translation.cast<float>();
  const Eigen::Vector3f direction = turn * part_.directions.directions[cell];
  const float solid_angle = part_.directions.solid_angles_sr[cell];
  const float angle = std::sqrt(solid_angle);  // a cell's corners are nearer to its direction than that
  parts_.clear();
  for (int y = 0; y < emitted.height; ++y)
    for (int x = 0; x < emitted.width; ++x) {
      const Eigen::Vector2f at = emitted.position(x, y);
      const Eigen::Vector3f p = origin + turn * Eigen::Vector3f(at.x(), at.y(), 0);
      if (!lit_.may_meet(p, direction, angle)) continue;
      if (parts_.empty()) {
        parts_ = split_cell(part_.directions, cell, splits_near_emitter(solid_angle));
        for (CellSample& part : parts_) part.direction = turn * part.direction;
      }
      const Eigen::Vector4f light = emitted_at(p, angle / std::sqrt(static_cast<float>(parts_.size()))) / solid_angle;
      // As the light field has it: a cell's colour is the mean over what was seen of the cell.
      const float seen = std::max(sample(of_cell_.image(), at).w(), light.w());
      if (seen > 0)
        emitted.texels[static_cast<std::size_t>(y * emitted.width + x)].head<3>() += share / seen * light.head<3>();
    }
  return !parts_.empty();
}

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
    tile = {part.plane.min_m.cast<float>(), part.plane.max_m.cast<float>(), part.resolution, part.resolution, {}};
    tile.texels.assign(part.texel_count(), Eigen::Vector4f::Zero());
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
  // Once without the emitters' light, where views that show their glare have no say, and once for that light alone.
  const EmitterBlender dark(views, focused.surroundings, focused.emitters, EmitterBlender::Lit::no);
  const EmitterBlender lit(views, focused.surroundings, focused.emitters, EmitterBlender::Lit::yes);
  const HoleFiller filler(focused);
  tbb::enumerable_thread_specific<Worker> workers(
      [&] { return Worker(views, focused, dark, lit, filler, penalty, options.most_texels); });
  std::vector<PlaneTile> tiles(requests.size());
  tbb::parallel_for(std::size_t{0}, requests.size(),
                    [&](std::size_t i) { tiles[i] = workers.local().fill(requests[i]); });
  return tiles;
}

}  // namespace mf
