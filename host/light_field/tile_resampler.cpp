// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/tile_resampler.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace mf {

namespace {

constexpr int block_vertices = block_side / vertex_step;
constexpr std::size_t spare_views = 2;  // ranked beyond k, so that the k best of any texel are among its corners' lists
constexpr std::size_t spare_views_near_emitter = 26;  // there many views have no say
constexpr float same_ray = 1e-4F;                     // rays closer than this are the same
constexpr float largest_jump = 0.3F;                  // of the cell, see is_rough()
constexpr float largest_bend = 0.2F;                  // of what is seen, see is_smooth()
constexpr int outline_points = 3;                     // along a side: where it is tested who looks that way
constexpr float outline_margin = 0.3F;                // of the outline's size, for what lies between those points

Lanes all_lanes(float value) {
  Lanes lanes;
  lanes.v.fill(value);
  return lanes;
}

}  // namespace

TileResampler::TileResampler(const std::vector<FieldView>& views, const LightField& field,
                             const ProxyVisibility& visibility, const EmitterBlender& emitters,
                             const PenaltyOptions& penalty, int cell_splits)
    : views_(views),
      field_(field),
      visibility_(visibility),
      emitters_(emitters),
      sieve_(views),
      grid_(field.plane, field.resolution),
      penalty_(penalty),
      cell_splits_(cell_splits),
      blocks_((field.resolution + block_side - 1) / block_side),
      vertices_(blocks_ * block_vertices + 1),
      vertex_(static_cast<std::size_t>(vertices_ * vertices_)),
      best_lookers_(static_cast<std::size_t>((blocks_ + 1) * (blocks_ + 1))),
      reach_m_(best_lookers_.size(), 0) {}

void TileResampler::fill(std::size_t direction, Eigen::Vector4f* tile) {
  ++tile_count_;
  prepare(direction);
  find_lookers();
  for (int y = 0; y <= blocks_; ++y)
    for (int x = 0; x <= blocks_; ++x) rank_views(x, y);
  for (int y = 0; y < blocks_; ++y)
    for (int x = 0; x < blocks_; ++x) {
      gather_candidates(x, y);
      Lanes3 colour{};
      Lanes confidence{};
      if (near_emitter(x, y))
        blend_near_emitter(x, y, colour, confidence);
      else
        blend(x, y, colour, confidence);
      store_block(colour, confidence, x, y, field_.resolution, tile);
    }
  row_count_ += static_cast<std::uint32_t>(vertices_);
}

void TileResampler::prepare(std::size_t i) {
  const Eigen::Matrix3f world_from_plane = field_.plane.world_from_plane.rotation.toRotationMatrix().cast<float>();
  cell_.direction = world_from_plane * field_.directions.directions[i];
  cell_.parts = split_cell(field_.directions, i, cell_splits_, world_from_plane);
  cell_.angle_rad = std::sqrt(field_.directions.solid_angles_sr[i]);
  cell_.part_angle_rad = cell_.angle_rad / std::sqrt(static_cast<float>(cell_.parts.size()));
  bool emitter = false;
  for (int y = 0; y < vertices_; ++y)
    for (int x = 0; x < vertices_; ++x) {
      Vertex& v = vertex_[static_cast<std::size_t>(y * vertices_ + x)];
      v.p = grid_.at(static_cast<float>(x * vertex_step), static_cast<float>(y * vertex_step));
      v.focus = proxy_point(v.p, cell_.direction, field_.surroundings.inverse_distance_along(v.p, cell_.direction));
      emitter = emitter || emitters_.concerns(v.p, cell_.direction, cell_.angle_rad);
    }
  cell_.fine_parts.clear();
  if (!emitter) return;
  const int splits = splits_near_emitter(field_.directions.solid_angles_sr[i]);
  cell_.fine_parts = split_cell(field_.directions, i, splits, world_from_plane);
}

