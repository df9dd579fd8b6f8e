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

struct SessionFrame {
  std::int64_t id = 0;  // in the order of recording
  FrameInfo info;
  std::string file;         // below the session's folder
  std::int64_t bytes = 0;   // the file's size
  std::uint32_t crc32 = 0;  // the file's CRC-32, so that damage is never read as light
};

// A frame as its file holds it: what costs time (compression) is done, what is left is writing.
struct EncodedFrame {
  FrameInfo info;
  std::string tiff;
};

// A recording on disk: `session.db` (SQLite, WAL) and `frames/NNNNNN.tif` (16-bit TIFF, or 32-bit float for linear
// frames; deflate with predictor). A frame's row exists only once its file is durable. docs/session.md has the schema.
//
// The one writer. Throws InputError naming the file: the folder exists already, disk full, no permission.
class SessionWriter {
 public:
  // When durable_each is false, frames become durable together, at finish() (an import can be repeated).
  struct Options {
    bool durable_each = true;
  };
  SessionWriter(const std::filesystem::path& folder, const SessionHeader&, const Options&);
  SessionWriter(SessionWriter&&) noexcept;
  ~SessionWriter();

  // Precondition: format and size as in the header. Safe to call from many threads at once, and beside append().
  [[nodiscard]] EncodedFrame encode(const Frame&) const;
  // Returns the frame's id: 0, 1, 2 ... Names are unique in a role.
  std::int64_t append(const EncodedFrame&);
  std::int64_t append(const Frame& frame) { return append(encode(frame)); }
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
  // Throws InputError naming the file when it is missing, truncated, damaged or of another size.
  [[nodiscard]] Frame read_frame(const SessionFrame&) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mf
