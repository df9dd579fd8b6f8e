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
constexpr int block_side = 16;         // pixels: photos are ranked for 256 rays at a time
constexpr int strip_rows = 4;          // of a block: the rays of a bundle
constexpr std::size_t samples = 16;    // rays that stand for a region when its bound is guessed
constexpr float bound_slack = 1.03F;   // on the guess: fewer rays are ranked twice
constexpr float same_ray = 1e-6F;      // radians: what single precision leaves of an angle of 0

// The points of a region: one sphere, or two where a silhouette parts them into near and far ones, so that neither is
// much larger than its part of the picture.
struct Sphere {
  Eigen::Vector3f low = Eigen::Vector3f::Constant(infinite);
  Eigen::Vector3f high = Eigen::Vector3f::Constant(-infinite);

  void add(const Eigen::Vector3f& x) {
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  [[nodiscard]] bool empty() const { return low.x() > high.x(); }
  [[nodiscard]] Eigen::Vector3f centre() const { return (low + high) / 2; }
  [[nodiscard]] float radius() const { return (high - low).norm() / 2; }
};
using Spheres = std::array<Sphere, 2>;

Spheres spheres_of(const RayBundle& rays) {
  const auto [nearest, farthest] = std::minmax_element(rays.depth.begin(), rays.depth.end());
  const float middle = std::sqrt(*nearest * *farthest);
  Spheres spheres;
  for (std::size_t i = 0; i < rays.depth.size(); ++i)
    spheres[rays.depth[i] > middle ? 1 : 0].add(rays.depth[i] * Eigen::Vector3f(rays.dx[i], rays.dy[i], rays.dz[i]));
  return spheres;
}

}  // namespace

void TileRenderer::Rays::resize(std::size_t count) {
  for (auto* values : {&dx, &dy, &dz, &depth, &nx, &ny, &nz}) values->resize(count);
  pixel.resize(count);
}

void TileRenderer::Rays::copy(std::size_t from, const Rays& source, std::size_t to) {
  dx[to] = source.dx[from];
  dy[to] = source.dy[from];
  dz[to] = source.dz[from];
  depth[to] = source.depth[from];
  nx[to] = source.nx[from];
  ny[to] = source.ny[from];
  nz[to] = source.nz[from];
  pixel[to] = source.pixel[from];
}

RayBundle TileRenderer::Rays::bundle(std::size_t first, std::size_t count, float focal2) const {
  const auto part = [&](const std::vector<float>& values) { return std::span(values).subspan(first, count); };
  return {part(dx), part(dy), part(dz), part(depth), part(nx), part(ny), part(nz), focal2};
}

TileRenderer::TileRenderer(const TileFrame& frame, TakeChosen take)
    : frame_(frame),
      take_(std::move(take)),
      focal2_(static_cast<float>(frame.view.camera.fx() * frame.view.camera.fy())),
      plain_camera_(!frame.view.camera.has_distortion()),
      all_{{}, infinite} {
  for (const std::uint32_t view : frame.speaking) all_.views.push_back({0, view});
  const auto entries = static_cast<std::size_t>(frame.options.penalty.k + 1) * largest_bundle;
  least_penalty_.resize(entries);
  least_candidate_.resize(entries);
  for (auto* values : {&weight_, &sight_, &x_, &y_, &lod_}) values->resize(entries);
  view_.resize(entries);
  pixel_.resize(largest_bundle);
}

void TileRenderer::render(int x0, int y0) {
  shoot(x0, y0);
  if (rays_.size() == 0) return;
  narrow(all_, {0, rays_.size()}, of_tile_);
  for (const Region& block : blocks_) {
    if (block.first == block.end) continue;
    narrow(of_tile_, block, of_block_);
    for (std::size_t first = block.first; first < block.end; first += largest_bundle)
      choose(rays_, {first, std::min(block.end, first + largest_bundle)}, of_block_);
  }
}

// Rays that meet the proxy stay, in the order of their blocks.
void TileRenderer::shoot(int x0, int y0) {
  rays_.resize(0);
  blocks_.clear();
  const int x1 = std::min(x0 + tile_side, frame_.view.camera.width);
  const int y1 = std::min(y0 + tile_side, frame_.view.camera.height);
  for (int y = y0; y < y1; y += block_side)
    for (int x = x0; x < x1; x += block_side)
      shoot_block(x, y, std::min(x + block_side, x1), std::min(y + block_side, y1));
}

void TileRenderer::shoot_block(int x0, int y0, int x1, int y1) {
  const CameraModel& camera = frame_.view.camera;
  const Eigen::Matrix3d world_from_cam = frame_.view.cam_from_world.rotation.conjugate().toRotationMatrix();
  const std::size_t first = rays_.size();
  rays_.resize(first + static_cast<std::size_t>((x1 - x0) * (y1 - y0)));
  std::size_t at = first;
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x) {
      Eigen::Vector3d ray((x + 0.5 - camera.cx()) / camera.fx(), (y + 0.5 - camera.cy()) / camera.fy(), 1);
      if (!plain_camera_) {
        const auto undistorted = camera.unproject({x + 0.5, y + 0.5});
        if (!undistorted) continue;
        ray = *undistorted;
      }
      const Eigen::Vector3d d = world_from_cam * ray;
      rays_.dx[at] = static_cast<float>(d.x());
      rays_.dy[at] = static_cast<float>(d.y());
      rays_.dz[at] = static_cast<float>(d.z());
      rays_.pixel[at++] = y * camera.width + x;
    }
  const auto part = [&](std::vector<float>& values) { return std::span(values).subspan(first, at - first); };
  trace(frame_.proxy,
        {frame_.view.cam_from_world.inverse().translation.cast<float>(), part(rays_.dx), part(rays_.dy), part(rays_.dz),
         part(rays_.depth), part(rays_.nx), part(rays_.ny), part(rays_.nz)});
  std::size_t kept = first;
  for (std::size_t i = first; i < at; ++i)
    if (rays_.depth[i] < infinite) rays_.copy(i, rays_, kept++);
  rays_.resize(kept);
  blocks_.push_back({first, kept});
}