// The others see none of the tile's proxy points, as their outline in the view lies beside its picture.
void TileResampler::find_lookers() {
  std::array<ProxyPoint, static_cast<std::size_t>(outline_points * outline_points)> outline;
  for (int i = 0; i < outline_points * outline_points; ++i)
    outline[static_cast<std::size_t>(i)] = vertex(i % outline_points * (vertices_ - 1) / (outline_points - 1),
                                                  i / outline_points * (vertices_ - 1) / (outline_points - 1))
                                               .focus;
  sieve_.find(outline, outline_margin, cell_.angle_rad, lookers_.views);
  lookers_.centre_x.clear();
  lookers_.centre_y.clear();
  lookers_.centre_z.clear();
  for (const std::uint32_t v : lookers_.views) {
    const Eigen::Vector3f& centre = views_[v].centre_in_world;
    lookers_.centre_x.push_back(centre.x());
    lookers_.centre_y.push_back(centre.y());
    lookers_.centre_z.push_back(centre.z());
  }
  const std::size_t count = lookers_.views.size();
  bounds_.resize(std::max(bounds_.size(), count));
  looks_.resize(std::max(looks_.size(), count));
  mark_.resize(std::max(mark_.size(), count), 0);
  cells_.resize(std::max(cells_.size(), count));
  seen_.resize(std::max(seen_.size(), count * patch_side * static_cast<std::size_t>(vertices_)));
}

void TileResampler::rank_views(int corner_x, int corner_y) {
  const Vertex& v = vertex(corner_x * block_vertices, corner_y * block_vertices);
  squared_ray_distances(v.p, v.focus, lookers_.centre_x.data(), lookers_.centre_y.data(), lookers_.centre_z.data(),
                        lookers_.views.size(), bounds_.data());
  const auto announce = [&](std::size_t i) {
    const FieldView& view = views_[lookers_.views[i]];
    const Eigen::Vector3f pixel = pixel_of(view, v.focus);
    Look& look = looks_[i];
    look = {pixel.x() / pixel.z(), pixel.y() / pixel.z(), level_for_angle(view, v.focus, cell_.angle_rad)};
    if (pixel.z() <= 0)
      look.level = Look::nowhere;
    else
      view.expect(look.level, look.u, look.v);
  };
  const auto squared_penalty = [&](std::size_t i) {
    const FieldView& view = views_[lookers_.views[i]];
    const Look& look = looks_[i];
    if (look.level == Look::nowhere) return INFINITY;
    float weight = view.fetch(look.level, look.u, look.v).w();
    if (weight < smallest_view_weight) return INFINITY;
    weight *= visibility_.of_view(lookers_.views[i], v.focus);
    if (weight < smallest_view_weight) return INFINITY;
    // A lamp that is nearer than the proxy, or farther, shows elsewhere too, in views that pass by. Cells near it have
    // spare views instead: which of their parts a view may speak for is asked later.
    if (cell_.fine_parts.empty() && emitters_.shown_by(view, v.focus, cell_.angle_rad)) return INFINITY;
    const float penalty = penalty_of(penalty_, {std::sqrt(bounds_[i]), coarseness_of(view, v.focus), weight});
    return penalty * penalty;
  };
  const std::size_t spare = cell_.fine_parts.empty() ? spare_views : spare_views_near_emitter;
  const std::size_t corner = static_cast<std::size_t>(corner_y * (blocks_ + 1) + corner_x);
  auto& best = best_lookers_[corner];
  best.clear();
  float farthest = 0;
  for (const ViewPenalty& found :
       ranking_.find(bounds_.data(), lookers_.views.size(), static_cast<std::size_t>(penalty_.k) + spare,
                     squared_penalty, announce)) {
    best.push_back(found.view);
    farthest = std::max(farthest, bounds_[found.view]);
  }
  reach_m_[corner] = std::sqrt(farthest);
}

// The views that any corner of a block ranked among its best, each once.
void TileResampler::gather_candidates(int bx, int by) {
  ++block_count_;
  candidates_.clear();
  candidate_views_.clear();
  for (int corner = 0; corner < 4; ++corner)
    for (const std::uint32_t v :
         best_lookers_[static_cast<std::size_t>((by + corner / 2) * (blocks_ + 1) + bx + corner % 2)]) {
      if (mark_[v] == block_count_) continue;
      mark_[v] = block_count_;
      candidates_.push_back(v);
    }
  std::sort(candidates_.begin(), candidates_.end());  // sums in one order, however they were found
  for (const std::uint32_t v : candidates_) candidate_views_.push_back(lookers_.views[v]);
}

