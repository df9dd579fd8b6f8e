// SPDX-License-Identifier: Apache-2.0
//
// How many frames a hand needs until 95 % of the light are covered: guided, at random, and the simulator's own spiral.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <iostream>

#include "hw-sim/motion.h"
#include "tests/device/seen_tags.h"
#include "tests/device/waving_hand.h"

namespace mf::test {
namespace {

constexpr int seeds = 5;
constexpr int most_frames = 6000;

// The spiral knows how long it will be: the fewest frames, of some, that reach 95 %; 0: none does.
int spiral_frames(const Surroundings& scene) {
  const MirrorReach reach = desk_reach();
  const sim::MotionInput input{reach.camera_in_world(), {0.35, 0.45, 0.8}, {0.235, 0.195}};
  for (const int frames : {500, 1000, 2000, 4000}) {
    const Waved waved = wave(sim::wave_mirror(input, frames, 1), scene);
    if (waved.reached) return waved.frames;
  }
  return 0;
}

TEST(GuidedCaptureLong, NeedsAtMostThreeFifthsOfTheFrames) {
  struct Scene {
    const char* name;
    Surroundings light;
  };
  std::vector<double> all;
  for (const Scene& scene : {Scene{"lamp in a dark room", lamp_in_a_dark_room()},
                             Scene{"windows and sky", windows_and_sky()}, Scene{"uniform", uniform_light()}}) {
    std::vector<double> ratios, guided_frames, random_frames;
    for (unsigned seed = 1; seed <= seeds; ++seed) {
      const Waved guided = wave(Waving::guided, scene.light, desk_coverage(), seed, most_frames);
      const Waved random = wave(Waving::random, scene.light, desk_coverage(), seed, most_frames);
      EXPECT_TRUE(guided.reached) << scene.name << " " << seed;
      guided_frames.push_back(guided.frames);
      random_frames.push_back(random.frames);
      ratios.push_back(static_cast<double>(guided.frames) / random.frames);
      all.push_back(ratios.back());
    }
    std::cout << fmt::format(
        "{:<20} guided {:4} random {:4} spiral {:4} frames (medians of {}), ratio {:.2f} ({:.2f} to {:.2f})\n",
        scene.name, median_of(guided_frames), median_of(random_frames), spiral_frames(scene.light), seeds,
        median_of(ratios), *std::min_element(ratios.begin(), ratios.end()),
        *std::max_element(ratios.begin(), ratios.end()));
    EXPECT_LT(median_of(ratios), 1) << scene.name;
  }
  std::cout << fmt::format("median ratio {:.2f}\n", median_of(all));
  EXPECT_LE(median_of(all), 0.6);
}

}  // namespace
}  // namespace mf::test
