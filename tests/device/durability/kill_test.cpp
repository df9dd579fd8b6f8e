// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <memory>
#include <random>
#include <vector>

#include "tests/device/durability/recorder_process.h"
#include "tests/support/full_counts.h"
#include "tests/support/temporary_folder.h"

namespace mf {
namespace {

struct Victims {
  std::vector<test::RecorderWord> words;
  std::vector<std::filesystem::path> sessions;
};

// Some at once, so that it is done sooner: each killed at a moment of its own.
void kill_some(const test::TemporaryFolder& folder, int first, int count, std::mt19937& random, Victims& victims) {
  std::vector<std::unique_ptr<test::RecorderProcess>> running;
  for (int i = 0; i < count; ++i) {
    victims.sessions.push_back(folder / fmt::format("{}", first + i));
    running.push_back(std::make_unique<test::RecorderProcess>(victims.sessions.back()));
  }
  for (int i = 0; i < count; ++i) {
    ::usleep(std::uniform_int_distribution<unsigned>(0, 400'000U)(random));
    running[static_cast<std::size_t>(i)]->kill();
  }
  for (const auto& process : running) {
    victims.words.push_back(process->last_word());
    if (!process->began()) victims.words.back().taken = -1;
  }
}

TEST(Durability, KilledAtAnyMomentNothingThatWasAcknowledgedIsLost) {
  const int kills = test::repetitions(20, 200);
  constexpr int at_once = 4;
  std::mt19937 random(20);
  const test::TemporaryFolder folder;
  std::int64_t acknowledged = 0, recovered = 0, early = 0;
  std::vector<double> unacknowledged_s;
  for (int first = 0; first < kills; first += at_once) {
    Victims victims;
    kill_some(folder, first, std::min(at_once, kills - first), random, victims);
    for (std::size_t i = 0; i < victims.words.size(); ++i) {
      const test::RecorderWord& word = victims.words[i];
      if (word.taken < 0) {  // the session was only being made
        ++early;
        continue;
      }
      const test::Recovered r = test::expect_recovered(victims.sessions[i], word);
      acknowledged += word.durable;
      recovered += r.frames;
      unacknowledged_s.push_back(r.unacknowledged_s);
      std::filesystem::remove_all(victims.sessions[i]);
    }
  }
  ASSERT_GT(unacknowledged_s.size(), static_cast<std::size_t>(kills) / 2);
  EXPECT_GT(acknowledged, kills);  // else it would show nothing
  std::sort(unacknowledged_s.begin(), unacknowledged_s.end());
  const double typical = unacknowledged_s[unacknowledged_s.size() * 9 / 10];
  fmt::print(
      "{} kills ({} before there was a session): {} frames acknowledged, {} recovered; unacknowledged at the kill: "
      "{:.3f} s in nine of ten, {:.3f} s at most\n",
      kills, early, acknowledged, recovered, typical, unacknowledged_s.back());
  EXPECT_LE(typical, 0.5);
  EXPECT_LE(unacknowledged_s.back(), 2.0);  // 0.5 on a machine that does nothing else
}

}  // namespace
}  // namespace mf
