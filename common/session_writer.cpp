// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <atomic>
#include <cmath>
#include <cstring>
#include <mutex>
#include <nlohmann/json.hpp>
#include <utility>

#include "common/check.h"
#include "common/durable_file.h"
#include "common/error.h"
#include "common/file_bytes.h"
#include "common/session.h"
#include "common/session_checks.h"
#include "common/session_header.h"
#include "common/session_index.h"
#include "common/sqlite.h"
#include "common/tiff_image.h"

namespace mf {

namespace {

namespace fs = std::filesystem;

constexpr const char* schema = R"sql(
PRAGMA application_id = 0x4d4652;
PRAGMA user_version = 1;
CREATE TABLE meta (
  key  TEXT PRIMARY KEY,
  json TEXT NOT NULL
);
CREATE TABLE frames (
  id         INTEGER PRIMARY KEY,
  role       TEXT NOT NULL CHECK (role IN ('mirror', 'scene', 'sweep')),
  name       TEXT NOT NULL,
  exposure_s REAL NOT NULL CHECK (exposure_s > 0),
  nd_density REAL NOT NULL,
  time_s     REAL NOT NULL,
  file       TEXT NOT NULL UNIQUE,
  bytes      INTEGER NOT NULL,
  crc32      INTEGER NOT NULL,
  UNIQUE (role, name)
);
CREATE TABLE arrivals (
  frame        INTEGER PRIMARY KEY REFERENCES frames (id),
  device_frame INTEGER NOT NULL,
  device_ns    INTEGER NOT NULL,
  monotonic_ns INTEGER NOT NULL,
  realtime_ns  INTEGER NOT NULL
);
CREATE TABLE checks (
  frame INTEGER PRIMARY KEY REFERENCES frames (id),
  crc32 INTEGER NOT NULL
);
CREATE TABLE commits (
  count INTEGER NOT NULL
);
INSERT INTO commits VALUES (0);
CREATE TABLE document_checks (
  key   TEXT PRIMARY KEY REFERENCES meta (key),
  crc32 INTEGER NOT NULL
);
CREATE TABLE gaps (
  next_id      INTEGER NOT NULL,
  missing      INTEGER NOT NULL,
  monotonic_ns INTEGER NOT NULL,
  reason       TEXT NOT NULL
);
CREATE TABLE detections (
  frame INTEGER NOT NULL REFERENCES frames (id),
  tag   INTEGER NOT NULL,
  x0 REAL NOT NULL, y0 REAL NOT NULL, x1 REAL NOT NULL, y1 REAL NOT NULL,
  x2 REAL NOT NULL, y2 REAL NOT NULL, x3 REAL NOT NULL, y3 REAL NOT NULL
);
CREATE TABLE online_poses (
  frame INTEGER PRIMARY KEY REFERENCES frames (id),
  qw REAL NOT NULL, qx REAL NOT NULL, qy REAL NOT NULL, qz REAL NOT NULL,
  tx REAL NOT NULL, ty REAL NOT NULL, tz REAL NOT NULL
);
)sql";

void make_folder(const fs::path& folder) {
  std::error_code error;
  if (fs::create_directory(folder, error)) return;
  if (!error) throw InputError(folder.string(), "", "exists already: choose another name or remove it");
  throw InputError(folder.string(), "",
                   fmt::format("cannot be made ({}): check the parent folder, its permissions and the free space",
                               std::strerror(error.value())));
}

}  // namespace

struct SessionWriter::Impl {
  // Written, but without a row yet. It becomes durable with commit().
  struct Pending {
    SessionFrame frame;
    bool durable = false;  // its file is already
    std::string tiff;      // until then: what is written anew when the file cannot be synced
  };

  fs::path folder;
  SessionHeader header;
  Options options;
  std::mutex pending_mutex;
  std::vector<Pending> pending;
  std::vector<FrameGap> pending_gaps;
  std::vector<FrameTags> pending_tags;
  std::int64_t next_id = 0;  // the appending thread's own
  std::mutex index_mutex;
  std::optional<SqliteDatabase> index;
  std::int64_t committed = 0;  // frames
  std::int64_t commits = 0;    // as in the table of this name
  std::atomic<std::int64_t> written_anew = 0;

  void write_under_new_names(SessionFrame&, const std::string& tiff, bool durable, const WriteError& first);
  void make_durable(std::vector<Pending>&);
  void begin();
  // All that `insert` does, or nothing, is in the index when this returns.
  template <typename Insert>
  void commit(const Insert& insert);
  void write_document(const std::string& key, const nlohmann::json&);
  void insert(const std::vector<Pending>&);
  void insert(const std::vector<FrameGap>&);
  void insert(const std::vector<FrameTags>&);
};

