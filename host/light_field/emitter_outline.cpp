// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/emitter_outline.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "host/light_field/view_rays.h"

namespace mf {

namespace {

constexpr int azimuths = 16;
constexpr int steps = 36;             // along a radius
constexpr float reach = 1.8F;         // times the radius of the start
constexpr double unhidden = 0.8;      // of the views at a place, ordered by brightness: occluders only darken
constexpr std::size_t fewest = 6;     // views that look at a place
constexpr float clear_weight = 0.8F;  // a view that shows less of a place is at its own border

// What the views' brighter part shows at an offset from the emitter's centre, in the frame across each view's line of
// sight whose first axis is level: all views of a plane look up at a lamp from one side, and agree on it nearly.
std::optional<float> shown_at(const std::vector<FieldView>& views, const Emitter& e, const Eigen::Vector2f& offset_m) {
  std::vector<float> seen_by;
  for (const FieldView& view : views) {
    const Eigen::Vector3f to = (e.position - view.centre_in_world).normalized();
    const Eigen::Vector3f level = to.cross(Eigen::Vector3f::UnitZ());
    if (level.norm() < 1e-3F) continue;  // straight overhead: no azimuth
    const Eigen::Vector3f across = level.normalized();
    const Eigen::Vector3f point = e.position + offset_m.x() * across + offset_m.y() * across.cross(to);
    const Eigen::Vector3f pixel = pixel_of(view, point.homogeneous());
    if (pixel.z() <= 0) continue;
    const Eigen::Vector4f seen = view.fetch(0, pixel.x() / pixel.z(), pixel.y() / pixel.z());
    if (seen.w() >= clear_weight) seen_by.push_back(shown_luminance(seen));
  }
  if (seen_by.size() < fewest) return std::nullopt;
  const auto at = seen_by.begin() + static_cast<std::ptrdiff_t>(unhidden * static_cast<double>(seen_by.size() - 1));
  std::nth_element(seen_by.begin(), at, seen_by.end());
  return *at;
}

Eigen::Vector2f spoke(int azimuth) {
  const float angle = static_cast<float>(azimuth) * 2 * std::numbers::pi_v<float> / azimuths;
  return {std::cos(angle), std::sin(angle)};
}

// Radiance along each spoke, nothing where too few views look.
using Profile = std::array<std::optional<float>, steps>;
std::array<Profile, azimuths> profiles_of(const std::vector<FieldView>& views, const Emitter& e, float step_m) {
  std::array<Profile, azimuths> profiles;
  for (int a = 0; a < azimuths; ++a)
    for (int i = 0; i < steps; ++i)
      profiles[static_cast<std::size_t>(a)][static_cast<std::size_t>(i)] =
          shown_at(views, e, (static_cast<float>(i) + 0.5F) * step_m * spoke(a));
  return profiles;
}

// The lamp's own level: the median over its inner half.
std::optional<float> level_of(const std::array<Profile, azimuths>& profiles) {
  constexpr auto inner = static_cast<std::ptrdiff_t>(0.5F / reach * steps);
  std::vector<float> shown;
  for (const Profile& profile : profiles)
    for (auto value = profile.begin(); value != profile.begin() + inner; ++value)
      if (*value) shown.push_back(**value);
  if (shown.empty()) return std::nullopt;
  const auto middle = shown.begin() + static_cast<std::ptrdiff_t>(shown.size() / 2);
  std::nth_element(shown.begin(), middle, shown.end());
  return *middle;
}

// Where a profile falls to half for the last time, in steps; nothing when it never reaches half or never falls.
std::optional<float> edge_of(const Profile& profile, float half) {
  for (std::size_t i = steps - 1; i-- > 0;) {
    if (!profile[i] || !profile[i + 1] || *profile[i] < half) continue;
    if (*profile[i + 1] >= half) return std::nullopt;
    return static_cast<float>(i) + 0.5F + (*profile[i] - half) / (*profile[i] - *profile[i + 1]);
  }
  return std::nullopt;
}

struct Outline {
  float radius_m = 0;  // of a disc of its area
  Eigen::Vector2f centre_m = Eigen::Vector2f::Zero();
};

std::optional<Outline> outline_of(const std::vector<FieldView>& views, const Emitter& e, float step_m) {
  const auto profiles = profiles_of(views, e, step_m);
  const std::optional<float> level = level_of(profiles);
  if (!level) return std::nullopt;
  Outline outline;
  float squares = 0;
  int found = 0;
  for (int a = 0; a < azimuths; ++a) {
    const std::optional<float> edge = edge_of(profiles[static_cast<std::size_t>(a)], 0.5F * *level);
    if (!edge) continue;
    const float radius = *edge * step_m;
    squares += radius * radius;
    outline.centre_m += 2 * radius * spoke(a);
    ++found;
  }
  if (found < 3 * azimuths / 4) return std::nullopt;
  outline.radius_m = std::sqrt(squares / static_cast<float>(found));
  outline.centre_m /= static_cast<float>(found);
  return outline;
}

// The direction of sight of the views' middle: the outline's offset is across it.
Eigen::Vector3f mean_sight(const std::vector<FieldView>& views, const Eigen::Vector3f& position) {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (const FieldView& view : views) {
    const Eigen::Vector3f pixel = pixel_of(view, position.homogeneous());
    if (pixel.z() > 0 && view.fetch(0, pixel.x() / pixel.z(), pixel.y() / pixel.z()).w() >= clear_weight)
      sum += (position - view.centre_in_world).normalized();
  }
  return sum;
}

}  // namespace

Emitter fit_outline(const std::vector<FieldView>& views, const Emitter& start) {
  Emitter e = start;
  const float step_m = reach * start.radius_m / steps;
  constexpr int rounds = 3;
  for (int round = 0; round < rounds; ++round) {
    const std::optional<Outline> outline = outline_of(views, e, step_m);
    const Eigen::Vector3f to = mean_sight(views, e.position);
    const Eigen::Vector3f level = to.cross(Eigen::Vector3f::UnitZ());
    if (!outline || outline->centre_m.norm() > start.radius_m || level.norm() < 1e-3F * to.norm()) return start;
    const Eigen::Vector3f across = level.normalized();
    e.radius_m = outline->radius_m;
    if (round + 1 < rounds)  // the last outline is that of the last centre
      e.position += outline->centre_m.x() * across + outline->centre_m.y() * across.cross(to.normalized());
  }
  return e;
}

}  // namespace mf
