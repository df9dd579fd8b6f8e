// SPDX-License-Identifier: Apache-2.0
#include "host/calibration/session_targets.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>

namespace mf {

namespace {

// Runs `work(worker, index)` for every index on `threads` threads; rethrows the first exception after all have ended.
void for_each_index(std::size_t count, int threads, const std::function<void(std::size_t, std::size_t)>& work,
                    const std::function<void(std::size_t)>& done) {
  std::atomic<std::size_t> next{0};
  std::atomic<bool> failed{false};
  std::mutex mutex;
  std::exception_ptr error;
  std::size_t finished = 0;
  const auto run = [&](std::size_t worker) {
    for (std::size_t i = next++; i < count && !failed; i = next++) {
      try {
        work(worker, i);
        const std::scoped_lock lock(mutex);
        done(++finished);
      } catch (...) {
        const std::scoped_lock lock(mutex);
        if (!error) error = std::current_exception();
        failed = true;
      }
    }
  };
  {
    std::vector<std::jthread> others;
    for (int i = 1; i < threads; ++i) others.emplace_back(run, static_cast<std::size_t>(i));
    run(0);
  }
  if (error) std::rethrow_exception(error);
}

}  // namespace

CalibrationInput find_session_targets(const SessionReader& session, const ResponseCurve& response,
                                      const TagSearchOptions& options, int threads, const Progress& progress) {
  const SessionHeader& header = session.header();
  if (threads <= 0) threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  std::vector<TagSearch> mirror_search, world_search;
  for (int i = 0; i < threads; ++i) {
    mirror_search.emplace_back(searched_target(header.target), options);
    if (header.world) world_search.emplace_back(searched_target(*header.world), options);
  }
  const std::vector<SessionFrame> mirror = session.frames(FrameRole::mirror);
  const std::vector<SessionFrame> scene = header.world ? session.frames(FrameRole::scene) : std::vector<SessionFrame>{};
  const PixelLayout layout = header.format.layout == PixelLayout::rgb ? PixelLayout::mono : header.format.layout;
  CalibrationInput input;
  input.source = session.folder().string();
  input.width = header.width;
  input.height = header.height;
  input.mirror.resize(mirror.size());
  input.world.name = "world";
  std::vector<std::vector<TagSighting>> world_tags(scene.size());
  const std::size_t count = mirror.size() + scene.size();
  for_each_index(
      count, threads,
      [&](std::size_t worker, std::size_t i) {
        const bool is_mirror = i < mirror.size();
        const SessionFrame& frame = is_mirror ? mirror[i] : scene[i - mirror.size()];
        const ImageF picture = luminance(linearize(session.read_frame(frame), header.format, response));
        if (is_mirror)
          input.mirror[i] = {frame.info.name, mirror_search[worker].find(picture, layout)};
        else
          world_tags[i - mirror.size()] = world_search[worker].find(picture, layout);
      },
      [&](std::size_t finished) {
        report_progress(progress, "finding tags", static_cast<double>(finished) / static_cast<double>(count));
      });
  for (const std::vector<TagSighting>& tags : world_tags)
    input.world.tags.insert(input.world.tags.end(), tags.begin(), tags.end());
  return input;
}

}  // namespace mf
