// SPDX-License-Identifier: Apache-2.0
#include "host/photometry/reference_scale.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/demosaic.h"
#include "common/error.h"

namespace mf {

namespace {

struct Disc {
  int x0, x1, y0, y1;  // its bounding box, ends excluded
  SessionHeader::Reference reference;

  [[nodiscard]] bool holds(int x, int y) const {
    return std::hypot(x + 0.5 - reference.x_px, y + 0.5 - reference.y_px) <= reference.radius_px;
  }
};

Disc disc_in(const SessionHeader::Reference& r, int width, int height, const std::string& session) {
  const Disc disc{static_cast<int>(std::floor(r.x_px - r.radius_px)), static_cast<int>(std::ceil(r.x_px + r.radius_px)),
                  static_cast<int>(std::floor(r.y_px - r.radius_px)), static_cast<int>(std::ceil(r.y_px + r.radius_px)),
                  r};
  if (!(r.radius_px > 0) || disc.x0 < 0 || disc.y0 < 0 || disc.x1 > width || disc.y1 > height)
    throw InputError(session, "reference",
                     fmt::format("the disc at ({}, {}) of radius {} px does not lie in the {}×{} picture", r.x_px,
                                 r.y_px, r.radius_px, width, height));
  return disc;
}

void require_unsaturated(const Disc& disc, const Frame& frame, double saturation, const std::string& session) {
  if (!std::holds_alternative<ImageU16>(frame.pixels)) return;
  const ImageU16& codes = std::get<ImageU16>(frame.pixels);
  for (int y = disc.y0; y < disc.y1; ++y)
    for (int x = disc.x0; x < disc.x1; ++x)
      for (int c = 0; c < codes.channels; ++c)
        if (disc.holds(x, y) && codes.at(x, y, c) >= saturation)
          throw InputError(session, "reference",
                           fmt::format("pixel ({}, {}) of {} is saturated: take the reading on a darker spot", x, y,
                                       disc.reference.frame));
}

bool has_saturation(const Disc& disc, const Frame& frame, double saturation) {
  if (!std::holds_alternative<ImageU16>(frame.pixels)) return false;
  const ImageU16& codes = std::get<ImageU16>(frame.pixels);
  for (int y = disc.y0; y < disc.y1; ++y)
    for (int x = disc.x0; x < disc.x1; ++x)
      for (int c = 0; c < codes.channels; ++c)
        if (disc.holds(x, y) && codes.at(x, y, c) >= saturation) return true;
  return false;
}

// An estimate of the mean over the disc, and its standard deviation.
struct Estimate {
  double value = 0;
  double sigma = 0;
};

std::vector<Estimate> mean_over(const Disc& disc, const ImageF& picture) {
  std::vector<Estimate> means(static_cast<std::size_t>(picture.channels));
  double count = 0;
  for (int y = disc.y0; y < disc.y1; ++y)
    for (int x = disc.x0; x < disc.x1; ++x) {
      if (!disc.holds(x, y)) continue;
      ++count;
      for (std::size_t c = 0; c < means.size(); ++c)
        means[c].value += static_cast<double>(picture.at(x, y, static_cast<int>(c)));
    }
  for (Estimate& mean : means) mean.value /= count;
  return means;
}

// Noise of one cell: the median difference of neighbours, which neither slopes nor edges raise much.
double cell_noise(const Disc& disc, const ImageF& cells, int channel) {
  std::vector<double> differences;
  for (int y = disc.y0 / 2; y < disc.y1 / 2; ++y)
    for (int x = disc.x0 / 2; x + 1 < disc.x1 / 2; ++x)
      differences.push_back(std::abs(static_cast<double>(cells.at(x + 1, y, channel) - cells.at(x, y, channel))));
  if (differences.empty()) return 0;
  const auto middle = differences.begin() + static_cast<std::ptrdiff_t>(differences.size() / 2);
  std::nth_element(differences.begin(), middle, differences.end());
  constexpr double sigma_per_median = 1.4826 / std::numbers::sqrt2;  // of a difference of two normal variables
  return *middle * sigma_per_median;
}

// Value at the disc's centre of the plane (value, slopes) that fits the 2 × 2 cells within it best. A disc being
// symmetric, that is its mean.
Estimate plane_at_centre(const Disc& disc, const ImageF& cells, int channel, double noise) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (int y = disc.y0 / 2; y < disc.y1 / 2; ++y)
    for (int x = disc.x0 / 2; x < disc.x1 / 2; ++x) {
      const Eigen::Vector3d row(1, 2 * x + 1 - disc.reference.x_px, 2 * y + 1 - disc.reference.y_px);
      if (row.tail<2>().norm() > disc.reference.radius_px) continue;
      normal += row * row.transpose();
      right += row * static_cast<double>(cells.at(x, y, channel));
    }
  const Eigen::Matrix3d covariance = normal.inverse();
  return {(covariance * right)[0], noise * std::sqrt(covariance(0, 0))};
}

Disc widened(const Disc& disc, double times) {
  Disc wide = disc;
  wide.reference.radius_px *= times;
  const SessionHeader::Reference& r = wide.reference;
  wide.x0 = static_cast<int>(std::floor(r.x_px - r.radius_px));
  wide.x1 = static_cast<int>(std::ceil(r.x_px + r.radius_px));
  wide.y0 = static_cast<int>(std::floor(r.y_px - r.radius_px));
  wide.y1 = static_cast<int>(std::ceil(r.y_px + r.radius_px));
  return wide;
}

bool agree(const std::vector<Estimate>& a, const std::vector<Estimate>& b) {
  constexpr double sigmas = 1;  // of each: their intervals touch
  for (std::size_t c = 0; c < a.size(); ++c)
    if (std::abs(a[c].value - b[c].value) > sigmas * (a[c].sigma + b[c].sigma)) return false;
  return true;
}

// The mean over the disc, by channel. A small disc holds few pixels, each with its own noise: as long as a wider disc
// tells the same within the noise, its plane fit says it more exactly (intersecting confidence intervals: Goldenshluger
// and Nemirovski 1997).
std::vector<double> disc_means(const Disc& disc, const Frame& frame, const ImageF& picture, const ImageF& cells,
                               double saturation) {
  constexpr double widest = 2.5;     // times the disc's radius: beyond, a slope is no plane any more
  constexpr double smallest_px = 4;  // a dozen cells: fewer do not hold a plane
  std::vector<std::vector<Estimate>> estimates{mean_over(disc, picture)};
  std::vector<double> noise;
  for (std::size_t c = 0; c < estimates[0].size(); ++c) {
    noise.push_back(cell_noise(disc, cells, static_cast<int>(c)));
    constexpr double cell_px = 4;
    const double cells_in_disc = std::numbers::pi * disc.reference.radius_px * disc.reference.radius_px / cell_px;
    estimates[0][c].sigma = noise[c] / std::sqrt(std::max(cells_in_disc, 1.0));
  }
  for (double times = 1.5; times <= widest; times += 0.25) {
    const Disc wide = widened(disc, times);
    if (wide.reference.radius_px < smallest_px) continue;
    if (wide.x0 < 0 || wide.y0 < 0 || wide.x1 > picture.width || wide.y1 > picture.height ||
        has_saturation(wide, frame, saturation))
      break;
    std::vector<Estimate> next;
    for (std::size_t c = 0; c < noise.size(); ++c) {
      noise[c] = cell_noise(wide, cells, static_cast<int>(c));
      next.push_back(plane_at_centre(wide, cells, static_cast<int>(c), noise[c]));
    }
    if (!std::all_of(estimates.begin(), estimates.end(), [&](const auto& earlier) { return agree(earlier, next); }))
      break;
    estimates.push_back(std::move(next));
  }
  std::vector<double> means;
  for (const Estimate& best : estimates.back()) means.push_back(best.value);
  return means;
}

}  // namespace

