// SPDX-License-Identifier: Apache-2.0
#include "device/edge_alignment.h"

#include <algorithm>
#include <cmath>

namespace mf {

namespace {

using Eigen::Vector2d;

struct Line {
  Vector2d point;
  Vector2d along;  // unit length
};

// Bilinear between pixel centres, which are at +0.5. Precondition: at least a pixel inside of the border.
double sample(const ImageF& image, const Vector2d& at) {
  const double x = at.x() - 0.5, y = at.y() - 0.5;
  const int ix = static_cast<int>(x), iy = static_cast<int>(y);
  const double fx = x - ix, fy = y - iy;
  const float* row = image.row(iy).data() + ix;
  const float* next = row + image.width;
  return (1 - fy) * ((1 - fx) * static_cast<double>(row[0]) + fx * static_cast<double>(row[1])) +
         fy * ((1 - fx) * static_cast<double>(next[0]) + fx * static_cast<double>(next[1]));
}

bool inside(const ImageF& image, const Vector2d& at) {
  return at.minCoeff() > 1 && at.x() < image.width - 1 && at.y() < image.height - 1;
}

// Least squares through weighted points; nothing for points that are all in one place.
struct LineFit {
  double weight = 0;
  Vector2d sum = Vector2d::Zero();
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();

  void add(const Vector2d& p, double w) {
    weight += w;
    sum += w * p;
    squares += w * p * p.transpose();
  }
  [[nodiscard]] std::optional<Line> line() const {
    if (!(weight > 0)) return std::nullopt;
    const Vector2d mean = sum / weight;
    const Eigen::Matrix2d spread = squares / weight - mean * mean.transpose();
    // The main axis of a 2 × 2 covariance, in closed form.
    const double angle = 0.5 * std::atan2(2 * spread(0, 1), spread(0, 0) - spread(1, 1));
    if (!(spread.trace() > 1)) return std::nullopt;
    return Line{mean, {std::cos(angle), std::sin(angle)}};
  }
};

// The edge from a to b, whose bright side `outwards` (unit length) points to.
std::optional<Line> edge_line(const ImageF& linear, const Vector2d& a, const Vector2d& b, const Vector2d& outwards,
                              double reach) {
  constexpr double step = 0.5;   // across the edge, pixels
  constexpr double ends = 0.06;  // of the edge at both ends: there the other edges are near
  const int count = std::max(8, static_cast<int>((b - a).norm()));
  LineFit fit;
  for (int i = 0; i < count; ++i) {
    const Vector2d at = a + (ends + (1 - 2 * ends) * (i + 0.5) / count) * (b - a);
    if (!inside(linear, at - (reach + step) * outwards) || !inside(linear, at + (reach + step) * outwards))
      return std::nullopt;
    double moment = 0, weight = 0;
    for (double n = -reach; n <= reach + 1e-9; n += step) {
      const double slope = sample(linear, at + (n + step) * outwards) - sample(linear, at + (n - step) * outwards);
      if (!(slope > 0)) continue;
      moment += slope * slope * n;
      weight += slope * slope;
    }
    if (weight > 0) fit.add(at + moment / weight * outwards, weight);
  }
  return fit.line();
}

std::optional<Vector2d> crossing(const Line& a, const Line& b) {
  const double sine = a.along.x() * b.along.y() - a.along.y() * b.along.x();
  if (std::abs(sine) < 0.1) return std::nullopt;
  const Vector2d between = b.point - a.point;
  return a.point + (between.x() * b.along.y() - between.y() * b.along.x()) / sine * a.along;
}

std::optional<QuadCorners> aligned_once(const ImageF& linear, const QuadCorners& corners, double reach) {
  const Vector2d centre = 0.25 * (corners[0] + corners[1] + corners[2] + corners[3]);
  std::array<std::optional<Line>, 4> edges;
  for (std::size_t k = 0; k < 4; ++k) {
    const Vector2d& a = corners[k];
    const Vector2d& b = corners[(k + 1) % 4];
    Vector2d outwards = Vector2d(b.y() - a.y(), a.x() - b.x()).normalized();
    if (outwards.dot(a - centre) < 0) outwards = -outwards;
    edges[k] = edge_line(linear, a, b, outwards, reach);
    if (!edges[k]) return std::nullopt;
  }
  QuadCorners out;
  for (std::size_t k = 0; k < 4; ++k) {
    const std::optional<Vector2d> corner = crossing(*edges[(k + 3) % 4], *edges[k]);
    if (!corner) return std::nullopt;
    out[k] = *corner;
  }
  return out;
}

}  // namespace

std::optional<QuadCorners> align_edges(const ImageF& linear, const QuadCorners& start, double reach_px) {
  // The second time the edges are in the middle of what is looked at: the ends cut off nothing on one side only.
  std::optional<QuadCorners> found = aligned_once(linear, start, reach_px);
  if (found) found = aligned_once(linear, *found, reach_px);
  for (std::size_t k = 0; found && k < 4; ++k)
    if (!((start[k] - (*found)[k]).norm() < 2 * reach_px)) return std::nullopt;
  return found;
}

}  // namespace mf
