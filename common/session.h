// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/frame.h"
#include "common/mirror_target.h"
#include "common/rigid3.h"
#include "common/tag_detector.h"
#include "common/tiff_image.h"

namespace mf {

// What a session holds beside its frames.
struct SessionHeader {
  PixelFormat format;
  int width = 0;  // pixels, the same for every frame
  int height = 0;
  double black_level_hint = 0;    // code
  double mirror_reflectance = 1;  // (0, 1], the same in every channel
  MirrorTarget target;
  std::optional<WorldTarget> world;
  // A spot-meter reading that sets the absolute scale: mean linear radiance over a disc of a frame.
  struct Reference {
    std::string frame;  // name of a scene frame
    double x_px = 0, y_px = 0, radius_px = 0;
    std::vector<double> radiance;  // one per colour channel
  };
  std::optional<Reference> reference;
};

// When a frame came from a camera, by every clock there is.
struct FrameArrival {
  std::int64_t device_frame = 0;  // the camera's own count
  std::int64_t device_ns = 0;     // the camera's clock
  std::int64_t monotonic_ns = 0;  // CLOCK_MONOTONIC when it had arrived
  std::int64_t realtime_ns = 0;   // CLOCK_REALTIME then
};

// Frames that the camera took, or should have taken, and that the recording does not have.
struct FrameGap {
  std::int64_t next_id = 0;       // the frame that was recorded first after it
  std::int64_t missing = 0;       // frames; 0 when nobody can tell
  std::int64_t monotonic_ns = 0;  // when it was noticed
  std::string reason;             // one line
};

// What was seen in a frame while it was recorded.
struct FrameTags {
  std::int64_t frame = 0;                 // its id
  std::vector<TagDetection> tags;         // of the mirror and of the world
  std::optional<Rigid3> cam_from_mirror;  // the online pose, when there was one
};

struct SessionFrame {
  std::int64_t id = 0;  // in the order of recording
  FrameInfo info;
  std::optional<FrameArrival> arrival;  // nothing for imported frames
  std::string file;                     // below the session's folder
  std::int64_t bytes = 0;               // the file's size
  std::uint32_t crc32 = 0;              // the file's CRC-32, so that damage is never read as light
  bool damaged = false;                 // this row is not as it was written: read_frame() refuses it
};

// A frame as its file holds it: what costs time (compression) is done, what is left is writing.
struct EncodedFrame {
  FrameInfo info;
  std::string tiff;
  std::optional<FrameArrival> arrival;
};

// A recording on disk: `session.db` (SQLite, WAL) and `frames/NNNNNN.tif` (16-bit TIFF, or 32-bit float for linear
// frames; deflate with predictor). A frame's row exists only once its file is durable. docs/session.md has the schema.
//
// The one writer. Throws InputError naming the file: the folder exists already, no permission; WriteError when the
// system does not write: the disk is full, or broken.
class SessionWriter {
 public:
  enum class Durability {
    each,     // when append() returns, the frame is durable and has its row
    batches,  // when commit() or finish() returns, all frames appended before it are durable and have their rows
  };
  struct Options {
    Durability durability = Durability::each;
    // In batches: the system's memory need not hold the frames that are durable. A recording would fill it in a minute,
    // and to find ever more pages costs more than to use the same ones again.
    bool read_later = false;
  };
  SessionWriter(const std::filesystem::path& folder, const SessionHeader&, const Options&);
  SessionWriter(SessionWriter&&) noexcept;
  ~SessionWriter();

  // Precondition: format and size as in the header. Safe to call from many threads at once, and beside append().
  [[nodiscard]] EncodedFrame encode(const Frame&, TiffCompression = TiffCompression::deflate) const;
  // Returns the frame's id: 0, 1, 2 ... Names are unique in a role.
  std::int64_t append(EncodedFrame);
  std::int64_t append(const Frame& frame) { return append(encode(frame)); }
  // May run in a thread of its own beside append(). Returns how many frames the session has durably, in all.
  std::int64_t commit();
  // In batches, a frame whose file could not be written or synced is written again, under another name: the same file
  // is never tried twice, as what a failed sync leaves of it cannot be known (Rebello et al. 2020). So many times that
  // happened. When it does not help either, or the disk is full, append() and commit() throw.
  [[nodiscard]] std::int64_t written_anew() const;
  // Durable with the frames appended before it.
  void append(const FrameGap&);
  // Likewise. Its frame was appended before.
  void append(FrameTags);
  // A document beside the header's, durable at once: what the camera said of itself, say. Replaces one of this key.
  void write_document(const std::string& key, const nlohmann::json&);
  // Everything durable, the index closed and a single file. A session without it is still readable up to its last
  // durable row. Nothing may be appended afterwards.
  void finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// The one reader; it never writes, and reads beside a running writer. Safe to share among threads for read_frame().
class SessionReader {
 public:
  // Throws InputError when the folder holds no session or its index is damaged.
  explicit SessionReader(std::filesystem::path folder);
  SessionReader(SessionReader&&) noexcept;
  ~SessionReader();

  [[nodiscard]] const std::filesystem::path& folder() const;
  [[nodiscard]] const SessionHeader& header() const;
  [[nodiscard]] const std::vector<SessionFrame>& frames() const;    // all, by id
  [[nodiscard]] std::vector<SessionFrame> frames(FrameRole) const;  // of one role, by id
  [[nodiscard]] const std::vector<FrameGap>& gaps() const;          // by next_id
  // What the index once told of and does not any more, or tells wrongly: a line for each kind, that names the file and
  // the remedy. Empty when it is whole. Damage that leaves nothing to read is thrown instead; that of a frame's file is
  // told of by read_frame().
  [[nodiscard]] const std::vector<std::string>& damage() const;
  // Frames whose files are there, but that the index does not tell of: a recording that runs, or was killed, has those
  // of its last moments, which were not acknowledged.
  [[nodiscard]] std::int64_t frames_without_row() const;
  // What write_document() wrote; nothing when there is no such document.
  [[nodiscard]] std::optional<nlohmann::json> document(const std::string& key) const;
  // What was seen while recording, by frame; not every frame was looked at, and imported ones never. Throws InputError.
  [[nodiscard]] std::vector<FrameTags> tags() const;
  // Throws InputError naming the file when it is missing, truncated, damaged or of another size, or the index when the
  // frame's row is damaged. Pixels outside of `rows` may be 0.
  [[nodiscard]] Frame read_frame(const SessionFrame&, const RowRange& rows = {}) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mf
