// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/tile_resampler.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

namespace mf {

namespace {

constexpr int vertex_step = 4;     // texels between vertices
constexpr int block_vertices = 2;  // vertex steps along a block: all views are ranked at its corners
constexpr int block_step = vertex_step * block_vertices;
constexpr int patch = block_vertices + 1;  // vertices along a block, both ends counted
constexpr std::size_t spare_views = 4;  // ranked beyond k, so that the k best of any texel are among its corners' lists
constexpr std::size_t spare_views_near_emitter = 26;  // there many views have no say
constexpr int fine_splits = 3;                        // and a cell near an emitter in 6 · 2³
constexpr int cell_splits = 1;                        // a cell is fetched in 6 · 2¹ parts
constexpr float smallest_weight = 0.02F;  // a view that shows less than this of the cell does not speak for it
constexpr float same_ray = 1e-4F;         // metres (plane proxy: radians): rays closer than this are the same

}  // namespace

TileResampler::TileResampler(const std::vector<FieldView>& views, const LightField& field,
                             const EmitterBlender& emitters, const PenaltyOptions& penalty)
    : views_(views),
      field_(field),
      emitters_(emitters),
      penalty_(penalty),
      blocks_((field.resolution + block_step - 1) / block_step),
      vertices_(blocks_ * block_vertices + 1),
      vertex_(static_cast<std::size_t>(vertices_ * vertices_)),
      best_views_(static_cast<std::size_t>((blocks_ + 1) * (blocks_ + 1))),
      mark_(views.size(), 0),
      weights_(static_cast<std::size_t>(penalty.k)) {}

void TileResampler::fill(std::size_t direction, Eigen::Vector4f* tile) {
  prepare(direction);
  for (int y = 0; y <= blocks_; ++y)
    for (int x = 0; x <= blocks_; ++x) rank_views(x, y);
  const int n = field_.resolution;
  for (int by = 0; by < blocks_; ++by)
    for (int bx = 0; bx < blocks_; ++bx) {
      gather_candidates(bx, by);
      if (near_emitter(bx, by)) {
        fill_near_emitter(bx, by, tile);
        continue;
      }
      fetch_candidates(bx, by);
      for (int y = by * block_step; y < std::min(n, (by + 1) * block_step); ++y)
        for (int x = bx * block_step; x < std::min(n, (bx + 1) * block_step); ++x) tile[y * n + x] = blend(x, y);
    }
}

void TileResampler::prepare(std::size_t i) {
  const Eigen::Matrix3f world_from_plane = field_.plane.world_from_plane.rotation.toRotationMatrix().cast<float>();
  cell_.direction = world_from_plane * field_.directions.directions[i];
  cell_.parts = split_cell(field_.directions, i, cell_splits);
  for (CellSample& part : cell_.parts) part.direction = world_from_plane * part.direction;
  cell_.angle_rad = std::sqrt(field_.directions.solid_angles_sr[i]);
  cell_.part_angle_rad = cell_.angle_rad / std::sqrt(static_cast<float>(cell_.parts.size()));
  bool emitter = false;
  for (int y = 0; y < vertices_; ++y)
    for (int x = 0; x < vertices_; ++x) {
      Vertex& v = vertex_[static_cast<std::size_t>(y * vertices_ + x)];
      v.p = point(static_cast<float>(x * vertex_step), static_cast<float>(y * vertex_step));
      v.focus = focus(v.p);
      emitter = emitter || emitters_.concerns(v.p, cell_.direction, cell_.angle_rad);
    }
  cell_.fine_parts.clear();
  if (!emitter || field_.surroundings.is_plane()) return;
  cell_.fine_parts = split_cell(field_.directions, i, fine_splits);
  for (CellSample& part : cell_.fine_parts) part.direction = world_from_plane * part.direction;
}

bool TileResampler::near_emitter(int bx, int by) const {
  if (cell_.fine_parts.empty()) return false;
  for (int y = 0; y < patch; ++y)
    for (int x = 0; x < patch; ++x)
      if (emitters_.concerns(
              vertex_[static_cast<std::size_t>((by * block_vertices + y) * vertices_ + bx * block_vertices + x)].p,
              cell_.direction, cell_.angle_rad))
        return true;
  return false;
}

// Mean over the cell's parts of colour · weight, and of weight. Parts beside an emitter of which no view speaks (each
// shows its glare there) are as those that are known, never as the emitter itself.
Eigen::Vector4f TileResampler::mean_near_emitter(const Eigen::Vector3f& p, float part_angle) const {
  Eigen::Vector4f on_emitter = Eigen::Vector4f::Zero(), beside = Eigen::Vector4f::Zero();
  float solid_angle = 0, all_beside = 0, unknown_beside = 0;
  for (const CellSample& part : cell_.fine_parts) {
    const Eigen::Vector4f seen = emitters_.radiance(p, part.direction, part_angle, candidates_);
    const Eigen::Vector4f weighted = part.solid_angle_sr * seen.w() * Eigen::Vector4f(seen.x(), seen.y(), seen.z(), 1);
    solid_angle += part.solid_angle_sr;
    if (emitters_.unhidden(p, part.direction)) {
      on_emitter += weighted;
      continue;
    }
    beside += weighted;
    all_beside += part.solid_angle_sr;
    if (seen.w() <= 0) unknown_beside += part.solid_angle_sr;
  }
  if (unknown_beside < all_beside) beside *= all_beside / (all_beside - unknown_beside);
  if (unknown_beside == all_beside) beside.w() = all_beside;  // nothing known: dark, against the emitter
  return (on_emitter + beside) / solid_angle;
}

// Each part of the cell is blended by itself, at the block's vertices; texels are interpolated.
void TileResampler::fill_near_emitter(int bx, int by, Eigen::Vector4f* tile) {
  std::array<Eigen::Vector4f, patch * patch> mean;
  const float part_angle = cell_.angle_rad / std::sqrt(static_cast<float>(cell_.fine_parts.size()));
  for (std::size_t n = 0; n < mean.size(); ++n) {
    const int x = static_cast<int>(n) % patch, y = static_cast<int>(n) / patch;
    const Vertex& v =
        vertex_[static_cast<std::size_t>((by * block_vertices + y) * vertices_ + bx * block_vertices + x)];
    mean[n] = mean_near_emitter(v.p, part_angle);
  }
  const int size = field_.resolution;
  for (int y = by * block_step; y < std::min(size, (by + 1) * block_step); ++y)
    for (int x = bx * block_step; x < std::min(size, (bx + 1) * block_step); ++x) {
      const float u = (static_cast<float>(x - bx * block_step) + 0.5F) / vertex_step;
      const float v = (static_cast<float>(y - by * block_step) + 0.5F) / vertex_step;
      const int i = static_cast<int>(u), j = static_cast<int>(v);
      const float fu = u - static_cast<float>(i), fv = v - static_cast<float>(j);
      const Eigen::Vector4f* at = &mean[static_cast<std::size_t>(j * patch + i)];
      const Eigen::Vector4f sum =
          (at[0] * (1 - fu) + at[1] * fu) * (1 - fv) + (at[patch] * (1 - fu) + at[patch + 1] * fu) * fv;
      Eigen::Vector4f& texel = tile[y * size + x];
      texel = Eigen::Vector4f::Zero();
      if (sum.w() > 0) texel << sum.head<3>() / sum.w(), sum.w();
    }
}

// World point of a texel position (texel centres at +0.5; row 0 at max y).
Eigen::Vector3f TileResampler::point(float texel_x, float texel_y) const {
  const double n = field_.resolution;
  const Eigen::Vector2d size = field_.plane.size_m();
  const Eigen::Vector3d p(field_.plane.min_m.x() + static_cast<double>(texel_x) / n * size.x(),
                          field_.plane.max_m.y() - static_cast<double>(texel_y) / n * size.y(), 0);
  return (field_.plane.world_from_plane * p).cast<float>();
}

ProxyPoint TileResampler::focus(const Eigen::Vector3f& p) const {
  if (field_.surroundings.is_plane()) return p.homogeneous();
  return proxy_point(p, cell_.direction, field_.surroundings.inverse_distance_along(p, cell_.direction));
}

// Plane as proxy: the angle between the wanted and the captured ray. Else: how far the captured ray passes by.
float TileResampler::penalty(const FieldView& view, const Eigen::Vector3f& p, const ProxyPoint& x,
                             float weight) const {
  const Eigen::Vector3f ray = ray_to(x, view.centre_in_world);
  RayTerms terms;
  terms.weight = weight;
  terms.angle = field_.surroundings.is_plane() ? std::atan2(ray.cross(cell_.direction).norm(), ray.dot(cell_.direction))
                                               : ray_distance(p, x, view.centre_in_world);
  if (penalty_.resolution > 0) {
    const float pixels = cell_.part_angle_rad / ray.norm() * view.focal_px;
    terms.resolution = coarseness(pixels * pixels, 1);
  }
  return penalty_of(penalty_, terms);
}

void TileResampler::rank_views(int corner_x, int corner_y) {
  const Vertex& v =
      vertex_[static_cast<std::size_t>(corner_y * block_vertices * vertices_ + corner_x * block_vertices)];
  ranked_.clear();
  for (std::uint32_t i = 0; i < views_.size(); ++i) {
    const Eigen::Vector3f pixel = pixel_of(views_[i], v.focus);
    if (pixel.z() <= 0) continue;
    const int level = field_.surroundings.is_plane() ? 0 : level_for_angle(views_[i], v.focus, cell_.angle_rad);
    const float weight = views_[i].fetch(level, pixel.x() / pixel.z(), pixel.y() / pixel.z()).w();
    if (weight >= smallest_weight) ranked_.push_back({i, penalty(views_[i], v.p, v.focus, weight)});
  }
  const std::size_t spare = cell_.fine_parts.empty() ? spare_views : spare_views_near_emitter;
  const std::size_t kept = std::min(static_cast<std::size_t>(penalty_.k) + spare, ranked_.size());
  std::partial_sort(ranked_.begin(), ranked_.begin() + static_cast<std::ptrdiff_t>(kept), ranked_.end(),
                    [](const ViewPenalty& a, const ViewPenalty& b) { return a.penalty < b.penalty; });
  auto& best = best_views_[static_cast<std::size_t>(corner_y * (blocks_ + 1) + corner_x)];
  best.clear();
  for (std::size_t i = 0; i < kept; ++i) best.push_back(ranked_[i].view);
}

// The views that any corner of a block ranked among its best, each once.
void TileResampler::gather_candidates(int bx, int by) {
  ++block_count_;
  block_x_ = bx;
  block_y_ = by;
  candidates_.clear();
  for (int corner = 0; corner < 4; ++corner)
    for (const std::uint32_t v :
         best_views_[static_cast<std::size_t>((by + corner / 2) * (blocks_ + 1) + bx + corner % 2)]) {
      if (mark_[v] == block_count_) continue;
      mark_[v] = block_count_;
      candidates_.push_back(v);
    }
}

void TileResampler::fetch_candidates(int bx, int by) {
  seen_.resize(candidates_.size() * patch * patch);
  seen_here_.resize(candidates_.size());
  std::size_t n = 0;
  for (const std::uint32_t view : candidates_)
    for (int y = 0; y < patch; ++y)
      for (int x = 0; x < patch; ++x)
        seen_[n++] = fetch_cell(
            views_[view],
            vertex_[static_cast<std::size_t>((by * block_vertices + y) * vertices_ + bx * block_vertices + x)]);
}

// Mean over the cell of what one view saw of it: premultiplied colour and weight.
Eigen::Vector4f TileResampler::fetch_cell(const FieldView& view, const Vertex& v) const {
  if (field_.surroundings.is_plane()) {
    const Eigen::Vector3f pixel = pixel_of(view, v.focus);
    if (pixel.z() <= 0) return Eigen::Vector4f::Zero();
    // The paper's fetch has no cell to average: a point of the plane is one pixel of the view. A texel's size serves.
    const float texel_m = static_cast<float>(field_.plane.size_m().maxCoeff()) / static_cast<float>(field_.resolution);
    return view.fetch(level_for_angle(view, v.focus, texel_m), pixel.x() / pixel.z(), pixel.y() / pixel.z());
  }
  const int level = level_for_angle(view, v.focus, cell_.part_angle_rad);
  const Eigen::Matrix3f turn = view.pixel_from_world.leftCols<3>();
  const Eigen::Vector3f base = v.focus.w() * (turn * v.p + view.pixel_from_world.col(3));
  Eigen::Vector4f sum = Eigen::Vector4f::Zero();
  float solid_angle = 0;
  for (const CellSample& part : cell_.parts) {
    const Eigen::Vector3f pixel = base + turn * part.direction;
    solid_angle += part.solid_angle_sr;
    if (pixel.z() > 0) sum += part.solid_angle_sr * view.fetch(level, pixel.x() / pixel.z(), pixel.y() / pixel.z());
  }
  return sum / solid_angle;
}

Eigen::Vector4f TileResampler::blend(int x, int y) {
  // Where the texel's centre lies in the block's patch of vertices.
  const float u = (static_cast<float>(x - block_x_ * block_step) + 0.5F) / vertex_step;
  const float v = (static_cast<float>(y - block_y_ * block_step) + 0.5F) / vertex_step;
  const int i = static_cast<int>(u), j = static_cast<int>(v);
  const float fu = u - static_cast<float>(i), fv = v - static_cast<float>(j);
  const Vertex* corner =
      &vertex_[static_cast<std::size_t>((block_y_ * block_vertices + j) * vertices_ + block_x_ * block_vertices + i)];
  const auto interpolate = [&](const auto& a, const auto& b, const auto& c, const auto& d) {
    return ((a * (1 - fu) + b * fu) * (1 - fv) + (c * (1 - fu) + d * fu) * fv).eval();
  };
  const Eigen::Vector3f p = interpolate(corner[0].p, corner[1].p, corner[vertices_].p, corner[vertices_ + 1].p);
  const ProxyPoint x_focus =
      interpolate(corner[0].focus, corner[1].focus, corner[vertices_].focus, corner[vertices_ + 1].focus);
  ranked_.clear();
  for (std::uint32_t c = 0; c < candidates_.size(); ++c) {
    const Eigen::Vector4f* at = &seen_[c * patch * patch + static_cast<std::size_t>(j * patch + i)];
    seen_here_[c] = interpolate(at[0], at[1], at[patch], at[patch + 1]);
    if (seen_here_[c].w() >= smallest_weight)
      ranked_.push_back({c, penalty(views_[candidates_[c]], p, x_focus, seen_here_[c].w())});
  }
  const std::size_t speaking = blend_weights(ranked_, penalty_.k, same_ray, weights_);
  Eigen::Vector4f colour = Eigen::Vector4f::Zero();
  float confidence = 0;
  for (std::size_t s = 0; s < speaking; ++s) {
    const Eigen::Vector4f& seen = seen_here_[weights_[s].view];
    colour += weights_[s].weight / seen.w() * seen;
    confidence += seen.w();
  }
  return {colour.x(), colour.y(), colour.z(), std::min(1.0F, confidence)};
}

}  // namespace mf