// Fetched once for the blocks that share a vertex: rows of blocks are filled one after the other.
const Eigen::Vector4f& TileResampler::seen_at(std::size_t looker, int x, int y) {
  const std::uint32_t stamp = row_count_ + static_cast<std::uint32_t>(y) + 1;
  Seen& seen =
      seen_[(looker * patch_side + static_cast<std::size_t>(y) % patch_side) * static_cast<std::size_t>(vertices_) +
            static_cast<std::size_t>(x)];
  if (seen.stamp != stamp) {
    const FieldView& view = views_[lookers_.views[looker]];
    const Vertex& at = vertex(x, y);
    seen.colour = emitters_.shown_by(view, at.focus, cell_.angle_rad)
                      ? Eigen::Vector4f(Eigen::Vector4f::Zero())
                      : Eigen::Vector4f(visibility_.of_view(lookers_.views[looker], at.focus) *
                                        cell_of(looker).seen(view, at.focus));
    seen.stamp = stamp;
  }
  return seen.colour;
}

const CellInView& TileResampler::cell_of(std::size_t looker) {
  LookersCell& known = cells_[looker];
  if (known.tile != tile_count_)
    known = {CellInView(views_[lookers_.views[looker]], cell_.direction, cell_.parts), tile_count_};
  return known.cell;
}

float TileResampler::coarseness_of(const FieldView& view, const ProxyPoint& x) const {
  if (penalty_.resolution == 0) return 0;
  const float pixels = cell_.part_angle_rad / ray_to(x, view.centre_in_world).norm() * view.focal_px;
  return coarseness(pixels * pixels, 1);
}

// penalty_of() at every texel. With the usual options it is the distance over the weight.
void TileResampler::penalize(const FieldView& view, const Lanes3& p, const Lanes4& focus, const Lanes& weight,
                             Lanes& penalty) const {
  distance_penalties(p, focus, view.centre_in_world, weight, penalty);
  if (penalty_.angle == 1 && penalty_.resolution == 0 && penalty_.border == 1) return;
  for (std::size_t i = 0; i < block_lanes; ++i) {
    if (weight.v[i] < smallest_view_weight) continue;
    const ProxyPoint x(focus.x.v[i], focus.y.v[i], focus.z.v[i], focus.w.v[i]);
    const float distance = penalty.v[i] * weight.v[i];
    penalty.v[i] = penalty_of(penalty_, {distance, coarseness_of(view, x), weight.v[i]});
  }
}

void TileResampler::blend(int bx, int by, Lanes3& colour, Lanes& confidence) {
  Rays rays;
  if (is_rough(bx, by)) {
    traced_rays(bx, by, rays);
    blend_texels(rays, colour, confidence);
    return;
  }
  interpolated_rays(bx, by, rays);
  see_vertices(bx, by);
  if (is_smooth())
    blend_patches(rays, colour, confidence);
  else
    blend_texels(rays, colour, confidence);
}

void TileResampler::interpolated_rays(int bx, int by, Rays& rays) const {
  Patch<Eigen::Vector4f> patch;
  const int x0 = bx * block_vertices, y0 = by * block_vertices;
  for (std::size_t i = 0; i < patch.size(); ++i)
    patch[i] = vertex(x0 + static_cast<int>(i % patch_side), y0 + static_cast<int>(i / patch_side)).focus;
  interpolate(patch, rays.focus);
  set_points(grid_.at(static_cast<float>(bx * block_side) + 0.5F, static_cast<float>(by * block_side) + 0.5F),
             grid_.step_x, grid_.step_y, rays.p);
}

void TileResampler::see_vertices(int bx, int by) {
  patches_.resize(candidates_.size());
  for (std::size_t c = 0; c < candidates_.size(); ++c)
    for (std::size_t i = 0; i < patches_[c].size(); ++i)
      patches_[c][i] = seen_at(candidates_[c], bx * block_vertices + static_cast<int>(i % patch_side),
                               by * block_vertices + static_cast<int>(i / patch_side));
}

// Whether what the views saw may be interpolated: a cell that moves over an edge gets brighter on a bent line, and half
// of a bend between two vertices shows at the vertices about it.
bool TileResampler::is_smooth() const {
  const auto bends = [](const Eigen::Vector4f& a, const Eigen::Vector4f& b, const Eigen::Vector4f& c) {
    const Eigen::Array4f bend = (a - 2 * b + c).array().abs(), sum = (a + 2 * b + c).array();
    return (bend > largest_bend * sum).any();
  };
  return std::none_of(patches_.begin(), patches_.end(), [&](const Patch<Eigen::Vector4f>& seen) {
    for (std::size_t i = 0; i < patch_side; ++i) {
      const std::size_t row = i * patch_side;
      if (bends(seen[row], seen[row + 1], seen[row + 2])) return true;
      if (bends(seen[i], seen[i + patch_side], seen[i + 2 * patch_side])) return true;
    }
    return false;
  });
}