void SessionWriter::Impl::begin() {
  make_folder(folder / "frames");
  index.emplace(session_index_file(folder), SqliteDatabase::Mode::create);
  // FULL: a commit is on the disk when it returns, so a row is never lost after append() has told of it.
  index->run("PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; BEGIN");
  index->run(schema);
  for (const auto& [key, document] : session_header_to_json(header)) write_document(key, document);
  index->run("COMMIT");
  sync_path(folder);
  const fs::path whole = fs::absolute(folder);
  sync_path((whole.has_filename() ? whole : whole.parent_path()).parent_path());  // the session's own name
}

template <typename Insert>
void SessionWriter::Impl::commit(const Insert& insert) {
  index->run("BEGIN");
  try {
    insert();
    index->run("UPDATE commits SET count = count + 1");
    index->run("COMMIT");
  } catch (...) {
    index->run_quietly("ROLLBACK");
    throw;
  }
  ++commits;
  try {
    note_commits(folder, commits);
  } catch (const WriteError&) {  // what is not noted is only not missed, and the disk's state is told of by the frames
  }
}

void SessionWriter::Impl::write_document(const std::string& key, const nlohmann::json& document) {
  const std::string text = document.dump();
  SqliteStatement write(*index, "INSERT OR REPLACE INTO meta (key, json) VALUES (?, ?)");
  write.bind(1, key).bind(2, text).step();
  SqliteStatement check_row(*index, "INSERT OR REPLACE INTO document_checks (key, crc32) VALUES (?, ?)");
  check_row.bind(1, key).bind(2, std::int64_t{crc32(text)}).step();
}

void SessionWriter::Impl::insert(const std::vector<Pending>& frames) {
  SqliteStatement frame_row(*index,
                            "INSERT INTO frames (id, role, name, exposure_s, nd_density, time_s, file, bytes, crc32) "
                            "VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)");
  SqliteStatement arrival_row(*index, "INSERT INTO arrivals VALUES (?, ?, ?, ?, ?)");
  SqliteStatement check_row(*index, "INSERT INTO checks VALUES (?, ?)");
  for (const auto& [frame, durable, tiff] : frames) {
    frame_row.bind(1, frame.id).bind(2, std::string(frame_role_name(frame.info.role))).bind(3, frame.info.name);
    frame_row.bind(4, frame.info.exposure_s).bind(5, frame.info.nd_density).bind(6, frame.info.time_s);
    frame_row.bind(7, frame.file).bind(8, frame.bytes).bind(9, std::int64_t{frame.crc32}).step();
    frame_row.reset();
    check_row.bind(1, frame.id).bind(2, std::int64_t{row_check(frame)}).step();
    check_row.reset();
    if (!frame.arrival) continue;
    const FrameArrival& arrival = *frame.arrival;
    arrival_row.bind(1, frame.id).bind(2, arrival.device_frame).bind(3, arrival.device_ns);
    arrival_row.bind(4, arrival.monotonic_ns).bind(5, arrival.realtime_ns).step();
    arrival_row.reset();
  }
}

void SessionWriter::Impl::insert(const std::vector<FrameGap>& gaps) {
  SqliteStatement row(*index, "INSERT INTO gaps VALUES (?, ?, ?, ?)");
  for (const FrameGap& gap : gaps) {
    row.bind(1, gap.next_id).bind(2, gap.missing).bind(3, gap.monotonic_ns).bind(4, gap.reason).step();
    row.reset();
  }
}

