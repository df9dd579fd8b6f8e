// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>

namespace mf::sim {

// A counter-based generator: the same key gives the same numbers on every thread and machine (SplitMix64,
// Steele et al. 2014).
class Random {
 public:
  explicit Random(std::uint64_t key) : state_(key) {}
  std::uint64_t next() {
    state_ += 0x9e3779b97f4a7c15ULL;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27U)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31U);
  }
  float uniform() { return static_cast<float>(next() >> 40U) * 0x1p-24F; }  // [0, 1)

  // Standard normal (Box–Muller, one of the pair).
  float normal() {
    const float u = 1 - uniform();
    return std::sqrt(-2 * std::log(u)) * std::cos(6.2831853F * uniform());
  }

 private:
  std::uint64_t state_;
};

// Mixes the parts of a key: seed, picture, pixel.
inline std::uint64_t mix(std::uint64_t a, std::uint64_t b) {
  return Random(a * 0xd1342543de82ef95ULL + b).next();
}

// Points of [0, 1)² for the decisions along a path. The first three decisions of a pixel's samples are spread evenly
// (a Kronecker sequence with the generalized golden ratio of six dimensions, shifted at random per pixel); later ones
// are independent.
class Sampler {
 public:
  explicit Sampler(std::uint64_t pixel_key) : random_(pixel_key) {
    for (float& s : shift_) s = random_.uniform();
  }
  void start_sample(int sample) {
    sample_ = sample;
    dimension_ = 0;
  }
  Eigen::Vector2f next_2d() {
    if (dimension_ >= dimensions) return {random_.uniform(), random_.uniform()};
    const float u = component();
    return {u, component()};
  }

 private:
  static constexpr int dimensions = 6;
  // phi^-1 … phi^-6 with phi⁷ = phi + 1.
  static constexpr std::array<double, dimensions> steps{0.8986537126286993, 0.8075784952213448, 0.7257334129697598,
                                                        0.6521830259439717, 0.5860866975779757, 0.5266889867007359};
  float component() {
    const std::size_t d = static_cast<std::size_t>(dimension_++);
    const double x = static_cast<double>(shift_[d]) + steps[d] * sample_;
    return std::min(static_cast<float>(x - std::floor(x)), 0x1.fffffep-1F);
  }

  Random random_;
  std::array<float, dimensions> shift_{};
  int sample_ = 0;
  int dimension_ = 0;
};

}  // namespace mf::sim