std::vector<double> reference_scale(const SessionHeader::Reference& reference, const Frame& frame,
                                    const PixelFormat& format, const ResponseCurve& curve, const std::string& session) {
  ResponseCurve relative = curve;
  std::fill(relative.radiance_scale.begin(), relative.radiance_scale.end(), 1.0);
  const ImageF linear = linearize(frame, format, relative);
  const ImageF picture = demosaic(linear, format.layout);
  const auto channels = static_cast<std::size_t>(picture.channels);
  if (reference.radiance.size() != channels || !std::all_of(reference.radiance.begin(), reference.radiance.end(),
                                                            [](double v) { return v > 0 && std::isfinite(v); }))
    throw InputError(session, "reference.radiance",
                     fmt::format("needs {} positive number{}", channels, channels == 1 ? "" : "s, one a channel"));
  const Disc disc = disc_in(reference, linear.width, linear.height, session);
  require_unsaturated(disc, frame, curve.saturation_code, session);
  std::vector<double> scale;
  const std::vector<double> means =
      disc_means(disc, frame, picture, bin_cells(linear, format.layout), curve.saturation_code);
  for (std::size_t c = 0; c < channels; ++c) {
    if (!(means[c] > 0))
      throw InputError(session, "reference",
                       fmt::format("{} is black at the disc: check its position and the frame", reference.frame));
    scale.push_back(reference.radiance[c] / means[c]);
  }
  return scale;
}

}  // namespace mf