// What was seen at the vertices, interpolated.
void TileResampler::blend_patches(const Rays& rays, Lanes3& colour, Lanes& confidence) {
  penalties_.resize(candidates_.size());
  weights_.resize(candidates_.size());
  for (std::size_t c = 0; c < candidates_.size(); ++c) {
    Patch<float> weight;
    for (std::size_t i = 0; i < weight.size(); ++i) weight[i] = patches_[c][i].w();
    interpolate(weight, weights_[c]);
    penalize(views_[candidate_views_[c]], rays.p, rays.focus, weights_[c], penalties_[c]);
  }
  weights_of(penalties_, weights_, penalty_.k, same_ray, confidence);
  for (std::size_t c = 0; c < candidates_.size(); ++c) add_colours(patches_[c], penalties_[c], colour);
}

// ---- where the proxy's distance jumps ----

// Whether the proxy's distance changes so much from one vertex to the next that a view's pixel moves by a good part of
// the cell: of views that pass the ray at a distance d, a change of inverse distance Δs moves it by d Δs.
bool TileResampler::is_rough(int bx, int by) const {
  float reach = 0;
  for (int corner = 0; corner < 4; ++corner)
    reach = std::max(reach, reach_m_[static_cast<std::size_t>((by + corner / 2) * (blocks_ + 1) + bx + corner % 2)]);
  const float most = largest_jump * cell_.angle_rad / std::max(reach, 1e-6F);
  const int x0 = bx * block_vertices, y0 = by * block_vertices;
  for (int y = y0; y <= y0 + block_vertices; ++y)
    for (int x = x0; x <= x0 + block_vertices; ++x) {
      const float here = vertex(x, y).focus.w();
      if (x < x0 + block_vertices && std::abs(vertex(x + 1, y).focus.w() - here) > most) return true;
      if (y < y0 + block_vertices && std::abs(vertex(x, y + 1).focus.w() - here) > most) return true;
    }
  return false;
}

void TileResampler::traced_rays(int bx, int by, Rays& rays) const {
  set_points(grid_.at(static_cast<float>(bx * block_side) + 0.5F, static_cast<float>(by * block_side) + 0.5F),
             grid_.step_x, grid_.step_y, rays.p);
  for (std::size_t i = 0; i < block_lanes; ++i) {
    const Eigen::Vector3f p(rays.p.x.v[i], rays.p.y.v[i], rays.p.z.v[i]);
    const ProxyPoint x =
        proxy_point(p, cell_.direction, field_.surroundings.inverse_distance_along(p, cell_.direction));
    rays.focus.x.v[i] = x.x();
    rays.focus.y.v[i] = x.y();
    rays.focus.z.v[i] = x.z();
    rays.focus.w.v[i] = x.w();
  }
}

// Every texel by itself. Most candidates pass a texel's ray too far off to speak for it, and a view's weight can only
// add to its penalty. So the k + 1 that pass it nearest are asked first, then those that pass it nearer than the
// greatest penalty of these.
void TileResampler::blend_texels(const Rays& rays, Lanes3& colour, Lanes& confidence) {
  const std::size_t count = candidates_.size(), speaking = static_cast<std::size_t>(penalty_.k) + 1;
  seen_lanes_.resize(count);
  distances_.resize(count);
  penalties_.assign(count, all_lanes(std::numeric_limits<float>::infinity()));
  weights_.assign(count, all_lanes(0));
  LeastLanes nearest(speaking), best(speaking);
  for (std::size_t c = 0; c < count; ++c) {
    distance_penalties(rays.p, rays.focus, views_[candidate_views_[c]].centre_in_world, all_lanes(1), distances_[c]);
    nearest.add(distances_[c]);
  }
  const auto ask = [&](std::size_t c, const auto& is_needed) {
    const FieldView& view = views_[candidate_views_[c]];
    const auto shows_emitter = [&](std::size_t i) {
      return emitters_.shown_by(view, {rays.focus.x.v[i], rays.focus.y.v[i], rays.focus.z.v[i], rays.focus.w.v[i]},
                                cell_.angle_rad);
    };
    Lanes needed;
    float any = 0;
    for (std::size_t i = 0; i < block_lanes; ++i) {
      needed.v[i] = is_needed(i) && !shows_emitter(i) ? 1.0F : 0.0F;
      any += needed.v[i];
    }
    if (any == 0) return;
    cell_of(candidates_[c]).seen(view, rays.focus, needed, seen_lanes_[c], weights_[c]);
    if (visibility_.hides_itself()) dim_hidden(candidate_views_[c], rays.focus, seen_lanes_[c], weights_[c]);
    penalize(view, rays.p, rays.focus, weights_[c], penalties_[c]);
  };
  const Lanes& reach = nearest.greatest();
  for (std::size_t c = 0; c < count; ++c) {
    ask(c, [&](std::size_t i) { return distances_[c].v[i] <= reach.v[i]; });
    best.add(penalties_[c]);
  }
  for (std::size_t c = 0; c < count; ++c)
    ask(c, [&](std::size_t i) { return distances_[c].v[i] > reach.v[i] && distances_[c].v[i] < best.greatest().v[i]; });
  weights_of(penalties_, weights_, penalty_.k, same_ray, confidence);
  for (std::size_t c = 0; c < count; ++c) add_colours(seen_lanes_[c], penalties_[c], colour);
}

