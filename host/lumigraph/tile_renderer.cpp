// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/tile_renderer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "host/blending/view_weights.h"
#include "host/lumigraph/proxy_rays.h"

namespace mf {

namespace {

constexpr float infinite = std::numeric_limits<float>::infinity();
constexpr int block_side = 16;        // pixels: photos are ranked for 256 rays at a time
constexpr std::size_t samples = 16;   // rays that stand for a tile when its bound is guessed
constexpr float bound_slack = 1.03F;  // on the guess: fewer rays are ranked twice
constexpr float same_ray = 1e-6F;     // radians: what single precision leaves of an angle of 0

// The points of some rays: one region, or two where a silhouette parts them into near and far ones, so that neither is
// much larger than its part of the picture.
class Regions {
 public:
  explicit Regions(const RayBundle& rays) {
    const auto [nearest, farthest] = std::minmax_element(rays.depth.begin(), rays.depth.end());
    // Not worth twice the work for a surface at a slant.
    constexpr float parted = 1.2F;
    const float middle = *farthest > parted * *nearest ? std::sqrt(*nearest * *farthest) : infinite;
    for (std::size_t i = 0; i < rays.depth.size(); ++i) parts_[rays.depth[i] > middle ? 1 : 0].add(rays, i);
  }

  // Nothing less is possible for the photo at any of the rays.
  [[nodiscard]] float least(const AnsweringView& view, const PenaltyOptions& options) const {
    float least = infinite;
    for (const Part& part : parts_)
      if (part.low.x() <= part.high.x()) least = std::min(least, least_penalty(view, part.region(), options));
    return least;
  }

 private:
  struct Part {
    Eigen::Vector3f low = Eigen::Vector3f::Constant(infinite);
    Eigen::Vector3f high = Eigen::Vector3f::Constant(-infinite);
    float least_cosine = 1;
    float least_area = infinite;

