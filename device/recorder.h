// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "common/session.h"
#include "device/camera_source.h"

namespace mf {

struct RecorderOptions {
  int queue_frames = 48;                     // preallocated; ≥ 2
  std::chrono::milliseconds sync_each{250};  // how often what was written becomes durable; > 0
};

struct RecorderStatus {
  std::int64_t durable = 0;  // frames that survive a power cut
  std::int64_t written = 0;  // frames handed to the file system
  std::int64_t lost = 0;     // frames known to be missing, over all gaps
  std::int64_t gaps = 0;
  std::int64_t uncompressed = 0;  // frames stored without compression, to keep up
  int queued = 0;
  int most_queued = 0;
  std::optional<std::string> failure;  // one line: the recording has stopped, what is durable is intact
};

// Takes frames from the capturing thread and makes them durable in a session: a bounded queue of preallocated buffers,
// a thread that compresses and writes, and one that syncs (SessionWriter::commit), so that neither the camera nor the
// writing ever waits for the disk. When the queue fills beyond half, frames are stored uncompressed; a full queue
// refuses frames, and each refusal is a gap.
//
// After a write error nothing more is written: what was committed stays as it is.
class Recorder {
 public:
  // `writer` must be in batches. `start_monotonic_ns` is time_s = 0.
  Recorder(SessionWriter writer, const CameraDescription&, std::int64_t start_monotonic_ns, const RecorderOptions&);
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;
  ~Recorder();

  // A free buffer to receive into; nullptr when the queue is full or the recording has failed.
  [[nodiscard]] CameraFrame* acquire();
  void submit(CameraFrame*);     // what acquire() gave, filled
  void give_back(CameraFrame*);  // what acquire() gave, not used
  // Frames that will never come. `missing` 0: nobody can tell how many.
  void note_gap(std::int64_t missing, std::int64_t monotonic_ns, const std::string& reason);

  [[nodiscard]] RecorderStatus status() const;
  // Writes what is queued, makes it durable and closes the session. The status tells of a failure.
  void finish();

 private:
  struct Queued {
    CameraFrame* frame = nullptr;  // nullptr: a gap
    FrameGap gap;
  };
  [[nodiscard]] int queued() const { return options_.queue_frames - static_cast<int>(free_.size()); }
  void write_frames();
  void write(const Queued&);
  void sync_regularly();
  void fail(const std::string& why);

  SessionWriter writer_;
  CameraDescription camera_;
  std::int64_t start_ns_;
  RecorderOptions options_;
  std::vector<CameraFrame> buffers_;

  mutable std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::vector<CameraFrame*> free_;
  std::deque<Queued> queue_;
  RecorderStatus status_;
  bool finishing_ = false;    // no more frames come
  bool all_written_ = false;  // the writing thread has ended
  std::int64_t next_id_ = 0;  // the writing thread's own

  std::thread writing_;
  std::thread syncing_;
};

}  // namespace mf
