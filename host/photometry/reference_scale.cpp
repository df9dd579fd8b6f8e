// SPDX-License-Identifier: Apache-2.0
#include "host/photometry/reference_scale.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/error.h"

namespace mf {

namespace {

struct Disc {
  int x0, x1, y0, y1;  // its bounding box, ends excluded
  SessionHeader::Reference reference;

  // Whether it touches the pixel, which reaches from x to x + 1.
  [[nodiscard]] bool touches(int x, int y) const {
    return std::hypot(std::clamp(reference.x_px, x + 0., x + 1.) - reference.x_px,
                      std::clamp(reference.y_px, y + 0., y + 1.) - reference.y_px) < reference.radius_px;
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
        if (disc.touches(x, y) && codes.at(x, y, c) >= saturation)
          throw InputError(session, "reference",
                           fmt::format("pixel ({}, {}) of {} is saturated: take the reading on a darker spot", x, y,
                                       disc.reference.frame));
}

// The disc's pixels by channel: a mosaic's as they are, without what a demosaicing makes up between them.
std::vector<std::vector<double>> values_in(const Disc& disc, const ImageF& linear, PixelLayout layout,
                                           std::size_t channels) {
  std::vector<std::vector<double>> values(channels);
  for (int y = disc.y0; y < disc.y1; ++y)
    for (int x = disc.x0; x < disc.x1; ++x)
      for (int c = 0; c < linear.channels; ++c)
        if (disc.touches(x, y))
          values[static_cast<std::size_t>(linear.channels > 1 ? c : colour_at(layout, x, y))].push_back(
              static_cast<double>(linear.at(x, y, c)));
  return values;
}

// What a disc tells of one channel's scale.
struct ChannelScale {
  double scale = 0;     // the reading over the mean of the channel's pixels
  double variance = 0;  // of its logarithm
};

ChannelScale scale_of(const std::vector<double>& values, double reading) {
  const auto n = static_cast<double>(values.size());
  const double mean = std::accumulate(values.begin(), values.end(), 0.) / n;
  double squares = 0;
  for (const double v : values) squares += (v - mean) * (v - mean);
  return {reading / mean, squares / std::max(n - 1, 1.) / n / (mean * mean)};
}

// Variance of the channels' true scales (logarithms), beyond what their own variances explain: the moment estimate of
// DerSimonian and Laird 1986, eq. 8.
double variance_between(const std::vector<ChannelScale>& channels) {
  double weights = 0, squares = 0, mean = 0;
  for (const ChannelScale& c : channels) {
    weights += 1 / c.variance;
    squares += 1 / (c.variance * c.variance);
    mean += std::log(c.scale) / c.variance;
  }
  mean /= weights;
  double spread = 0;
  for (const ChannelScale& c : channels) spread += std::pow(std::log(c.scale) - mean, 2) / c.variance;
  return std::max(0., (spread - static_cast<double>(channels.size() - 1)) / (weights - squares / weights));
}

// A mosaic shows each channel at some of the disc's pixels only, and a textured or noisy spot is another there than
// over all of the disc, which the meter saw. Were the channels' scales all one s, every pixel would tell it, whatever
// its colour: s = n / Σ v / reading. Each channel's own estimate is drawn towards that as far as chance explains the
// difference (empirical Bayes). A camera whose channels do differ keeps its differences.
void share_between_channels(const std::vector<std::vector<double>>& values, const std::vector<double>& readings,
                            std::vector<ChannelScale>& channels) {
  double sum = 0, count = 0;
  for (std::size_t c = 0; c < values.size(); ++c) {
    for (const double v : values[c]) sum += v / readings[c];
    count += static_cast<double>(values[c].size());
  }
  const double common = count / sum;
  constexpr double exact = 1e-12;  // an even patch without noise: its channels are as they are
  for (ChannelScale& c : channels) c.variance = std::max(c.variance, exact);
  const double between = variance_between(channels);
  for (ChannelScale& c : channels) c.scale = common * std::pow(c.scale / common, between / (between + c.variance));
}

}  // namespace

std::vector<double> reference_scale(const SessionHeader::Reference& reference, const Frame& frame,
                                    const PixelFormat& format, const ResponseCurve& curve, const std::string& session) {
  ResponseCurve relative = curve;
  std::fill(relative.radiance_scale.begin(), relative.radiance_scale.end(), 1.0);
  const ImageF linear = linearize(frame, format, relative);
  const auto channels = static_cast<std::size_t>(format.colour_channels());
  if (reference.radiance.size() != channels || !std::all_of(reference.radiance.begin(), reference.radiance.end(),
                                                            [](double v) { return v > 0 && std::isfinite(v); }))
    throw InputError(session, "reference.radiance",
                     fmt::format("needs {} positive number{}", channels, channels == 1 ? "" : "s, one a channel"));
  const Disc disc = disc_in(reference, linear.width, linear.height, session);
  require_unsaturated(disc, frame, curve.saturation_code, session);
  const std::vector<std::vector<double>> values = values_in(disc, linear, format.layout, channels);
  std::vector<ChannelScale> scales;
  for (std::size_t c = 0; c < channels; ++c) {
    if (values[c].empty())
      throw InputError(session, "reference.radius_px",
                       "holds no pixel of some colour: take the reading on a larger disc");
    if (!(std::accumulate(values[c].begin(), values[c].end(), 0.) > 0))
      throw InputError(session, "reference",
                       fmt::format("{} is black at the disc: check its position and the frame", reference.frame));
    scales.push_back(scale_of(values[c], reference.radiance[c]));
  }
  const bool mosaic = linear.channels == 1 && channels > 1;
  if (mosaic) share_between_channels(values, reference.radiance, scales);
  std::vector<double> scale;
  for (const ChannelScale& c : scales) scale.push_back(c.scale);
  return scale;
}

}  // namespace mf
