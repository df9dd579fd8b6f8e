// SPDX-License-Identifier: Apache-2.0
// durability_recorder SESSION: records the scripted camera for ever, and writes to standard output what it would swear
// to: a RecorderWord after each frame (recorder_process.h). It is there to be killed.
#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <exception>
#include <thread>

#include "device/clock.h"
#include "device/recorder.h"
#include "tests/device/durability/recorder_process.h"
#include "tests/device/scripted_camera.h"

namespace {

using namespace mf;

SessionHeader header_of(const CameraDescription& camera) {
  SessionHeader header = test::header_with_target();
  header.format = camera.format;
  header.width = camera.width;
  header.height = camera.height;
  return header;
}

bool tell(const test::RecorderWord& word) {
  return ::write(STDOUT_FILENO, &word, sizeof word) == static_cast<ssize_t>(sizeof word);
}

void record(const std::filesystem::path& session) {
  test::Script script;
  script.frames = 1'000'000;
  script.period = std::chrono::milliseconds(20);
  test::ScriptedCamera camera(std::make_shared<test::ScriptRun>(script));
  const CameraDescription& description = camera.description();
  Recorder recorder(SessionWriter(session, header_of(description), {SessionWriter::Durability::batches}), description,
                    clock_ns(CLOCK_MONOTONIC), {});
  test::RecorderWord word;
  while (tell(word)) {
    CameraFrame* frame = recorder.acquire();
    if (frame == nullptr) {
      if (recorder.status().failure) throw std::runtime_error(*recorder.status().failure);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    } else if (camera.receive(*frame, std::chrono::milliseconds(100)) == Received::frame) {
      word.last_ns = frame->arrival.monotonic_ns;
      if (word.taken++ == 0) word.first_ns = word.last_ns;
      recorder.submit(frame);
    } else {
      recorder.give_back(frame);
    }
    word.durable = recorder.status().durable;
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  try {
    record(argv[1]);
  } catch (const std::exception& e) {
    fmt::print(stderr, "{}\n", e.what());
  }
  return 1;
}
