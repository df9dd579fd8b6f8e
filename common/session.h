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
  std::string file;  // below the session's folder
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

  // Precondition: format and size as in the header. Returns the frame's id.
  std::int64_t append(const Frame&);
  // Everything durable, the index closed. A session without it is still readable up to its last durable row.
  void finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// The one reader. Safe to share among threads for read_frame().
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
  // Throws InputError naming the file when it is missing, truncated or of another size.
  [[nodiscard]] Frame read_frame(const SessionFrame&) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mf
