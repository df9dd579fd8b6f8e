// SPDX-License-Identifier: Apache-2.0
#include "host/photometry/self_consistency.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mf {

namespace {

// Relative noise of a recovered exposure, by the code that the sensor should have given: σ(code) · I'/I.
std::vector<double> relative_noise(const ResponseCurve& curve, int channel, const CodeNoise& noise) {
  const std::vector<double>& exposure = curve.channels[static_cast<std::size_t>(channel)].exposure;
  std::vector<double> relative(exposure.size(), std::numeric_limits<double>::infinity());
  for (std::size_t m = 1; m + 1 < exposure.size(); ++m)
    if (exposure[m - 1] > 0)
      relative[m] = noise.at(static_cast<double>(m)) * (exposure[m + 1] - exposure[m - 1]) / (2 * exposure[m]);
  return relative;
}

struct Sum {
  double value = 0, square = 0, expected = 0;
  std::size_t count = 0;
};

struct WeightedSum {
  double value = 0, weight = 0;
};

constexpr std::size_t code_ranges = 24;

class Measure {
 public:
  Measure(const ChannelSamples& all, const ResponseCurve& curve, int channel, const CodeNoise& noise, double limit)
      : curve_(curve),
        channel_(channel),
        limit_(limit),
        noise_(relative_noise(curve, channel, noise)),
        cells_(all.frame_count() * code_ranges),
        expected_(all.frame_count()),
        frames_(all.frame_count()) {
    for (const double log_t : all.log_exposure) exposure_.push_back(std::exp(log_t));
  }

  void add_pixel(const float* codes) {
    double x = first_guess(codes);
    if (!(x > 0)) return;
    // Weights from the codes that x predicts, not from the noisy ones: those would favour readings that came out high.
    double certainty = 0;
    for (int pass = 0; pass < 2; ++pass) {
      double sum = 0;
      certainty = 0;
      for (std::size_t i = 0; i < exposure_.size(); ++i) {
        expected_[i] = predicted_noise(x * exposure_[i]);
        if (codes[i] >= curve_.saturation_code || !std::isfinite(expected_[i])) continue;
        const double weight = 1 / (expected_[i] * expected_[i]);
        sum += weight * curve_.exposure_of(channel_, codes[i]) / exposure_[i];
        certainty += weight;
      }
      if (!(certainty > 0) || !(sum > 0)) return;
      x = sum / certainty;
    }
    for (std::size_t i = 0; i < exposure_.size(); ++i) {
      if (codes[i] >= curve_.saturation_code) continue;
      ++unsaturated_;
      // A frame's mean averages many readings: noisier ones help too, and a wrong exposure inflates the noise measured.
      constexpr double frame_limit = 0.2;
      if (!(expected_[i] <= std::max(limit_, frame_limit))) continue;
      const double deviation = curve_.exposure_of(channel_, codes[i]) / exposure_[i] / x - 1;
      const double weight = 1 / (expected_[i] * expected_[i]);
      frames_[i].value += weight * deviation;
      frames_[i].weight += weight;
      if (expected_[i] > limit_) continue;
      add_reading(i, curve_.code_of(channel_, x * exposure_[i]), deviation,
                  std::max(0.0, expected_[i] * expected_[i] - 1 / certainty));
    }
  }

  [[nodiscard]] SelfConsistency result() const {
    SelfConsistency out;
    Sum total;
    double systematic = 0;
    for (std::size_t i = 0; i < exposure_.size(); ++i) {
      for (std::size_t range = 0; range < code_ranges; ++range) {
        const Sum& cell = cells_[i * code_ranges + range];
        if (cell.count == 0) continue;
        const double n = static_cast<double>(cell.count), mean = cell.value / n;
        systematic += n * mean * mean - cell.expected / n;
        total.square += cell.square;
        total.expected += cell.expected;
        total.count += cell.count;
      }
      out.frame_mean.push_back(frames_[i].value / frames_[i].weight);  // NaN without readings
    }
    if (total.count == 0) return out;
    const double n = static_cast<double>(total.count);
    out.rms = std::sqrt(total.square / n);
    out.noise = std::sqrt(total.expected / n);
    out.systematic = std::sqrt(std::max(0.0, systematic / n));
    out.readings = total.count;
    out.share = n / static_cast<double>(unsaturated_);
    return out;
  }

 private:
  // The longest unsaturated exposure: the clearest single reading.
  [[nodiscard]] double first_guess(const float* codes) const {
    double longest = 0, x = 0;
    for (std::size_t i = 0; i < exposure_.size(); ++i)
      if (codes[i] < curve_.saturation_code && exposure_[i] > longest) {
        longest = exposure_[i];
        x = curve_.exposure_of(channel_, codes[i]) / exposure_[i];
      }
    return x;
  }

  [[nodiscard]] double predicted_noise(double exposure) const {
    const double code = curve_.code_of(channel_, exposure);
    return noise_[std::min(noise_.size() - 1, static_cast<std::size_t>(std::lround(code)))];
  }

  void add_reading(std::size_t frame, double code, double deviation, double expected) {
    const double reach = std::log1p((static_cast<double>(noise_.size()) - curve_.black_level) / 10);
    const double place = std::log1p(std::max(0.0, code - curve_.black_level) / 10) / reach * code_ranges;
    Sum& cell = cells_[frame * code_ranges + std::min(code_ranges - 1, static_cast<std::size_t>(place))];
    cell.value += deviation;
    cell.square += deviation * deviation;
    cell.expected += expected;
    ++cell.count;
  }

  const ResponseCurve& curve_;
  int channel_;
  double limit_;
  std::vector<double> noise_;     // relative, by code
  std::vector<double> exposure_;  // of each frame, seconds
  std::vector<Sum> cells_;        // frame × code range
  std::vector<double> expected_;  // relative noise of the pixel's readings
  std::vector<WeightedSum> frames_;
  std::size_t unsaturated_ = 0;
};

}  // namespace

SelfConsistency measure_self_consistency(const ChannelSamples& all_pixels, const ResponseCurve& curve, int channel,
                                         const CodeNoise& noise, double noise_limit) {
  Measure measure(all_pixels, curve, channel, noise, noise_limit);
  for (std::size_t j = 0; j < all_pixels.pixel_count(); ++j) measure.add_pixel(all_pixels.pixel(j));
  return measure.result();
}

}  // namespace mf
