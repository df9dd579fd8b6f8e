// SPDX-License-Identifier: Apache-2.0
#include "host/report/distance_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <vector>

#include "common/check.h"
#include "host/report/html.h"

namespace mf {

namespace {

// Viridis at its quarters (Smith, van der Walt, Firing 2015): even steps to the eye, and to colour-blind eyes too.
Eigen::Vector3f false_colour(float share) {
  static const std::array<Eigen::Vector3f, 5> stops{Eigen::Vector3f(68, 1, 84), Eigen::Vector3f(59, 82, 139),
                                                    Eigen::Vector3f(33, 145, 140), Eigen::Vector3f(94, 201, 98),
                                                    Eigen::Vector3f(253, 231, 37)};
  const float at = std::clamp(share, 0.0F, 1.0F) * static_cast<float>(stops.size() - 1);
  const std::size_t i = std::min(static_cast<std::size_t>(at), stops.size() - 2);
  const float f = at - static_cast<float>(i);
  return stops[i] * (1 - f) + stops[i + 1] * f;
}

// How sure the distance in a direction is, 0 to 1; a given shape is.
float confidence_of(const Surroundings& s, const Eigen::Vector3f& direction) {
  if (s.confidence.empty()) return 1;
  const Eigen::Vector2f at = equal_area_square(direction);
  const auto index = [](float share, int size) {
    return std::clamp(static_cast<int>(share * static_cast<float>(size)), 0, size - 1);
  };
  return s.confidence.at(index(at.x(), s.confidence.width), index(at.y(), s.confidence.height));
}

// Upward direction of a disc's pixel; z < 0 outside the disc.
Eigen::Vector3f direction_at(int x, int y, int size_px) {
  const auto along = [&](int i) { return 2 * (static_cast<float>(i) + 0.5F) / static_cast<float>(size_px) - 1; };
  const Eigen::Vector2f p(along(x), -along(y));
  const float r2 = p.squaredNorm();
  if (r2 >= 1) return -Eigen::Vector3f::UnitZ();
  const Eigen::Vector2f horizontal = p * std::sqrt(2 - r2);
  return {horizontal.x(), horizontal.y(), 1 - r2};
}

std::string scale(double nearest_m, int size_px) {
  std::string svg;
  constexpr int steps = 64;
  const double across = size_px, bar_top = size_px + 12;
  for (int i = 0; i < steps; ++i) {
    const Eigen::Vector3i c = false_colour((static_cast<float>(i) + 0.5F) / steps).cast<int>();
    fmt::format_to(std::back_inserter(svg),
                   R"svg(<rect x="{:.1f}" y="{}" width="{:.1f}" height="12" fill="rgb({},{},{})"/>)svg",
                   i * across / steps, bar_top, across / steps + 0.5, c.x(), c.y(), c.z());
  }
  double last = -1;
  const auto label = [&](double share, const std::string& text) {
    constexpr double closest = 0.09;  // of the width: labels nearer than that would touch
    if (share < last + closest || share > 1 - closest / 2) return;
    last = share;
    fmt::format_to(std::back_inserter(svg), R"(<text x="{:.1f}" y="{}" class="{}">{}</text>)", share * across,
                   bar_top + 28, share <= 0 ? "start" : "middle", text);
  };
  label(0, "far");
  for (const double metres : {16.0, 8.0, 5.0, 4.0, 3.0, 2.0, 1.5, 1.2, 1.0, 0.8, 0.6, 0.5, 0.4, 0.3, 0.2})
    label(nearest_m / metres, fmt::format("{:.2g}", metres));
  fmt::format_to(std::back_inserter(svg), R"(<text x="{:.1f}" y="{}" class="end">{:.2g} m</text>)", across,
                 bar_top + 28, nearest_m);
  return svg;
}

}  // namespace

DistanceDisc draw_distances(const LightField& field, int size_px) {
  const Surroundings& s = field.surroundings;
  check(!s.is_plane(), "a field on the plane proxy has no distances");
  const Eigen::Matrix3f world_from_plane = field.plane.world_from_plane.rotation.toRotationMatrix().cast<float>();
  ImageF inverse(size_px, size_px, 1, -1);
  std::vector<float> known;
  for (int y = 0; y < size_px; ++y)
    for (int x = 0; x < size_px; ++x) {
      const Eigen::Vector3f d = direction_at(x, y, size_px);
      if (d.z() < 0) continue;
      inverse.at(x, y) = s.inverse_distance_of(world_from_plane * d);
      known.push_back(inverse.at(x, y));
    }
  // A few stray directions must not make all others look alike.
  const auto near = known.begin() + static_cast<std::ptrdiff_t>(0.98 * static_cast<double>(known.size() - 1));
  std::nth_element(known.begin(), near, known.end());
  constexpr float farthest_scale_m = 16;
  const float most = std::max(*near, 1 / farthest_scale_m);
  DistanceDisc disc{ImageU8(size_px, size_px, 3, 255), 1 / static_cast<double>(most)};
  for (int y = 0; y < size_px; ++y)
    for (int x = 0; x < size_px; ++x) {
      if (inverse.at(x, y) < 0) continue;
      constexpr float sure = 0.3F;  // of the costs' mean: the best distance stands out clearly
      const float c = std::min(confidence_of(s, world_from_plane * direction_at(x, y, size_px)) / sure, 1.0F);
      const Eigen::Vector3f grey = Eigen::Vector3f::Constant(128);
      const Eigen::Vector3f colour = c * false_colour(inverse.at(x, y) / most) + (1 - c) * grey;
      for (int k = 0; k < 3; ++k) disc.colours.at(x, y, k) = static_cast<std::uint8_t>(colour[k] + 0.5F);
    }
  return disc;
}

std::string distance_figure(const LightField& field, int size_px) {
  const DistanceDisc disc = draw_distances(field, size_px);
  std::string svg = fmt::format(R"(<image width="{0}" height="{0}" href="{1}"/>)", size_px, png_data_uri(disc.colours));
  const Eigen::Matrix3f plane_from_world =
      field.plane.world_from_plane.rotation.toRotationMatrix().transpose().cast<float>();
  for (std::size_t i = 0; i < field.emitters.size(); ++i) {
    const Emitter& e = field.emitters[i].emitter;
    const Eigen::Vector3f to = plane_from_world * (e.position - field.surroundings.centre_in_world);
    const Eigen::Vector2f at = static_cast<float>(size_px) * equal_area_square(to.normalized());
    const float radius = std::max(6.0F, 0.5F * static_cast<float>(size_px) * e.radius_m / to.norm());
    fmt::format_to(
        std::back_inserter(svg),
        R"(<circle class="emitter" cx="{0:.1f}" cy="{1:.1f}" r="{2:.1f}"/><text class="emitter" x="{3:.1f}" y="{1:.1f}">{4}</text>)",
        at.x(), at.y(), radius, at.x() + radius + 3, i + 1);
  }
  svg += scale(disc.nearest_m, size_px);
  return fmt::format(R"(<svg viewBox="0 0 {} {}" role="img" aria-label="distances">{}</svg>)", size_px, size_px + 46,
                     svg);
}

std::string emitter_table(const LightField& field) {
  if (field.emitters.empty()) return "";
  std::string rows;
  for (std::size_t i = 0; i < field.emitters.size(); ++i) {
    const ShadedEmitter& e = field.emitters[i];
    const Eigen::Vector3f& at = e.emitter.position;
    fmt::format_to(std::back_inserter(rows),
                   "<tr><td>{}</td><td>{:.3f}, {:.3f}, {:.3f} m</td><td>{:.1f} cm</td><td>{:.3g} {:.3g} {:.3g}</td>"
                   "<td>{}</td></tr>",
                   i + 1, at.x(), at.y(), at.z(), 100 * e.emitter.radius_m, e.radiance.x(), e.radiance.y(),
                   e.radiance.z(), e.emitter.views);
  }
  return "<table><tr><th>emitter</th><th>at (world)</th><th>radius</th><th>radiance</th><th>views</th></tr>" + rows +
         "</table>";
}

}  // namespace mf