    void add(const RayBundle& rays, std::size_t i) {
      const Eigen::Vector3f d(rays.dx[i], rays.dy[i], rays.dz[i]);
      const float length = d.norm();
      low = low.cwiseMin(rays.depth[i] * d);
      high = high.cwiseMax(rays.depth[i] * d);
      const float along = std::abs(d.dot(Eigen::Vector3f(rays.nx[i], rays.ny[i], rays.nz[i]))) / length;
      least_cosine = std::min(least_cosine, std::max(along, edge_on_cosine));
      least_area = std::min(least_area, rays.focal2 * length / (rays.depth[i] * rays.depth[i]));
    }
    [[nodiscard]] RaysRegion region() const {
      return {(low + high) / 2, (high - low).norm() / 2, least_cosine, least_area};
    }
  };
  std::array<Part, 2> parts_;
};

}  // namespace

void TileRays::resize(std::size_t count) {
  for (auto* values : {&dx, &dy, &dz, &depth, &nx, &ny, &nz}) values->resize(count);
  pixel.resize(count);
}

void TileRays::copy(std::size_t from, const TileRays& source, std::size_t to) {
  dx[to] = source.dx[from];
  dy[to] = source.dy[from];
  dz[to] = source.dz[from];
  depth[to] = source.depth[from];
  nx[to] = source.nx[from];
  ny[to] = source.ny[from];
  nz[to] = source.nz[from];
  pixel[to] = source.pixel[from];
}

RayBundle TileRays::bundle(std::size_t first, std::size_t count, const WantedResolution& wanted) const {
  const auto part = [&](const std::vector<float>& values) { return std::span(values).subspan(first, count); };
  return {part(dx), part(dy), part(dz), part(depth), part(nx), part(ny), part(nz), wanted.focal2, wanted.beyond};
}

TileRenderer::TileRenderer(const TileFrame& frame, TileBuffers& buffers, const TakeChosen& take)
    : frame_(frame), buffers_(buffers), take_(take), plain_camera_(!frame.view.camera.has_distortion()) {
  const auto entries = static_cast<std::size_t>(frame.options.penalty.k + 1) * largest_bundle;
  buffers.least_penalty.resize(entries);
  buffers.least_candidate.resize(entries);
  for (auto* values :
       {&buffers.chosen_weight, &buffers.chosen_sight, &buffers.chosen_x, &buffers.chosen_y, &buffers.chosen_lod})
    values->resize(entries);
  buffers.chosen_view.resize(entries);
  buffers.pixel.resize(largest_bundle);
}

void TileRenderer::render(int x0, int y0) {
  shoot(x0, y0);
  const TileRays& rays = buffers_.rays;
  if (rays.size() == 0) return;
  rank_for_tile();
  for (const Region& block : blocks_) {
    if (block.first == block.end) continue;
    bound_from_below(rays, block, buffers_.of_tile, buffers_.of_tile.bound, buffers_.of_block);
    for (std::size_t first = block.first; first < block.end; first += largest_bundle)
      choose(rays, {first, std::min(block.end, first + largest_bundle)}, buffers_.of_block);
  }
}

void TileRenderer::shoot(int x0, int y0) {
  buffers_.rays.resize(0);
  blocks_.clear();
  const int x1 = std::min(x0 + tile_side, frame_.view.camera.width);
  const int y1 = std::min(y0 + tile_side, frame_.view.camera.height);
  for (int y = y0; y < y1; y += block_side)
    for (int x = x0; x < x1; x += block_side)
      shoot_block(x, y, std::min(x + block_side, x1), std::min(y + block_side, y1));
}

// Rays that meet the proxy stay.
void TileRenderer::shoot_block(int x0, int y0, int x1, int y1) {
  const CameraModel& camera = frame_.view.camera;
  const Rigid3 world_from_cam = frame_.view.cam_from_world.inverse();
  const Eigen::Matrix3d rotation = world_from_cam.rotation.toRotationMatrix();
  TileRays& rays = buffers_.rays;
  const std::size_t first = rays.size();
  rays.resize(first + static_cast<std::size_t>((x1 - x0) * (y1 - y0)));
  std::size_t end = first;
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x) {
      Eigen::Vector3d ray((x + 0.5 - camera.cx()) / camera.fx(), (y + 0.5 - camera.cy()) / camera.fy(), 1);
      if (!plain_camera_) {
        const auto undistorted = camera.unproject({x + 0.5, y + 0.5});
        if (!undistorted) continue;
        ray = *undistorted;
      }
      const Eigen::Vector3f d = (rotation * ray).cast<float>();
      rays.dx[end] = d.x();
      rays.dy[end] = d.y();
      rays.dz[end] = d.z();
      rays.pixel[end++] = y * camera.width + x;
    }
  const auto part = [&](std::vector<float>& values) { return std::span(values).subspan(first, end - first); };
  trace(frame_.proxy, {world_from_cam.translation.cast<float>(), part(rays.dx), part(rays.dy), part(rays.dz),
                       part(rays.depth), part(rays.nx), part(rays.ny), part(rays.nz)});
  std::size_t kept = first;
  for (std::size_t i = first; i < end; ++i)
    if (rays.depth[i] < infinite) rays.copy(i, rays, kept++);
  rays.resize(kept);
  blocks_.push_back({first, kept});
}

void TileRenderer::bound_from_below(const TileRays& rays, const Region& region, const CandidateViews& from, float below,
                                    CandidateViews& to) {
  const Regions regions(rays.bundle(region.first, region.end - region.first, frame_.wanted));
  to.bound = below;
  to.views.clear();
  for (const CandidateView& candidate : from.views) {
    if (candidate.least > below) break;
    const float least = regions.least(frame_.views[candidate.view], frame_.options.penalty);
    if (least < infinite && least <= below) to.views.push_back({least, candidate.view});
  }
  std::sort(to.views.begin(), to.views.end(),
            [](const CandidateView& a, const CandidateView& b) { return a.least < b.least; });
}

void TileRenderer::rank_for_tile() {
  const TileRays& rays = buffers_.rays;
  TileRays& picked = buffers_.some;
  picked.resize(samples);
  for (std::size_t i = 0; i < samples; ++i) picked.copy(i * (rays.size() - 1) / (samples - 1), rays, i);
  CandidateViews& of_tile = buffers_.of_tile;
  bound_from_below(rays, {0, rays.size()}, frame_.speaking, infinite, of_tile);
  rank(picked.bundle(0, samples, frame_.wanted), of_tile);
  const auto worst = worst_of({buffers_.least_penalty, buffers_.least_candidate, samples, frame_.options.penalty.k});
  of_tile.bound = bound_slack * *std::max_element(worst.begin(), worst.end());
}

