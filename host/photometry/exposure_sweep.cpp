// SPDX-License-Identifier: Apache-2.0
#include "host/photometry/exposure_sweep.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/check.h"
#include "common/error.h"

namespace mf {

namespace {

const ImageU16& codes_of(const Frame& frame) {
  check(std::holds_alternative<ImageU16>(frame.pixels), "a response is estimated from sensor codes");
  return std::get<ImageU16>(frame.pixels);
}

// Frames from the darkest exposure to the brightest.
std::vector<std::size_t> by_exposure(const ExposureSweep& sweep) {
  std::vector<std::size_t> order(sweep.frames.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return sweep.frames[a].info.effective_exposure_s() < sweep.frames[b].info.effective_exposure_s();
  });
  return order;
}

// The value that `fraction` of the values lie below. Precondition: not empty.
template <typename T>
T quantile(std::vector<T> values, double fraction) {
  const auto nth = values.begin() + static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

}  // namespace

void ExposureSweep::require_usable() const {
  if (frames.size() < 2)
    throw InputError(source, "sweep",
                     fmt::format("has {} frame{}: a response needs the same scene at two exposures or more",
                                 frames.size(), frames.size() == 1 ? "" : "s"));
  double least = INFINITY, most = 0;
  for (const Frame& frame : frames) {
    const double exposure = frame.info.effective_exposure_s();
    if (!(exposure > 0) || !std::isfinite(exposure))
      throw InputError(source, fmt::format("sweep frame {}: exposure_s, nd_density", frame.info.name),
                       "the exposure must be a positive number of seconds and the density finite");
    const ImageU16& codes = codes_of(frame);
    const ImageU16& first = codes_of(frames.front());
    if (codes.width != first.width || codes.height != first.height || codes.channels != first.channels)
      throw InputError(source, fmt::format("sweep frame {}", frame.info.name),
                       "has another size than the first: a sweep is one static scene seen by one camera");
    least = std::min(least, exposure);
    most = std::max(most, exposure);
  }
  if (most < 1.1 * least)  // less than a seventh of a stop tells nothing about the curve's shape
    throw InputError(source, "sweep: exposure_s, nd_density",
                     "all frames have the same exposure: take the scene at several exposures or through filters");
}

DarkReading darkest_reading(const ExposureSweep& sweep) {
  const std::vector<std::size_t> order = by_exposure(sweep);
  const std::vector<std::uint16_t>& bright = codes_of(sweep.frames[order.back()]).data;
  const std::uint16_t limit = quantile(bright, 0.1);
  const auto chosen_codes = [&](const Frame& frame) {
    std::vector<double> chosen;
    for (std::size_t i = 0; i < bright.size(); ++i)
      if (bright[i] <= limit) chosen.push_back(codes_of(frame).data[i]);
    return chosen;
  };
  const auto mean = [](const std::vector<double>& v) {
    return std::accumulate(v.begin(), v.end(), 0.0) / static_cast<double>(v.size());
  };
  const Frame& darkest = sweep.frames[order.front()];
  const std::vector<double> codes = chosen_codes(darkest);
  DarkReading dark;
  dark.code = mean(codes);
  // Codes are whole: a quiet sensor shows no spread at all. A frame that is not dark shows the scene's.
  dark.noise = std::clamp((quantile(codes, 0.84) - quantile(codes, 0.16)) / 2, 0.5,
                          0.005 * (sweep.format.level_count() - 1) + 0.5);
  dark.extrapolated = dark.code;
  const double t = darkest.info.effective_exposure_s();
  for (const std::size_t k : order) {
    const double longer = sweep.frames[k].info.effective_exposure_s();
    if (longer < 1.1 * t) continue;
    const double rise = mean(chosen_codes(sweep.frames[k])) - dark.code;
    dark.extrapolated = std::clamp(dark.code - rise * t / (longer - t), 0.0, dark.code);
    break;
  }
  return dark;
}

void require_rising_codes(const ExposureSweep& sweep, const DarkReading& dark) {
  const std::vector<std::size_t> order = by_exposure(sweep);
  const auto mean_code = [&](std::size_t k) {
    const std::vector<std::uint16_t>& codes = codes_of(sweep.frames[k]).data;
    return std::accumulate(codes.begin(), codes.end(), 0.0) / static_cast<double>(codes.size());
  };
  const double tolerance = 0.25 * dark.noise;  // far above the scatter of a mean over a frame
  const double first = mean_code(order.front());
  double before = first;
  for (std::size_t k = 1; k < order.size(); ++k) {
    const double code = mean_code(order[k]);
    if (code < before - tolerance)
      throw InputError(sweep.source, "sweep: exposure_s, nd_density",
                       fmt::format("frame {} is darker than {} though its exposure is longer: check both entries",
                                   sweep.frames[order[k]].info.name, sweep.frames[order[k - 1]].info.name));
    before = code;
  }
  if (before < first + tolerance)
    throw InputError(sweep.source, "sweep: exposure_s, nd_density",
                     "the frames do not get brighter with the exposure: they are all dark, all saturated, or the same; "
                     "take longer or shorter exposures of a lit scene");
}

double saturation_code(const ExposureSweep& sweep, const DarkReading& dark) {
  const double last = sweep.format.level_count() - 1;
  const std::vector<std::size_t> order = by_exposure(sweep);
  std::uint16_t highest = 0;
  for (const Frame& frame : sweep.frames)
    highest = std::max(highest, *std::max_element(codes_of(frame).data.begin(), codes_of(frame).data.end()));
  // A clipped pixel still jitters when clipping comes before the converter's noise: half a percent of the range.
  const double edge = highest - 0.005 * last;
  if (edge < dark.code + 0.02 * last) return last;  // all of it is dark: that is no plateau of light
  std::vector<std::uint16_t> plateau;
  for (std::size_t k = 0; k + 1 < order.size(); ++k) {
    const Frame& darker = sweep.frames[order[k]];
    const Frame& brighter = sweep.frames[order[k + 1]];
    if (brighter.info.effective_exposure_s() < 1.1 * darker.info.effective_exposure_s()) continue;
    const std::vector<std::uint16_t>&a = codes_of(darker).data, &b = codes_of(brighter).data;
    for (std::size_t i = 0; i < a.size(); ++i)
      if (a[i] >= edge && b[i] >= edge) plateau.push_back(b[i]);
  }
  constexpr std::size_t enough = 10;  // fewer may be defect pixels
  if (plateau.size() < enough) return last;
  return quantile(plateau, 0.01);
}

ChannelSamples channel_samples(const ExposureSweep& sweep, int channel) {
  ChannelSamples samples;
  for (const Frame& frame : sweep.frames) samples.log_exposure.push_back(std::log(frame.info.effective_exposure_s()));
  const ImageU16& first = codes_of(sweep.frames.front());
  const bool rgb = sweep.format.layout == PixelLayout::rgb;
  const bool mosaic = !rgb && sweep.format.layout != PixelLayout::mono;
  for (int y = 0; y < first.height; ++y)
    for (int x = 0; x < first.width; ++x) {
      if (mosaic && colour_at(sweep.format.layout, x, y) != channel) continue;
      const std::size_t index = first.index(x, y, rgb ? channel : 0);
      for (const Frame& frame : sweep.frames) samples.codes.push_back(codes_of(frame).data[index]);
    }
  return samples;
}

namespace {

// Codes in a measure that grows with brightness in the dark and in the light; its sum over a pixel's frames orders the
// pixels by brightness even when some frames are clipped.
double brightness_key(const ChannelSamples& samples, std::size_t pixel, double clear) {
  double key = 0;
  for (std::size_t i = 0; i < samples.frame_count(); ++i)
    key += std::log1p(std::max(0.0, samples.pixel(pixel)[i] / std::max(1.0, clear)));
  return key;
}

bool is_usable(const ChannelSamples& samples, std::size_t pixel, double clear, double saturation) {
  int unsaturated = 0;
  bool seen = false;
  for (std::size_t i = 0; i < samples.frame_count(); ++i) {
    const double code = samples.pixel(pixel)[i];
    if (code >= saturation) continue;
    ++unsaturated;
    seen = seen || code > clear;
  }
  return seen && unsaturated >= 2;
}

// How many to take from each bin so that the total is `count` and no bin gives more than it must.
std::size_t quota(const std::vector<std::vector<std::size_t>>& bins, std::size_t count) {
  std::size_t low = 0, high = count;
  while (low < high) {
    const std::size_t middle = (low + high + 1) / 2;
    std::size_t total = 0;
    for (const auto& bin : bins) total += std::min(bin.size(), middle);
    if (total <= count)
      low = middle;
    else
      high = middle - 1;
  }
  return low;
}

}  // namespace

ChannelSamples spread_samples(const ChannelSamples& all, std::size_t count, double clear, double saturation) {
  std::vector<std::size_t> usable;
  std::vector<double> keys;
  for (std::size_t i = 0; i < all.pixel_count(); ++i) {
    if (!is_usable(all, i, clear, saturation)) continue;
    usable.push_back(i);
    keys.push_back(brightness_key(all, i, clear));
  }
  ChannelSamples chosen{all.log_exposure, {}};
  if (usable.empty()) return chosen;
  const auto [low, high] = std::minmax_element(keys.begin(), keys.end());
  constexpr std::size_t bin_count = 64;
  std::vector<std::vector<std::size_t>> bins(bin_count);
  for (std::size_t k = 0; k < usable.size(); ++k) {
    const double place = *high > *low ? (keys[k] - *low) / (*high - *low) : 0;
    bins[std::min(bin_count - 1, static_cast<std::size_t>(place * bin_count))].push_back(usable[k]);
  }
  const std::size_t take = quota(bins, count);
  for (const auto& bin : bins) {
    const std::size_t n = std::min(bin.size(), take);
    for (std::size_t k = 0; k < n; ++k) {
      const float* codes = all.pixel(bin[k * bin.size() / n]);
      chosen.codes.insert(chosen.codes.end(), codes, codes + all.frame_count());
    }
  }
  return chosen;
}

}  // namespace mf
