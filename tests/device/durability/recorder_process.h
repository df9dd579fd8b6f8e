// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>

namespace mf::test {

// What the recorder program says of itself. The first word comes when the session is made.
struct RecorderWord {
  std::int64_t taken = 0;     // frames handed to the recorder
  std::int64_t durable = 0;   // frames that it has acknowledged
  std::int64_t first_ns = 0;  // arrival of the first frame taken, CLOCK_MONOTONIC
  std::int64_t last_ns = 0;   // of the last one
};

// A process that records the scripted camera at 50 frames a second; killed at the end.
class RecorderProcess {
 public:
  // `preload`: a library for LD_PRELOAD, or empty.
  explicit RecorderProcess(const std::filesystem::path& session, const std::filesystem::path& preload = {});
  RecorderProcess(const RecorderProcess&) = delete;
  RecorderProcess& operator=(const RecorderProcess&) = delete;
  ~RecorderProcess();

  // What it has said so far.
  [[nodiscard]] RecorderWord last_word();
  [[nodiscard]] bool began() const { return words_ > 0; }  // of what last_word() has seen
  void kill();                                             // SIGKILL, and waits for its end

 private:
  pid_t child_ = -1;
  int pipe_ = -1;
  RecorderWord word_;
  std::int64_t words_ = 0;
};

struct Recovered {
  std::int64_t frames = 0;      // rows, every one of which reads back as the camera gave it
  double unacknowledged_s = 0;  // from the last acknowledged frame to the last one taken
};

// Opens the session and compares every frame; failed expectations tell what is wrong. At least `word.durable` frames
// must be there.
Recovered expect_recovered(const std::filesystem::path& session, const RecorderWord& word);

}  // namespace mf::test