void SessionWriter::Impl::insert(const std::vector<FrameTags>& seen) {
  SqliteStatement tag_row(*index, "INSERT INTO detections VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  SqliteStatement pose_row(*index, "INSERT OR REPLACE INTO online_poses VALUES (?, ?, ?, ?, ?, ?, ?, ?)");
  for (const FrameTags& frame : seen) {
    for (const TagDetection& tag : frame.tags) {
      tag_row.bind(1, frame.frame).bind(2, std::int64_t{tag.id});
      for (int corner = 0; corner < 4; ++corner) {
        const Eigen::Vector2d& at = tag.corners_px[static_cast<std::size_t>(corner)];
        tag_row.bind(3 + 2 * corner, at.x()).bind(4 + 2 * corner, at.y());
      }
      tag_row.step();
      tag_row.reset();
    }
    if (!frame.cam_from_mirror) continue;
    const Eigen::Quaterniond& q = frame.cam_from_mirror->rotation;
    const Eigen::Vector3d& t = frame.cam_from_mirror->translation;
    pose_row.bind(1, frame.frame).bind(2, q.w()).bind(3, q.x()).bind(4, q.y()).bind(5, q.z());
    pose_row.bind(6, t.x()).bind(7, t.y()).bind(8, t.z()).step();
    pose_row.reset();
  }
}

SessionWriter::SessionWriter(const fs::path& folder, const SessionHeader& header, const Options& options)
    : impl_(std::make_unique<Impl>()) {
  check(header.width > 0 && header.height > 0, "a session's frames have a size");
  impl_->folder = folder;
  impl_->header = header;
  impl_->options = options;
  make_folder(folder);
  try {
    impl_->begin();
  } catch (...) {
    impl_.reset();  // closes the index before its folder goes
    std::error_code ignored;
    fs::remove_all(folder, ignored);
    throw;
  }
}

SessionWriter::SessionWriter(SessionWriter&&) noexcept = default;
SessionWriter::~SessionWriter() = default;

EncodedFrame SessionWriter::encode(const Frame& frame, TiffCompression compression) const {
  check(shape_of(frame.pixels) == shape_of(impl_->header), "frame has the session's type, size and channels");
  return {frame.info, encode_tiff(frame.pixels, compression), std::nullopt};
}

// "frames/000007.tif" failed: "frames/000007-1.tif" then, and so on.
void SessionWriter::Impl::write_under_new_names(SessionFrame& row, const std::string& tiff, bool durable,
                                                const WriteError& first) {
  constexpr int most_names = 3;  // a disk that refuses four files in a row is broken
  if (options.durability == Durability::each || first.disk_is_full()) throw first;
  for (int attempt = 1;; ++attempt) {
    row.file = fmt::format("frames/{:06}-{}.tif", row.id, attempt);
    try {
      write_whole_file(folder / row.file, tiff, durable);
      ++written_anew;
      return;
    } catch (const WriteError& e) {
      if (attempt == most_names || e.disk_is_full()) throw;
    }
  }
}

std::int64_t SessionWriter::append(EncodedFrame frame) {
  check(impl_->index.has_value(), "nothing is appended to a finished session");
  check(std::isfinite(frame.info.exposure_s) && frame.info.exposure_s > 0, "a frame's exposure is positive");
  const bool each = impl_->options.durability == Durability::each;
  SessionFrame row;
  row.id = impl_->next_id;
  row.info = frame.info;
  row.arrival = frame.arrival;
  row.file = fmt::format("frames/{:06}.tif", row.id);
  row.bytes = static_cast<std::int64_t>(frame.tiff.size());
  row.crc32 = crc32(frame.tiff);
  try {
    write_whole_file(impl_->folder / row.file, frame.tiff, each);
  } catch (const WriteError& e) {
    impl_->write_under_new_names(row, frame.tiff, each, e);
  }
  {
    const std::lock_guard lock(impl_->pending_mutex);
    impl_->pending.push_back({row, each, each ? std::string() : std::move(frame.tiff)});
  }
  if (each) commit();
  return impl_->next_id++;
}

void SessionWriter::append(const FrameGap& gap) {
  const std::lock_guard lock(impl_->pending_mutex);
  impl_->pending_gaps.push_back(gap);
}

void SessionWriter::Impl::make_durable(std::vector<Pending>& frames) {
  bool names_are_new = false;
  for (Pending& p : frames) {
    if (p.durable) continue;
    try {
      sync_path(folder / p.frame.file, options.read_later ? AfterSync::drop : AfterSync::keep);
    } catch (const WriteError& e) {
      write_under_new_names(p.frame, p.tiff, true, e);
    }
    names_are_new = true;
  }
  if (names_are_new) sync_path(folder / "frames");
}

std::int64_t SessionWriter::written_anew() const {
  return impl_->written_anew;
}

void SessionWriter::append(FrameTags seen) {
  const std::lock_guard lock(impl_->pending_mutex);
  impl_->pending_tags.push_back(std::move(seen));
}

std::int64_t SessionWriter::commit() {
  const std::lock_guard index_lock(impl_->index_mutex);
  check(impl_->index.has_value(), "nothing is committed to a finished session");
  std::vector<Impl::Pending> frames;
  std::vector<FrameGap> gaps;
  std::vector<FrameTags> tags;
  {
    const std::lock_guard lock(impl_->pending_mutex);
    frames = std::exchange(impl_->pending, {});
    gaps = std::exchange(impl_->pending_gaps, {});
    tags = std::exchange(impl_->pending_tags, {});
  }
  if (frames.empty() && gaps.empty() && tags.empty()) return impl_->committed;
  impl_->make_durable(frames);
  impl_->commit([&] {
    impl_->insert(frames);
    impl_->insert(gaps);
    impl_->insert(tags);
  });
  impl_->committed += static_cast<std::int64_t>(frames.size());
  return impl_->committed;
}

void SessionWriter::write_document(const std::string& key, const nlohmann::json& document) {
  const std::lock_guard lock(impl_->index_mutex);
  check(impl_->index.has_value(), "nothing is written to a finished session");
  impl_->commit([&] { impl_->write_document(key, document); });
}

void SessionWriter::finish() {
  commit();
  const std::lock_guard lock(impl_->index_mutex);
  SqliteDatabase& index = *impl_->index;
  // A WAL database cannot be opened in a read-only folder; a finished session is one plain file, which can.
  index.run("PRAGMA wal_checkpoint(TRUNCATE); PRAGMA journal_mode = DELETE");
  index.close();
  impl_->index.reset();
  forget_commits(impl_->folder);
  sync_path(impl_->folder);
}

}  // namespace mf
