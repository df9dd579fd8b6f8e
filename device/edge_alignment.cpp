// SPDX-License-Identifier: Apache-2.0
#include "device/edge_alignment.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace mf {

namespace {

using Eigen::Vector2d;

struct Line {
  Vector2d point;
  Vector2d along;  // unit length
};

// One side of the square in the picture. `outwards`: unit length, towards the bright side.
struct Side {
  Vector2d a, b, outwards;
  [[nodiscard]] double length() const { return (b - a).norm(); }
};

// A pixel beside a side: u along it, −1 at a to 1 at b; s across it, pixels, outwards.
struct SidePixel {
  double u, s, light;
};

bool inside(const ImageF& image, const Vector2d& at) {
  return at.minCoeff() > 0.5 && at.x() < image.width - 0.5 && at.y() < image.height - 0.5;
}

// Empty when a part of them lies outside of the picture.
std::vector<SidePixel> pixels_beside(const ImageF& linear, const Side& side, double reach) {
  constexpr double end_share = 0.06, end_px = 1.5;  // left out at both ends: there the other sides are near
  const double length = side.length(), most_u = 1 - 2 * std::max(end_share, end_px / length);
  for (const Vector2d& end : {side.a, side.b})
    for (const double s : {-reach, reach})
      if (!inside(linear, end + s * side.outwards)) return {};
  const Vector2d middle = 0.5 * (side.a + side.b), along = (side.b - side.a) / length;
  // Lines of pixels that cross the side steeply, each from one end of the reach to the other.
  const int major = std::abs(along.x()) > std::abs(along.y()) ? 0 : 1, minor = 1 - major;
  const double across = std::abs(side.outwards[minor]), slope = along[minor] / along[major];
  const auto [first, last] = std::minmax(side.a[major], side.b[major]);
  std::vector<SidePixel> out;
  out.reserve(static_cast<std::size_t>((length + 2) * (2 * reach + 1) * 1.5));
  for (int i = static_cast<int>(first); i <= static_cast<int>(last); ++i) {
    const double on_side = middle[minor] + slope * (i + 0.5 - middle[major]);
    const int from = static_cast<int>(std::ceil(on_side - reach / across - 0.5));
    const int to = static_cast<int>(std::floor(on_side + reach / across - 0.5));
    for (int j = from; j <= to; ++j) {
      const int x = major == 0 ? i : j, y = major == 0 ? j : i;
      if (x < 0 || y < 0 || x >= linear.width || y >= linear.height) continue;
      const Vector2d p = Vector2d(x + 0.5, y + 0.5) - middle;
      const double u = 2 * p.dot(along) / length;
      if (std::abs(u) <= most_u) out.push_back({u, p.dot(side.outwards), static_cast<double>(linear.at(x, y))});
    }
  }
  return out;
}

// Light beside an edge, dark to bright over a blur of half-width w:
//
//   I(u, s) = m₀ + m₁ u + (h₀ + h₁ u) · E((s − o − t u) / w),   E(z) = (15 z − 10 z³ + 3 z⁵) / 8,   E(±1) = ±1
//
// E is the integral of the biweight kernel, which is close to a Gaussian of standard deviation w / √7.
struct EdgeModel {
  enum Parameter : Eigen::Index { offset, tilt, blur, middle, middle_slope, half, half_slope, count };
  using Vector = Eigen::Matrix<double, count, 1>;
  using Matrix = Eigen::Matrix<double, count, count>;
  Vector x = Vector::Zero();