// What the view saw of each texel's ray, as far as it sees that past the proxy.
void TileResampler::dim_hidden(std::uint32_t view, const Lanes4& focus, Lanes3& seen, Lanes& weight) const {
  for (std::size_t i = 0; i < block_lanes; ++i) {
    if (weight.v[i] < smallest_view_weight) continue;
    const float share = visibility_.of_view(view, {focus.x.v[i], focus.y.v[i], focus.z.v[i], focus.w.v[i]});
    weight.v[i] *= share;
    seen.x.v[i] *= share;
    seen.y.v[i] *= share;
    seen.z.v[i] *= share;
  }
}

// ---- near emitters ----

bool TileResampler::near_emitter(int bx, int by) const {
  if (cell_.fine_parts.empty()) return false;
  for (int y = 0; y <= block_vertices; ++y)
    for (int x = 0; x <= block_vertices; ++x)
      if (emitters_.concerns(vertex(bx * block_vertices + x, by * block_vertices + y).p, cell_.direction,
                             cell_.angle_rad))
        return true;
  return false;
}

// Mean over the cell's parts of colour · weight, and of weight. Parts beside an emitter of which no view speaks (each
// shows its glare there) are as those that are known, never as the emitter itself.
Eigen::Vector4f TileResampler::mean_near_emitter(const Eigen::Vector3f& p) const {
  const std::vector<CellSample>& parts =
      may_meet_emitter(emitters_.emitters(), p, cell_.direction, cell_.angle_rad) ? cell_.fine_parts : cell_.parts;
  const float part_angle = cell_.angle_rad / std::sqrt(static_cast<float>(parts.size()));
  Eigen::Vector4f on_emitter = Eigen::Vector4f::Zero(), beside = Eigen::Vector4f::Zero();
  float solid_angle = 0, all_beside = 0, unknown_beside = 0;
  for (const CellSample& part : parts) {
    const ShadedEmitter* const met = emitter_met(emitters_.emitters(), p, part.direction);
    const Eigen::Vector4f seen = emitters_.radiance(met, p, part.direction, part_angle, candidate_views_);
    const Eigen::Vector4f weighted = part.solid_angle_sr * seen.w() * Eigen::Vector4f(seen.x(), seen.y(), seen.z(), 1);
    solid_angle += part.solid_angle_sr;
    if (met != nullptr) {
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
void TileResampler::blend_near_emitter(int bx, int by, Lanes3& colour, Lanes& confidence) {
  Patch<Eigen::Vector4f> mean;
  for (std::size_t i = 0; i < mean.size(); ++i)
    mean[i] = mean_near_emitter(vertex(bx * block_vertices + static_cast<int>(i % patch_side),
                                       by * block_vertices + static_cast<int>(i / patch_side))
                                    .p);
  Lanes4 sum;
  interpolate(mean, sum);
  confidence = sum.w;
  for (std::size_t i = 0; i < block_lanes; ++i) {
    const float inverse = sum.w.v[i] > 0 ? 1 / sum.w.v[i] : 0;
    colour.x.v[i] = sum.x.v[i] * inverse;
    colour.y.v[i] = sum.y.v[i] * inverse;
    colour.z.v[i] = sum.z.v[i] * inverse;
  }
}

}  // namespace mf
