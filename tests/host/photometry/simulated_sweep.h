// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "common/response_curve.h"
#include "host/photometry/exposure_sweep.h"

namespace mf {

// A static scene of log-uniform radiance and a small lamp, through filters, seen by a sensor with a known response.
struct SimulatedSweep {
  ResponseCurve truth;  // its exposures are radiance × seconds
  PixelFormat format;
  double brightest = 1;  // exposure of the scene's brightest surface in the longest frame, of full scale
  double decades = 3;    // of radiance below that
  double lamp = 1;       // the lamp's exposure there, of full scale; 0.4 % of the pixels
  std::vector<double> densities{0, 0.3, 0.6, 0.9, 1.2, 1.5, 1.8, 2.1, 2.4, 2.7, 3.0, 3.3};
  double read_noise = 1.2;   // codes
  double shot_noise = 0.01;  // relative noise of the light at full scale
  int size = 96;
  unsigned seed = 1;

  [[nodiscard]] ExposureSweep frames() const {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(0, 1);
    std::normal_distribution<double> normal(0, 1);
    const double full = truth.channels[0].exposure.back();
    const int channels = format.stored_channels();
    std::vector<double> scene(static_cast<std::size_t>(size * size * channels));
    for (double& x : scene)
      x = full * (uniform(random) < 0.004 ? lamp : brightest * std::pow(10, -decades * uniform(random)));
    ExposureSweep sweep;
    sweep.source = "simulated";
    sweep.format = format;
    for (const double density : densities) {
      Frame frame;
      frame.info = {"nd" + std::to_string(density), FrameRole::sweep, 1, density, 0};
      ImageU16 image(size, size, channels);
      for (std::size_t i = 0; i < scene.size(); ++i) {
        const double light = scene[i] * std::pow(10, -density);
        const double noisy = light + normal(random) * shot_noise * std::sqrt(light * full);
        const int x = static_cast<int>(i) % size, y = static_cast<int>(i) / size;
        const int channel = channels == 3 ? static_cast<int>(i % 3) : colour_at(format.layout, x, y);
        const double code = truth.code_of(channel, std::max(0.0, noisy)) + normal(random) * read_noise;
        image.data[i] = static_cast<std::uint16_t>(
            std::clamp(std::round(code), 0.0, static_cast<double>(format.level_count() - 1)));
      }
      frame.pixels = std::move(image);
      sweep.frames.push_back(std::move(frame));
    }
    return sweep;
  }
};

// How far an estimated channel is from the truth, in stops, over codes from `first` to `last`, one factor taken out.
struct CurveError {
  double rms = 0, most = 0;
};
inline CurveError curve_error(const ResponseChannel& estimate, const ResponseChannel& truth, int first, int last) {
  std::vector<double> error;
  for (int m = first; m <= last; ++m)
    error.push_back(
        std::log2(estimate.exposure[static_cast<std::size_t>(m)] / truth.exposure[static_cast<std::size_t>(m)]));
  std::vector<double> sorted = error;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
  const double median = sorted[sorted.size() / 2];
  CurveError out;
  for (const double e : error) {
    out.rms += (e - median) * (e - median) / static_cast<double>(error.size());
    out.most = std::max(out.most, std::abs(e - median));
  }
  out.rms = std::sqrt(out.rms);
  return out;
}

}  // namespace mf
