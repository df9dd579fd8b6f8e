// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <functional>
#include <random>
#include <vector>

#include "device/coverage.h"
#include "device/guidance.h"

namespace mf::test {

// What the mirror shows, in closed form: relative luminance that arrives at a world point from a unit direction.
using Surroundings = std::function<double(const Eigen::Vector3d& at, const Eigen::Vector3d& from)>;
[[nodiscard]] Surroundings lamp_in_a_dark_room();  // a globe at one metre, 2000 times as bright as the walls
[[nodiscard]] Surroundings windows_and_sky();
[[nodiscard]] Surroundings uniform_light();

// A table under a camera with the simulator's mirror.
[[nodiscard]] MirrorReach desk_reach();
[[nodiscard]] CoverageOptions desk_coverage();

// The frame's luminance, `reduction` times smaller than the camera's picture: what the opening shows, black elsewhere.
[[nodiscard]] ImageF mirrored(const MirrorReach&, const Rigid3& world_from_mirror, const Surroundings&, int reduction);

constexpr double frame_rate_hz = 12;  // of detection on a quarter of a core

// A hand that holds a mirror: half a metre and 60 degrees a second, and it trembles.
class Hand {
 public:
  Hand(const MirrorReach& reach, unsigned seed);

  // Straight to places drawn at random: a direction of the hemisphere and a point of the plane, all alike.
  void wander(const LightPlane&, double seconds);
  // What it was told `lag` ago, not quite in that direction nor with that speed; one time in ten not at all, for a
  // second. When the camera lost sight of the mirror, back to where it was seen last.
  void obey(const HandMotion&, double seconds);

  void approach(const Rigid3& place, double seconds);  // straight, at full speed
  // world_from_mirror with the tremor of this moment.
  [[nodiscard]] Rigid3 held();
  [[nodiscard]] bool seen(const Rigid3& held) const { return reach_->sees(held); }

 private:
  [[nodiscard]] double normal() { return normal_(random_); }
  [[nodiscard]] Rigid3 anywhere(const LightPlane&);

  const MirrorReach* reach_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_{0, 1};
  Rigid3 world_from_mirror_, last_seen_;
  std::optional<Rigid3> goal_;
  std::deque<HandMotion> heard_;
  HandMotion doing_;
  double doing_s_ = 0;
  bool listens_ = true;
  Eigen::Vector3d swerve_ = Eigen::Vector3d::Zero(), twist_ = Eigen::Vector3d::Zero();
  double pace_ = 1;
};

enum class Waving { random, guided };

struct Waved {
  int frames = 0;  // until 95 % were covered, or all
  bool reached = false;
  std::vector<double> covered;  // after every fourth frame
};
// `look` is called after every fourth frame, when given.
[[nodiscard]] Waved wave(Waving, const Surroundings&, const CoverageOptions&, unsigned seed, int most_frames,
                         const std::function<void(int, const CoverageStatus&)>& look = {});
// The same for poses that are given (in the world).
[[nodiscard]] Waved wave(const std::vector<Rigid3>& world_from_mirror, const Surroundings&,
                         const std::function<void(int, const CoverageStatus&)>& look = {});

}  // namespace mf::test