  [[nodiscard]] double residual(const SidePixel& p, Vector& slope) const {
    const double z = std::clamp((p.s - x[offset] - x[tilt] * p.u) / x[blur], -1.0, 1.0);
    const double z2 = z * z, step = z * (15 - z2 * (10 - 3 * z2)) / 8, kernel = 1.875 * (1 - z2) * (1 - z2);
    const double contrast = x[half] + x[half_slope] * p.u, moved = -contrast * kernel / x[blur];
    slope << moved, moved * p.u, moved * z, 1, p.u, step, step * p.u;
    return p.light - (x[middle] + x[middle_slope] * p.u + contrast * step);
  }
};

// Nothing when it is not brighter outwards.
std::optional<EdgeModel> first_guess(const std::vector<SidePixel>& pixels, double blur) {
  std::array<double, 2> light{}, number{};  // inwards, outwards
  for (const SidePixel& p : pixels) {
    const std::size_t half = p.s > 0 ? 1 : 0;
    light[half] += p.light;
    number[half] += 1;
  }
  const double dark = light[0] / number[0], bright = light[1] / number[1];
  if (!(bright > dark)) return std::nullopt;
  EdgeModel out;
  out.x[EdgeModel::blur] = blur;
  out.x[EdgeModel::middle] = 0.5 * (dark + bright);
  out.x[EdgeModel::half] = 0.5 * (bright - dark);
  return out;
}

struct Round {
  double moved;  // by how much an end of the edge went, pixels
  double noise;  // root mean square of what the model left before
};

// Weighted Gauss–Newton.
Round improve(EdgeModel& model, const std::vector<SidePixel>& pixels, double least_variance) {
  EdgeModel::Matrix normal = EdgeModel::Matrix::Zero();
  EdgeModel::Vector gradient = EdgeModel::Vector::Zero(), slope;
  double squares = 0;
  for (const SidePixel& p : pixels) {
    const double r = model.residual(p, slope);
    // Shot noise: the variance grows with the light, that of the model, which the pixel's own noise does not sway.
    const double weight = 1 / (std::max(p.light - r, 0.0) + least_variance);
    normal.noalias() += slope * (weight * slope).transpose();
    gradient += weight * r * slope;
    squares += r * r;
  }
  constexpr double damping = 1e-3;  // a blur that cannot be told from the levels' difference stays as it was
  normal.diagonal() *= 1 + damping;
  const EdgeModel::Vector step = normal.ldlt().solve(gradient);
  const double wanted = std::abs(step[EdgeModel::offset]) + std::abs(step[EdgeModel::tilt]);
  const double most = 0.5 * model.x[EdgeModel::blur];  // farther away the slopes say nothing
  const double share = wanted > most ? most / wanted : 1;
  model.x += share * step;
  return {share * wanted, std::sqrt(squares / static_cast<double>(pixels.size()))};
}

// Nothing when no such edge is within reach.
std::optional<EdgeModel> fitted(EdgeModel model, const std::vector<SidePixel>& pixels, double reach) {
  constexpr int rounds = 3;             // one more changes the corners' RMS by less than 0.005 px,
  constexpr int most_rounds = 8;        // unless the start was far off:
  constexpr double still_moving = 0.2;  // pixels a round
  constexpr double least_blur = 1;      // pixels: a narrower edge could lie between two rows and be felt by neither
  constexpr double least_light = 0.2;   // of the bright side: black ink must not rule alone
  const double least_variance = least_light * (model.x[EdgeModel::middle] + model.x[EdgeModel::half]);
  Round last{reach, 0};
  for (int round = 0; round < rounds || (round < most_rounds && last.moved > still_moving); ++round) {
    last = improve(model, pixels, least_variance);
    model.x[EdgeModel::blur] = std::clamp(model.x[EdgeModel::blur], least_blur, reach);
    const bool near = std::abs(model.x[EdgeModel::offset]) + std::abs(model.x[EdgeModel::tilt]) < reach;
    if (!near || !(model.x[EdgeModel::half] > 0)) return std::nullopt;
  }
  return 2 * model.x[EdgeModel::half] > last.noise ? std::optional(model) : std::nullopt;
}

// The edge near a side of the square; nothing when it cannot be seen.
std::optional<Line> edge_line(const ImageF& linear, const Side& side, double reach) {
  constexpr double usual_blur = 2;  // pixels: a smoothed mosaic's
  const std::vector<SidePixel> pixels = pixels_beside(linear, side, reach);
  if (pixels.size() < 4 * EdgeModel::count) return std::nullopt;
  std::optional<EdgeModel> model = first_guess(pixels, std::min(usual_blur, reach));
  if (model) model = fitted(*model, pixels, reach);
  if (!model) return std::nullopt;
  const double offset = model->x[EdgeModel::offset], tilt = model->x[EdgeModel::tilt];
  const Vector2d from = side.a + (offset - tilt) * side.outwards, to = side.b + (offset + tilt) * side.outwards;
  return Line{from, (to - from).normalized()};
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
    edges[k] = edge_line(linear, {a, b, outwards}, reach);
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

double farthest(const QuadCorners& from, const QuadCorners& to) {
  double out = 0;
  for (std::size_t k = 0; k < 4; ++k) out = std::max(out, (to[k] - from[k]).norm());
  return out;
}

}  // namespace

std::optional<QuadCorners> align_edges(const ImageF& linear, const QuadCorners& start, double reach_px) {
  constexpr double far_px = 0.5;  // then the bright or the dark side was hardly within reach: once more, from there
  std::optional<QuadCorners> found = aligned_once(linear, start, reach_px);
  if (found && farthest(start, *found) > far_px) found = aligned_once(linear, *found, reach_px);
  if (found && !(farthest(start, *found) < 2 * reach_px)) return std::nullopt;
  return found;
}

}  // namespace mf
