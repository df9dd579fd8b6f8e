// SPDX-License-Identifier: Apache-2.0
#include "device/capture.h"

#include <chrono>
#include <utility>

namespace mf {

CaptureResult capture(const OpenCamera& open, const std::filesystem::path& session, SessionHeader header,
                      const CaptureOptions& options, const std::atomic<bool>& stop,
                      const std::function<void(const RecorderStatus&)>& each_second) {
  CameraKeeper keeper(open, options.reopen_each);  // before there is a session: a camera that is away leaves none
  Recording recording(session, std::move(header), keeper.description(), options.recorder);
  const auto start = std::chrono::steady_clock::now();
  const auto elapsed = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(); };
  double told = 0;
  while (!stop && (options.most_seconds <= 0 || elapsed() < options.most_seconds) && !recording.status().failure) {
    recording.take(keeper.receive(recording.next_buffer(), std::chrono::milliseconds(100)));
    if (!each_second || elapsed() - told < 1) continue;
    told = elapsed();
    each_second(recording.status());
  }
  const double seconds = elapsed();
  return {keeper.description(), recording.finish(), seconds};
}

}  // namespace mf
