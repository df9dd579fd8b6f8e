// SPDX-License-Identifier: Apache-2.0
#include "host/photometry/reference_scale.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/demosaic.h"
#include "common/error.h"

namespace mf {

namespace {

struct Disc {
  int x0, x1, y0, y1;  // its bounding box, ends excluded
  const SessionHeader::Reference& reference;

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

}  // namespace

std::vector<double> reference_scale(const SessionHeader::Reference& reference, const Frame& frame,
                                    const PixelFormat& format, const ResponseCurve& curve, const std::string& session) {
  ResponseCurve relative = curve;
  std::fill(relative.radiance_scale.begin(), relative.radiance_scale.end(), 1.0);
  const ImageF picture = demosaic(linearize(frame, format, relative), format.layout);
  const auto channels = static_cast<std::size_t>(picture.channels);
  if (reference.radiance.size() != channels || !std::all_of(reference.radiance.begin(), reference.radiance.end(),
                                                            [](double v) { return v > 0 && std::isfinite(v); }))
    throw InputError(session, "reference.radiance",
                     fmt::format("needs {} positive number{}", channels, channels == 1 ? "" : "s, one a channel"));
  const Disc disc = disc_in(reference, picture.width, picture.height, session);
  require_unsaturated(disc, frame, curve.saturation_code, session);
  std::vector<double> sum(channels, 0);
  std::size_t count = 0;
  for (int y = disc.y0; y < disc.y1; ++y)
    for (int x = disc.x0; x < disc.x1; ++x) {
      if (!disc.holds(x, y)) continue;
      ++count;
      for (std::size_t c = 0; c < channels; ++c) sum[c] += static_cast<double>(picture.at(x, y, static_cast<int>(c)));
    }
  std::vector<double> scale;
  for (std::size_t c = 0; c < channels; ++c) {
    if (!(sum[c] > 0))
      throw InputError(session, "reference",
                       fmt::format("{} is black at the disc: check its position and the frame", reference.frame));
    scale.push_back(reference.radiance[c] * static_cast<double>(count) / sum[c]);
  }
  return scale;
}

}  // namespace mf
