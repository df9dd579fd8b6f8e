// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <variant>
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
  std::int64_t written_anew = 0;  // frames whose first file the disk would not take
  int queued = 0;
  int most_queued = 0;
  std::optional<std::string> failure;  // one line: the recording has stopped, what is durable is intact
  bool disk_is_full = false;           // that was why
};

// Takes frames from the capturing thread and makes them durable in a session: a bounded queue of preallocated buffers,
// a thread that compresses and writes, and one that syncs (SessionWriter::commit), so that neither the camera nor the
// writing ever waits for the disk. When the queue fills beyond half, and it is the compressing that takes the time,
// frames are stored uncompressed; a full queue refuses frames, and each refusal is a gap.
//
// A frame whose file the disk does not take is written anew, under another name. When that does not help, or the disk
// is full, nothing more is written: what was committed stays as it is.
class Recorder {
 public:
  // `writer` must be in batches. `start_monotonic_ns` is time_s = 0.
  Recorder(SessionWriter writer, const CameraDescription&, std::int64_t start_monotonic_ns, const RecorderOptions&);
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;
  ~Recorder();

  // A free buffer to receive into; nullptr when the queue is full or the recording has failed.
  [[nodiscard]] CameraFrame* acquire();
  void submit(CameraFrame*, FrameRole = FrameRole::mirror);  // what acquire() gave, filled
  void give_back(CameraFrame*);                              // what acquire() gave, not used
  // What was seen in a frame that was submitted before, told apart by its arrival. Forgotten when that frame is not
  // among the recorded ones.
  void note_tags(const FrameArrival&, std::vector<TagDetection>, const std::optional<Rigid3>& cam_from_mirror);
  // Frames that will never come. `missing` 0: nobody can tell how many.
  void note_gap(std::int64_t missing, std::int64_t monotonic_ns, const std::string& reason);

  // SessionWriter::write_document(); what fails there fails the recording. Not after finish().
  void write_document(const std::string& key, const nlohmann::json&);

  [[nodiscard]] RecorderStatus status() const;
  // Writes what is queued, makes it durable and closes the session. The status tells of a failure.
  void finish();

 private:
  struct SubmittedFrame {
    CameraFrame* frame;
    FrameRole role;
  };
  struct SeenTags {
    std::int64_t monotonic_ns;  // of the frame's arrival
    FrameTags seen;
  };
  using Queued = std::variant<SubmittedFrame, FrameGap, SeenTags>;
  [[nodiscard]] int queued() const { return options_.queue_frames - static_cast<int>(free_.size()); }
  void write_frames();
  void write(const SubmittedFrame&);
  void write(const FrameGap&);
  void write(const SeenTags&);
  void remember(const FrameArrival&, std::int64_t id);
  void sync_regularly();
  void fail(const std::exception& why);

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

  // The writing thread's own.
  std::int64_t next_id_ = 0;
  std::map<std::int64_t, std::int64_t> id_at_;  // of the last frames, by the time of their arrival
  double encoding_s_ = 0, writing_s_ = 0;       // of a frame, over the last ones

  std::thread writing_;
  std::thread syncing_;
};

}  // namespace mf
