// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/tile_renderer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "host/blending/view_weights.h"
#include "host/lumigraph/proxy_rays.h"

namespace mf {

namespace {

constexpr float infinite = std::numeric_limits<float>::infinity();
constexpr int bundle_side = 8;        // pixels
constexpr std::size_t samples = 16;   // rays that stand for a tile when its bound is guessed
constexpr float bound_slack = 1.03F;  // on the guess: fewer rays are ranked twice
constexpr float first_step = 1.5F;    // from the tile's bound to the next; the further ones are its powers
constexpr float same_ray = 1e-6F;     // radians: what single precision leaves of an angle of 0
static_assert(bundle_side * bundle_side <= largest_bundle);

// The distance, in lengths of the directions, that parts near points from far ones, so that neither fill a much larger
// box than their part of the picture does; infinite: not worth twice the work, as for a surface at a slant.
float parting_depth(float nearest, float farthest) {
  constexpr float parted = 1.2F;
  return farthest > parted * nearest ? std::sqrt(nearest * farthest) : infinite;
}

RayBundle part_of(const RayBundle& rays, std::size_t first, std::size_t count) {
  const auto part = [&](std::span<const float> values) { return values.subspan(first, count); };
  return {part(rays.dx), part(rays.dy), part(rays.dz), part(rays.depth), part(rays.nx),
          part(rays.ny), part(rays.nz), rays.focal2,   rays.beyond};
}

float of_weight(float penalty, float weight, float gamma) {
  if (!(weight > 0)) return infinite;
  return penalty / (gamma == 0.5F ? std::sqrt(weight) : std::pow(weight, gamma));
}

}  // namespace

void TileRays::resize(std::size_t count) {
  for (auto* values : {&dx, &dy, &dz, &depth, &nx, &ny, &nz}) values->resize(count);
  pixel.resize(count);
}

void TileRays::fill_lanes(std::size_t first) {
  const std::size_t end = size();
  const std::size_t lanes = (end - first + ray_lanes - 1) / ray_lanes * ray_lanes;
  resize(first + lanes);
  for (std::size_t i = end; i < size(); ++i) {
    copy(end - 1, *this, i);
    pixel[i] = -1;
  }
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
    : frame_(frame),
      buffers_(buffers),
      take_(take),
      plain_camera_(!frame.view.camera.has_distortion()),
      world_from_cam_(frame.view.cam_from_world.inverse()),
      axes_(world_from_cam_.rotation.toRotationMatrix().cast<float>()) {
  const auto entries = static_cast<std::size_t>(frame.options.penalty.k + 1) * largest_bundle;
  buffers.least_penalty.resize(entries);
  buffers.least_candidate.resize(entries);
  buffers.chosen_weight.resize(entries);
  buffers.pixel.resize(largest_bundle);
  buffers.told.resize(frame.views.size());
}

void TileRenderer::render(int x0, int y0) {
  shoot(x0, y0);
  if (bundles_.empty()) return;
  choose_for_tile();
  for (const Bundle& bundle : bundles_) choose(bundle);
}

void TileRenderer::shoot(int x0, int y0) {
  buffers_.rays.resize(0);
  bundles_.clear();
  const int x1 = std::min(x0 + tile_side, frame_.view.camera.width);
  const int y1 = std::min(y0 + tile_side, frame_.view.camera.height);
  for (int y = y0; y < y1; y += bundle_side)
    for (int x = x0; x < x1; x += bundle_side)
      shoot_bundle(x, y, std::min(x + bundle_side, x1), std::min(y + bundle_side, y1));
}

// Rays that meet the proxy stay, as one bundle or, where a silhouette parts them, as two.
void TileRenderer::shoot_bundle(int x0, int y0, int x1, int y1) {
  const CameraModel& camera = frame_.view.camera;
  const Eigen::Matrix3d rotation = world_from_cam_.rotation.toRotationMatrix();
  TileRays& rays = buffers_.some;
  rays.resize(static_cast<std::size_t>((x1 - x0) * (y1 - y0)));
  std::size_t count = 0;
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x) {
      Eigen::Vector3d ray((x + 0.5 - camera.cx()) / camera.fx(), (y + 0.5 - camera.cy()) / camera.fy(), 1);
      if (!plain_camera_) {
        const auto undistorted = camera.unproject({x + 0.5, y + 0.5});
        if (!undistorted) continue;
        ray = *undistorted;
      }
      const Eigen::Vector3f d = (rotation * ray).cast<float>();
      rays.dx[count] = d.x();
      rays.dy[count] = d.y();
      rays.dz[count] = d.z();
      rays.pixel[count++] = y * camera.width + x;
    }
  rays.resize(count);
  trace(frame_.proxy,
        {world_from_cam_.translation.cast<float>(), rays.dx, rays.dy, rays.dz, rays.depth, rays.nx, rays.ny, rays.nz});
  float nearest = infinite;
  float farthest = 0;
  for (const float depth : rays.depth) {
    nearest = std::min(nearest, depth);
    if (depth < infinite) farthest = std::max(farthest, depth);
  }
  const float middle = parting_depth(nearest, farthest);
  const auto add = [&](float from, float to) {
    TileRays& all = buffers_.rays;
    const std::size_t first = all.size();
    all.resize(first + count);
    std::size_t end = first;
    for (std::size_t i = 0; i < count; ++i)
      if (rays.depth[i] >= from && rays.depth[i] < to) all.copy(i, rays, end++);
    all.resize(end);
    if (end > first) add_bundle(first);
  };
  add(0, middle);
  if (middle < infinite) add(middle, infinite);
}

void TileRenderer::add_bundle(std::size_t first) {
  TileRays& rays = buffers_.rays;
  rays.fill_lanes(first);
  const std::size_t end = rays.size();
  bundles_.push_back({first, end, box_of(rays.bundle(first, end - first, frame_.wanted), axes_)});
}

// Near and far points apart, as in bundles.
void TileRenderer::bound_for_tile() {
  TileBuffers& b = buffers_;
  const auto [nearest, farthest] = std::minmax_element(b.rays.depth.begin(), b.rays.depth.end());
  const float middle = parting_depth(*nearest, *farthest);
  std::array<RaysBox, 2> parts;
  for (const Bundle& bundle : bundles_) parts[b.rays.depth[bundle.first] > middle ? 1 : 0].extend(bundle.box);
  b.least.assign(frame_.speaking.size(), infinite);
  b.of_part.resize(frame_.speaking.size());
  for (const RaysBox& part : parts) {
    if (part.empty()) continue;
    least_penalties(frame_.speaking, part, frame_.options.penalty, b.of_part);
    for (std::size_t i = 0; i < b.least.size(); ++i) b.least[i] = std::min(b.least[i], b.of_part[i]);
  }
}

// Some rays rank the photos in the order of what no ray of the tile undercuts, until none that is left can be among
// their k + 1 best; what they need is the tile's bound.
void TileRenderer::choose_for_tile() {
  TileBuffers& b = buffers_;
  bound_for_tile();
  b.heap.clear();
  for (std::uint32_t row = 0; row < b.least.size(); ++row)
    if (b.least[row] < infinite) b.heap.push_back(row);
  const auto later = [&b](std::uint32_t one, std::uint32_t other) { return b.least[one] > b.least[other]; };
  std::make_heap(b.heap.begin(), b.heap.end(), later);
  b.near.clear();
  const auto next_up_to = [&](float bound) -> std::optional<std::uint32_t> {
    if (b.heap.empty() || b.least[b.heap.front()] > bound) return std::nullopt;
    std::pop_heap(b.heap.begin(), b.heap.end(), later);
    const std::uint32_t row = b.heap.back();
    b.heap.pop_back();
    b.near.add(frame_.speaking, row);
    return row;
  };
  TileRays& picked = b.some;
  picked.resize(samples);
  for (std::size_t i = 0; i < samples; ++i) picked.copy(i * (b.rays.size() - 1) / (samples - 1), b.rays, i);
  start_ranking(picked.bundle(0, samples, frame_.wanted));
  while (const auto row = next_up_to(worst_.largest)) rank(frame_.speaking.numbers()[*row], b.least[*row]);
  keep_best();
  bound_ = bound_slack * worst_.largest;
  while (next_up_to(bound_)) {
  }
}

// Ranks those photos of the table that some ray of the box could give a penalty below `bound` and prefer.
void TileRenderer::rank_all(const ViewTable& table, const RaysBox& box, float bound) {
  TileBuffers& b = buffers_;
  b.least.resize(table.size());
  least_penalties(table, box, frame_.options.penalty, b.least);
  const RaysCorners corners = corners_of(box, axes_);
  for (std::size_t i = 0; i < table.size(); ++i) {
    const float reach = std::min(worst_.largest, bound);
    if (!(b.least[i] < reach)) continue;
    const std::uint32_t view = table.numbers()[i];
    ToldOfPhoto& told = b.told[view];
    if (told.ranking != b.rankings) {
      const float weight = largest_weight(frame_.views[view], corners, frame_.depth_tolerance);
      told = {b.rankings, of_weight(b.least[i], weight, frame_.options.penalty.border)};
    }
    if (told.least < reach) rank(view, told.least);
  }
}

// The photos that are among some ray's k + 1 best.
void TileRenderer::keep_best() {
  TileBuffers& b = buffers_;
  b.is_best.assign(b.view.size(), 0);
  for (std::size_t i = 0; i < ranking_.rays * static_cast<std::size_t>(ranking_.k + 1); ++i)
    if (b.least_candidate[i] >= 0) b.is_best[static_cast<std::size_t>(b.least_candidate[i])] = 1;
  b.likely.clear();
  for (std::size_t c = 0; c < b.view.size(); ++c)
    if (b.is_best[c] != 0) b.likely.push_back(b.view[c]);
}

void TileRenderer::start_ranking(const RayBundle& bundle) {
  TileBuffers& b = buffers_;
  bundle_ = bundle;
  ranking_ = {b.least_penalty, b.least_candidate, bundle.dx.size(), frame_.options.penalty.k};
  clear(ranking_);
  worst_ = range_of(worst_of(ranking_));
  b.view.clear();
  ++b.rankings;
}

// The rays between the first and the last that could give the photo a penalty above `least` and yet prefer it.
void TileRenderer::rank(std::uint32_t view, float least) {
  TileBuffers& b = buffers_;
  b.told[view] = {b.rankings, infinite};
  std::size_t first = 0;
  std::size_t end = ranking_.rays;
  while (first < end && worst_.of_lanes[first / ray_lanes] <= least) first += ray_lanes;
  while (first < end && worst_.of_lanes[(end - 1) / ray_lanes] <= least) end -= ray_lanes;
  if (first == end) return;
  const std::size_t count = end - first;
  const std::size_t candidate = b.view.size();
  const std::size_t needed = (candidate + 1) * ranking_.rays;
  for (auto* values : {&b.x, &b.y, &b.lod, &b.weight, &b.penalty})
    if (values->size() < needed) values->resize(2 * needed);
  const auto part = [&](std::vector<float>& values) {
    return std::span(values).subspan(candidate * ranking_.rays + first, count);
  };
  const RayAnswers answers{part(b.x), part(b.y), part(b.lod), part(b.weight), part(b.penalty)};
  answer(frame_.views[view], part_of(bundle_, first, count), frame_.options.penalty, frame_.depth_tolerance,
         worst_of(ranking_).subspan(first, count), answers);
  if (!add_candidate(ranking_, static_cast<std::int32_t>(candidate), first, answers.penalty)) return;
  b.view.push_back(view);
  worst_ = range_of(worst_of(ranking_));
}

// First the best of the rays before, whose penalties then show of most others by their bounds alone that they are not
// among the best here.
void TileRenderer::choose(const Bundle& bundle) {
  TileBuffers& b = buffers_;
  const std::size_t count = bundle.end - bundle.first;
  start_ranking(b.rays.bundle(bundle.first, count, frame_.wanted));
  for (const std::uint32_t view : b.likely) rank(view, 0);
  rank_all(b.near, bundle.box, bound_);
  rank_beyond(bundle);
  keep_best();
  std::copy_n(b.rays.pixel.begin() + static_cast<std::ptrdiff_t>(bundle.first), count, b.pixel.begin());
  hand_on();
}

// In rounds: each leaves fewer rays open, of a smaller box, and photos that could not win any more after the likely
// ones are not looked at.
void TileRenderer::rank_beyond(const Bundle& bundle) {
  float step = first_step;
  for (float bound = bound_; worst_.largest > bound; step *= step) {
    const RaysBox box = box_of_open(bundle, bound);
    bound = bound > 0 ? step * bound : infinite;
    rank_all(frame_.speaking, box, bound);
  }
}

// Of those rays that photos beyond the bound could speak for.
RaysBox TileRenderer::box_of_open(const Bundle& bundle, float bound) {
  const auto worst = worst_of(ranking_);
  TileRays& open = buffers_.some;
  open.resize(0);
  for (std::size_t i = 0; i < worst.size(); ++i) {
    if (worst[i] <= bound) continue;
    open.resize(open.size() + 1);
    open.copy(bundle.first + i, buffers_.rays, open.size() - 1);
  }
  open.fill_lanes(0);
  return box_of(open.bundle(0, open.size(), frame_.wanted), axes_);
}

void TileRenderer::hand_on() {
  TileBuffers& b = buffers_;
  ray_weights(ranking_, same_ray, b.chosen_weight);
  take_({std::span(b.pixel).first(ranking_.rays), ranking_.k, b.chosen_weight, b.least_candidate, b.view, b.x, b.y,
         b.lod, b.weight});
}

}  // namespace mf