// Stops at the first candidate that no ray can prefer to what it has: the rest are no better.
void TileRenderer::rank(const RayBundle& bundle, const CandidateViews& candidates) {
  TileBuffers& b = buffers_;
  const std::size_t count = bundle.dx.size();
  const LeastPenalties least{b.least_penalty, b.least_candidate, count, frame_.options.penalty.k};
  clear(least);
  for (std::size_t c = 0; c < candidates.views.size(); ++c) {
    if (!any_reaches(worst_of(least), candidates.views[c].least)) return;
    const std::size_t needed = (c + 1) * count;
    for (auto* values : {&b.x, &b.y, &b.lod, &b.weight, &b.penalty})
      if (values->size() < needed) values->resize(2 * needed);
    const auto row = [&](std::vector<float>& values) { return std::span(values).subspan(c * count, count); };
    const RayAnswers answers{row(b.x), row(b.y), row(b.lod), row(b.weight), row(b.penalty)};
    answer(frame_.views[candidates.views[c].view], bundle, frame_.options.penalty, frame_.depth_tolerance,
           worst_of(least), answers);
    add_candidate(least, static_cast<std::int32_t>(c), answers.penalty);
  }
}

void TileRenderer::choose(const TileRays& rays, const Region& region, const CandidateViews& candidates) {
  const std::size_t count = region.end - region.first;
  rank(rays.bundle(region.first, count, frame_.wanted), candidates);
  for (std::size_t i = 0; i < count; ++i) buffers_.pixel[i] = rays.pixel[region.first + i];
  if (candidates.bound == infinite) {
    hand_on(count, candidates);
    return;
  }
  const auto worst = worst_of({buffers_.least_penalty, buffers_.least_candidate, count, frame_.options.penalty.k});
  TileRays& again = buffers_.some;
  again.resize(0);
  float bound = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (worst[i] <= candidates.bound) continue;
    again.resize(again.size() + 1);
    again.copy(region.first + i, rays, again.size() - 1);
    bound = std::max(bound, worst[i]);
    buffers_.pixel[i] = -1;
  }
  hand_on(count, candidates);
  if (again.size() > 0) choose_again(bound);
}

// A photo whose penalty is above `bound` everywhere is among no ray's k + 1 best: each has as many below already.
void TileRenderer::choose_again(float bound) {
  const TileRays& rays = buffers_.some;
  const Region region{0, rays.size()};
  bound_from_below(rays, region, buffers_.of_tile, bound, buffers_.again);
  buffers_.again.bound = infinite;  // these are all that can matter
  choose(rays, region, buffers_.again);
}

void TileRenderer::hand_on(std::size_t count, const CandidateViews& candidates) {
  TileBuffers& b = buffers_;
  const auto k = static_cast<std::size_t>(frame_.options.penalty.k);
  for (std::size_t i = 0; i < count; ++i) {
    const float threshold = b.least_penalty[k * count + i];
    float sum = 0;
    b.chosen_sight[i] = 0;
    for (std::size_t row = 0; row < k; ++row) {
      const std::size_t at = row * count + i;
      const std::int32_t candidate = b.least_candidate[at];
      b.chosen_weight[at] = candidate < 0 ? 0 : ray_weight(b.least_penalty[at], threshold, same_ray);
      sum += b.chosen_weight[at];
      if (candidate < 0) continue;
      const std::size_t answer_at = static_cast<std::size_t>(candidate) * count + i;
      b.chosen_view[at] = candidates.views[static_cast<std::size_t>(candidate)].view;
      b.chosen_x[at] = b.x[answer_at];
      b.chosen_y[at] = b.y[answer_at];
      b.chosen_lod[at] = b.lod[answer_at];
      b.chosen_sight[i] = std::max(b.chosen_sight[i], b.weight[answer_at]);
    }
    if (sum > 0)
      for (std::size_t row = 0; row < k; ++row) b.chosen_weight[row * count + i] /= sum;
  }
  take_({std::span(b.pixel).first(count), count, frame_.options.penalty.k, b.chosen_weight, b.chosen_sight,
         b.chosen_view, b.chosen_x, b.chosen_y, b.chosen_lod});
}

}  // namespace mf