void TileRenderer::bound_from_below(const Rays& rays, const Region& region, const Candidates& from, float below,
                                    Candidates& to) {
  const Spheres spheres = spheres_of(rays.bundle(region.first, region.end - region.first, focal2_));
  to.views.clear();
  for (const Candidate& candidate : from.views) {
    float least = infinite;
    for (const Sphere& sphere : spheres)
      if (!sphere.empty())
        least = std::min(least, least_penalty(frame_.views[candidate.view], sphere.centre(), sphere.radius(),
                                              frame_.options.penalty));
    if (least < infinite && least <= below) to.views.push_back({least, candidate.view});
  }
  std::sort(to.views.begin(), to.views.end(), [](const Candidate& a, const Candidate& b) { return a.least < b.least; });
}

void TileRenderer::narrow(const Candidates& from, const Region& region, Candidates& to) {
  Rays picked;
  picked.resize(samples);
  for (std::size_t i = 0; i < samples; ++i)
    picked.copy(region.first + i * (region.end - 1 - region.first) / (samples - 1), rays_, i);
  bound_from_below(rays_, region, from, from.bound, to);
  rank(picked.bundle(0, samples, focal2_), to);
  const auto worst = worst_of({least_penalty_, least_candidate_, samples, frame_.options.penalty.k});
  to.bound = std::min(from.bound, bound_slack * *std::max_element(worst.begin(), worst.end()));
  while (!to.views.empty() && to.views.back().least > to.bound) to.views.pop_back();
}

void TileRenderer::rank(const RayBundle& bundle, const Candidates& candidates) {
  const std::size_t count = bundle.dx.size();
  const LeastPenalties least{least_penalty_, least_candidate_, count, frame_.options.penalty.k};
  clear(least);
  const std::span<const float> worst = worst_of(least);
  for (std::size_t c = 0; c < candidates.views.size(); ++c) {
    if (candidates.views[c].least > *std::max_element(worst.begin(), worst.end())) return;
    const std::size_t needed = (c + 1) * count;
    for (auto* values : {&answers_x_, &answers_y_, &answers_lod_, &answers_weight_, &answers_penalty_})
      if (values->size() < needed) values->resize(2 * needed);
    const auto row = [&](std::vector<float>& values) { return std::span(values).subspan(c * count, count); };
    const RayAnswers answers{row(answers_x_), row(answers_y_), row(answers_lod_), row(answers_weight_),
                             row(answers_penalty_)};
    answer(frame_.views[candidates.views[c].view], bundle, frame_.options.penalty, frame_.depth_tolerance, worst,
           answers);
    add_candidate(least, static_cast<std::int32_t>(c), answers.penalty);
  }
}

void TileRenderer::choose(const Rays& rays, const Region& region, const Candidates& candidates) {
  const std::size_t count = region.end - region.first;
  rank(rays.bundle(region.first, count, focal2_), candidates);
  const auto worst = worst_of({least_penalty_, least_candidate_, count, frame_.options.penalty.k});
  Rays again;
  float bound = 0;
  for (std::size_t i = 0; i < count; ++i) {
    pixel_[i] = rays.pixel[region.first + i];
    if (worst[i] <= candidates.bound) continue;
    again.resize(again.size() + 1);
    again.copy(region.first + i, rays, again.size() - 1);
    bound = std::max(bound, worst[i]);
    pixel_[i] = -1;
  }
  hand_on(count, candidates);
  if (again.size() > 0) choose_again(again, bound);
}

// No photo whose penalty is `bound` or more can be among a ray's k + 1 best: it has as many below already.
void TileRenderer::choose_again(const Rays& rays, float bound) {
  bound_from_below(rays, {0, rays.size()}, bound <= of_tile_.bound ? of_tile_ : all_, bound, again_);
  again_.bound = infinite;
  choose(rays, {0, rays.size()}, again_);
}

void TileRenderer::hand_on(std::size_t count, const Candidates& candidates) {
  const auto k = static_cast<std::size_t>(frame_.options.penalty.k);
  for (std::size_t i = 0; i < count; ++i) {
    const float threshold = least_penalty_[k * count + i];
    float sum = 0;
    sight_[i] = 0;
    for (std::size_t row = 0; row < k; ++row) {
      const std::size_t at = row * count + i;
      const std::int32_t candidate = least_candidate_[at];
      weight_[at] = candidate < 0 ? 0 : ray_weight(least_penalty_[at], threshold, same_ray);
      sum += weight_[at];
      if (candidate < 0) continue;
      const std::size_t answer_at = static_cast<std::size_t>(candidate) * count + i;
      view_[at] = candidates.views[static_cast<std::size_t>(candidate)].view;
      x_[at] = answers_x_[answer_at];
      y_[at] = answers_y_[answer_at];
      lod_[at] = answers_lod_[answer_at];
      sight_[i] = std::max(sight_[i], answers_weight_[answer_at]);
    }
    if (sum > 0)
      for (std::size_t row = 0; row < k; ++row) weight_[row * count + i] /= sum;
  }
  take_({std::span(pixel_).first(count), count, frame_.options.penalty.k, weight_, sight_, view_, x_, y_, lod_});
}

}  // namespace mf
