// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/emitter_blender.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "host/blending/view_weights.h"
#include "host/light_field/occluder_mask.h"
#include "host/light_field/view_ranking.h"
#include "host/light_field/view_rays.h"

namespace mf {

namespace {

constexpr int most_views = 4;             // that speak for a ray: the fewer, the sharper an occluder's edge
constexpr float ghost_margin = 1.25F;     // times the radius: what a view sees this near to the ball shows its glare
constexpr float ghost_reach_m = 0.12F;    // as far beside an emitter a blended view may still show it
constexpr float smallest_weight = 0.02F;  // a view that shows less than this of the ray does not speak for it
constexpr float same_ray_m = 1e-3F;

// What is asked of views.
struct Question {
  const ShadedEmitter* met;  // that the ray meets; else views that show one have no say
  Eigen::Vector3f p;
  ProxyPoint x;
  float angle_rad;
};

struct Answer {
  float penalty = 0;
  Eigen::Vector4f seen;  // premultiplied
};

// `distance` of the view's ray from p. Returns whether the view has a say.
bool ask(const EmitterBlender& blender, const Question& q, const FieldView& view, float distance,
         std::vector<Answer>& answers) {
  if (q.met == nullptr && blender.shown_by(view, q.x, q.angle_rad)) return false;
  const Eigen::Vector3f pixel = pixel_of(view, q.x);
  if (pixel.z() <= 0) return false;
  const Eigen::Vector4f seen =
      view.fetch(level_for_angle(view, q.x, q.angle_rad), pixel.x() / pixel.z(), pixel.y() / pixel.z());
  if (seen.w() < smallest_weight) return false;
  answers.push_back({distance / seen.w(), seen});
  return true;
}

// Asks the views that pass p nearest, until no other can be among the few that speak or set their threshold: a view's
// weight, at most 1, only adds to its penalty.
void ask_nearest(const EmitterBlender& blender, const Question& q, const std::vector<FieldView>& views,
                 std::span<const std::uint32_t> candidates, std::vector<Answer>& answers) {
  thread_local std::vector<ViewPenalty> waiting;  // a heap, the nearest first
  waiting.clear();
  for (const std::uint32_t v : candidates) waiting.push_back({v, ray_distance(q.p, q.x, views[v].centre_in_world)});
  const auto farther = [](const ViewPenalty& a, const ViewPenalty& b) { return ranks_before(b, a); };
  std::make_heap(waiting.begin(), waiting.end(), farther);
  std::array<float, most_views + 1> least;  // penalties, rising
  least.fill(std::numeric_limits<float>::infinity());
  while (!waiting.empty() && waiting.front().penalty < least.back()) {
    const ViewPenalty nearest = waiting.front();
    std::pop_heap(waiting.begin(), waiting.end(), farther);
    waiting.pop_back();
    if (!ask(blender, q, views[nearest.view], nearest.penalty, answers)) continue;
    least.back() = std::min(least.back(), answers.back().penalty);
    std::sort(least.begin(), least.end());
  }
}

float log_luminance(const Eigen::Vector4f& seen) {
  return std::log2(std::max(shown_luminance(seen), 1e-3F));
}

// The emitter's own radiance: the median of what views show of its centre where nothing hides it, since occluders only
// darken.
Eigen::Vector3f unhidden_radiance(const std::vector<FieldView>& views, const Emitter& e) {
  std::vector<std::pair<float, Eigen::Vector3f>> seen_by;
  for (const FieldView& view : views) {
    const ProxyPoint x = e.position.homogeneous();
    const Eigen::Vector3f pixel = pixel_of(view, x);
    if (pixel.z() <= 0) continue;
    const float angle = 0.4F * e.radius_m;  // of a point scaled to w = 1: metres across
    const Eigen::Vector4f seen =
        view.fetch(level_for_angle(view, x, angle), pixel.x() / pixel.z(), pixel.y() / pixel.z());
    if (seen.w() > 0.5F) seen_by.emplace_back(log_luminance(seen), seen.head<3>() / seen.w());
  }
  if (seen_by.empty()) return Eigen::Vector3f::Zero();
  std::sort(seen_by.begin(), seen_by.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  constexpr float half = 1;  // stop: darker than this below the upper quartile is hidden at least in part
  const float upper = seen_by[3 * seen_by.size() / 4].first;
  const auto lit = std::find_if(seen_by.begin(), seen_by.end(), [&](const auto& s) { return s.first > upper - half; });
  return (lit + (seen_by.end() - lit) / 2)->second;
}

}  // namespace

int splits_near_emitter(float cell_solid_angle_sr) {
  constexpr float largest_part_sr = 6e-5F;  // a cell of 2500 directions in 48 parts
  constexpr int fewest = 3, most = 7;
  return std::clamp(static_cast<int>(std::ceil(std::log2(cell_solid_angle_sr / (6 * largest_part_sr)))), fewest, most);
}

EmitterBlender::EmitterBlender(const std::vector<FieldView>& views, const Surroundings& surroundings,
                               std::span<const Emitter> emitters, const PlaneRectangle& rectangle, const Team& team)
    : views_(views), surroundings_(surroundings) {
  for (const Emitter& emitter : emitters) {
    ShadedEmitter shaded;
    shaded.emitter = emitter;
    shaded.radiance = unhidden_radiance(views, emitter);
    shaded.plane_height_m = static_cast<float>(rectangle.world_from_plane.translation.z());
    draw_occluders(views, rectangle, team, shaded);
    emitters_.push_back(std::move(shaded));
  }
}

EmitterBlender::EmitterBlender(const std::vector<FieldView>& views, const Surroundings& surroundings,
                               std::vector<ShadedEmitter> emitters, Lit lit)
    : views_(views), surroundings_(surroundings), emitters_(std::move(emitters)), lit_(lit) {}

std::uint32_t EmitterBlender::concerned(const Eigen::Vector3f& p, const Eigen::Vector3f& direction,
                                        float angle_rad) const {
  const auto found = std::find_if(emitters_.begin(), emitters_.end(), [&](const ShadedEmitter& s) {
    const Eigen::Vector3f to = s.emitter.position - p;
    const float reach = (s.emitter.radius_m + ghost_reach_m) / to.norm() + angle_rad;
    return to.dot(direction) > 0 && to.cross(direction).norm() < reach * to.norm();
  });
  return found == emitters_.end() ? 0 : 1 + static_cast<std::uint32_t>(found - emitters_.begin());
}

bool EmitterBlender::shown_by(const FieldView& view, const ProxyPoint& x, float angle_rad) const {
  if (emitters_.empty()) return false;
  const Eigen::Vector3f ray = ray_to(x, view.centre_in_world);
  const float length = ray.norm();
  return std::any_of(emitters_.begin(), emitters_.end(), [&](const ShadedEmitter& s) {
    const Eigen::Vector3f to = s.emitter.position - view.centre_in_world;
    const float along = to.dot(ray) / length;
    // Half of the footprint, and as much for the filter that fetched it.
    const float reach = ghost_margin * s.emitter.radius_m + angle_rad / length * along;
    return along > 0 && to.squaredNorm() - along * along < reach * reach;
  });
}

Eigen::Vector4f EmitterBlender::radiance(const ShadedEmitter* met, const Eigen::Vector3f& p,
                                         const Eigen::Vector3f& direction, float angle_rad,
                                         std::span<const std::uint32_t> candidates) const {
  thread_local std::vector<Answer> answers;  // called for every part of many cells: no allocation each time
  answers.clear();
  if (met != nullptr) {
    const auto visible = met->visibility(p, direction);
    if (visible && lit_ == Lit::no) return {0, 0, 0, 1};
    if (visible) {
      const Eigen::Vector3f colour = *visible * met->radiance;
      return {colour.x(), colour.y(), colour.z(), 1};
    }
  }
  const Question question{met, p, proxy_point(p, direction, surroundings_.inverse_distance_along(p, direction)),
                          angle_rad};
  ask_nearest(*this, question, views_, candidates, answers);
  std::array<ViewWeight, most_views> weights;
  thread_local std::vector<ViewPenalty> ranked;
  ranked.clear();
  for (std::uint32_t i = 0; i < answers.size(); ++i) ranked.push_back({i, answers[i].penalty});
  const std::size_t speaking = blend_weights(ranked, most_views, same_ray_m, weights);
  Eigen::Vector4f colour = Eigen::Vector4f::Zero();
  float confidence = 0;
  for (std::size_t i = 0; i < speaking; ++i) {
    const Eigen::Vector4f& seen = answers[weights[i].view].seen;
    colour += weights[i].weight / seen.w() * seen;
    confidence += seen.w();
  }
  return {colour.x(), colour.y(), colour.z(), std::min(1.0F, confidence)};
}

}  // namespace mf
