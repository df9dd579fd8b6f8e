// SPDX-License-Identifier: Apache-2.0
#include "tests/device/durability/recorder_process.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>

#include "common/error.h"
#include "common/session.h"
#include "tests/device/scripted_camera.h"

namespace mf::test {

RecorderProcess::RecorderProcess(const std::filesystem::path& session, const std::filesystem::path& preload) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
  const std::string program = std::string(MF_BINARY_DIR) + "/durability_recorder";
  child_ = ::fork();
  if (child_ == 0) {
    ::dup2(ends[1], STDOUT_FILENO);
    if (!preload.empty()) ::setenv("LD_PRELOAD", preload.c_str(), 1);
    ::execl(program.c_str(), program.c_str(), session.c_str(), nullptr);
    ::_exit(127);
  }
  ::close(ends[1]);
  pipe_ = ends[0];
  ::fcntl(pipe_, F_SETFL, O_NONBLOCK);
}

RecorderProcess::~RecorderProcess() {
  kill();
  ::close(pipe_);
}

RecorderWord RecorderProcess::last_word() {
  RecorderWord word;
  while (::read(pipe_, &word, sizeof word) == static_cast<ssize_t>(sizeof word)) {
    word_ = word;
    ++words_;
  }
  return word_;
}

void RecorderProcess::kill() {
  if (child_ < 0) return;
  ::kill(child_, SIGKILL);
  ::waitpid(child_, nullptr, 0);
  child_ = -1;
}

Recovered expect_recovered(const std::filesystem::path& session, const RecorderWord& word) {
  Recovered recovered;
  try {
    const SessionReader reader(session);
    std::int64_t last_acknowledged_ns = word.first_ns;
    for (const SessionFrame& frame : reader.frames()) {
      EXPECT_EQ(frame.id, recovered.frames);
      EXPECT_EQ(frame.arrival.value().device_frame, frame.id + 1);
      EXPECT_EQ(std::get<ImageU16>(reader.read_frame(frame).pixels).data, scripted_codes(frame.id + 1).data);
      if (++recovered.frames == word.durable) last_acknowledged_ns = frame.arrival->monotonic_ns;
    }
    recovered.unacknowledged_s = 1e-9 * static_cast<double>(word.last_ns - last_acknowledged_ns);
  } catch (const InputError& e) {
    ADD_FAILURE() << e.what();
  }
  EXPECT_GE(recovered.frames, word.durable) << "acknowledged frames are lost";
  return recovered;
}

}  // namespace mf::test
