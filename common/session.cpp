// SPDX-License-Identifier: Apache-2.0
#include "common/session.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <mutex>
#include <nlohmann/json.hpp>
#include <utility>

#include "common/check.h"
#include "common/durable_file.h"
#include "common/error.h"
#include "common/file_bytes.h"
#include "common/session_checks.h"
#include "common/session_header.h"
#include "common/sqlite.h"
#include "common/tiff_image.h"

namespace mf {

namespace {

namespace fs = std::filesystem;

constexpr std::int64_t schema_version = 1;         // PRAGMA user_version
constexpr std::int64_t application_id = 0x4d4652;  // "MFR", PRAGMA application_id: other programs' databases differ

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

fs::path index_file(const fs::path& folder) {
  return folder / "session.db";
}

void make_folder(const fs::path& folder) {
  std::error_code error;
  if (fs::create_directory(folder, error)) return;
  if (!error) throw InputError(folder.string(), "", "exists already: choose another name or remove it");
  throw InputError(folder.string(), "",
                   fmt::format("cannot be made ({}): check the parent folder, its permissions and the free space",
                               std::strerror(error.value())));
}

int channels_of(const FramePixels& pixels) {
  return std::visit([](const auto& image) { return image.channels; }, pixels);
}
int width_of(const FramePixels& pixels) {
  return std::visit([](const auto& image) { return image.width; }, pixels);
}
int height_of(const FramePixels& pixels) {
  return std::visit([](const auto& image) { return image.height; }, pixels);
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
  std::int64_t committed = 0;
  std::atomic<std::int64_t> written_anew = 0;

  void write_under_new_names(SessionFrame&, const std::string& tiff, bool durable, const WriteError& first);
  void make_durable(std::vector<Pending>&);
  void begin();
  void write_document(const std::string& key, const nlohmann::json&);
  void insert(const std::vector<Pending>&);
  void insert(const std::vector<FrameGap>&);
  void insert(const std::vector<FrameTags>&);
};

void SessionWriter::Impl::begin() {
  make_folder(folder / "frames");
  index.emplace(index_file(folder), SqliteDatabase::Mode::create);
  // FULL: a commit is on the disk when it returns, so a row is never lost after append() has told of it.
  index->run("PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; BEGIN");
  index->run(schema);
  for (const auto& [key, document] : session_header_to_json(header)) write_document(key, document);
  index->run("COMMIT");
  sync_path(folder);
  const fs::path whole = fs::absolute(folder);
  sync_path((whole.has_filename() ? whole : whole.parent_path()).parent_path());  // the session's own name
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
  const SessionHeader& header = impl_->header;
  check(std::holds_alternative<ImageF>(frame.pixels) == header.format.linear_float, "frame has the session's type");
  check(channels_of(frame.pixels) == header.format.stored_channels(), "frame has the session's channels");
  check(width_of(frame.pixels) == header.width && height_of(frame.pixels) == header.height,
        "frame has the session's size");
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
      sync_path(folder / p.frame.file);
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
  impl_->index->run("BEGIN");  // all rows or none
  try {
    impl_->insert(frames);
    impl_->insert(gaps);
    impl_->insert(tags);
    impl_->index->run("COMMIT");
  } catch (...) {
    impl_->index->run_quietly("ROLLBACK");
    throw;
  }
  impl_->committed += static_cast<std::int64_t>(frames.size());
  return impl_->committed;
}

void SessionWriter::write_document(const std::string& key, const nlohmann::json& document) {
  const std::lock_guard lock(impl_->index_mutex);
  check(impl_->index.has_value(), "nothing is written to a finished session");
  impl_->index->run("BEGIN");
  try {
    impl_->write_document(key, document);
    impl_->index->run("COMMIT");
  } catch (...) {
    impl_->index->run_quietly("ROLLBACK");
    throw;
  }
}

void SessionWriter::finish() {
  commit();
  const std::lock_guard lock(impl_->index_mutex);
  SqliteDatabase& index = *impl_->index;
  // A WAL database cannot be opened in a read-only folder; a finished session is one plain file, which can.
  index.run("PRAGMA wal_checkpoint(TRUNCATE); PRAGMA journal_mode = DELETE");
  index.close();
  impl_->index.reset();
  sync_path(impl_->folder);
}

struct SessionReader::Impl {
  fs::path folder;
  SessionHeader header;
  std::map<std::string, nlohmann::json> documents;
  std::vector<SessionFrame> frames;
  std::vector<FrameGap> gaps;

  void read_header(const SqliteDatabase&);
  void read_frames(const SqliteDatabase&);
  void read_arrivals(const SqliteDatabase&);
  void read_gaps(const SqliteDatabase&);
  void check_documents(const SqliteDatabase&) const;
  void check_rows(const SqliteDatabase&);
};

// Sessions from before recorders have no arrivals and no gaps.
bool has_table(const SqliteDatabase& index, const std::string& name) {
  SqliteStatement statement(index, "SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = ?");
  statement.bind(1, name);
  return statement.step();
}

void SessionReader::Impl::read_header(const SqliteDatabase& index) {
  const auto pragma = [&](const char* sql) {
    SqliteStatement statement(index, sql);
    return statement.step() ? statement.integer(0) : 0;
  };
  if (pragma("PRAGMA application_id") != application_id)
    throw InputError(index.file(), "", "is no index of a session: give a folder that import or the recorder made");
  if (const std::int64_t version = pragma("PRAGMA user_version"); version != schema_version)
    throw InputError(
        index.file(), "user_version",
        fmt::format("is {}, this program reads {}: use the version that wrote it", version, schema_version));
  SqliteStatement verdict(index, "PRAGMA quick_check(1)");
  if (!verdict.step() || verdict.text(0) != "ok")
    throw InputError(index.file(), "", fmt::format("is damaged ({}): restore it from a copy", verdict.text(0)));
  check_documents(index);
  SqliteStatement rows(index, "SELECT key, json FROM meta");
  while (rows.step()) {
    try {
      documents[rows.text(0)] = nlohmann::json::parse(rows.text(1));
    } catch (const nlohmann::json::exception& e) {
      throw InputError(index.file(), rows.text(0), fmt::format("is no JSON ({}): restore it from a copy", e.what()));
    }
  }
  header = session_header_from_json(documents, index.file());
}

void SessionReader::Impl::read_frames(const SqliteDatabase& index) {
  SqliteStatement rows(index,
                       "SELECT id, role, name, exposure_s, nd_density, time_s, file, bytes, crc32 FROM frames "
                       "ORDER BY id");
  while (rows.step()) {
    SessionFrame frame;
    frame.id = rows.integer(0);
    const std::optional<FrameRole> role = parse_frame_role(rows.text(1));
    if (!role) throw InputError(index.file(), fmt::format("frames[{}].role", frame.id), "is unknown: it is damaged");
    frame.info = {rows.text(2), *role, rows.real(3), rows.real(4), rows.real(5)};
    frame.file = rows.text(6);
    frame.bytes = rows.integer(7);
    frame.crc32 = static_cast<std::uint32_t>(rows.integer(8));
    frames.push_back(std::move(frame));
  }
}

void SessionReader::Impl::read_arrivals(const SqliteDatabase& index) {
  if (!has_table(index, "arrivals")) return;
  std::map<std::int64_t, FrameArrival> arrivals;
  SqliteStatement rows(index, "SELECT frame, device_frame, device_ns, monotonic_ns, realtime_ns FROM arrivals");
  while (rows.step()) arrivals[rows.integer(0)] = {rows.integer(1), rows.integer(2), rows.integer(3), rows.integer(4)};
  for (SessionFrame& frame : frames)
    if (const auto found = arrivals.find(frame.id); found != arrivals.end()) frame.arrival = found->second;
}

void SessionReader::Impl::read_gaps(const SqliteDatabase& index) {
  if (!has_table(index, "gaps")) return;
  SqliteStatement rows(index, "SELECT next_id, missing, monotonic_ns, reason FROM gaps ORDER BY next_id, rowid");
  while (rows.step()) gaps.push_back({rows.integer(0), rows.integer(1), rows.integer(2), rows.text(3)});
}

// Sessions from before there were checks are not checked.
void SessionReader::Impl::check_documents(const SqliteDatabase& index) const {
  if (!has_table(index, "document_checks")) return;
  SqliteStatement rows(index, "SELECT meta.key, json, crc32 FROM meta LEFT JOIN document_checks USING (key)");
  while (rows.step())
    if (std::int64_t{crc32(rows.text(1))} != rows.integer(2))
      throw InputError(index.file(), rows.text(0), "is damaged (its checksum differs): restore it from a copy");
}

void SessionReader::Impl::check_rows(const SqliteDatabase& index) {
  if (!has_table(index, "checks")) return;
  std::map<std::int64_t, std::int64_t> checks;
  SqliteStatement rows(index, "SELECT frame, crc32 FROM checks");
  while (rows.step()) checks[rows.integer(0)] = rows.integer(1);
  for (SessionFrame& frame : frames) {
    const auto found = checks.find(frame.id);
    frame.damaged = found == checks.end() || found->second != std::int64_t{row_check(frame)};
  }
}

SessionReader::SessionReader(fs::path folder) : impl_(std::make_unique<Impl>()) {
  impl_->folder = std::move(folder);
  const fs::path index_path = index_file(impl_->folder);
  std::error_code error;
  const bool found = fs::is_regular_file(index_path, error);
  if (error && error != std::errc::no_such_file_or_directory && error != std::errc::not_a_directory)
    throw InputError(index_path.string(), "",
                     fmt::format("cannot be opened ({}): check its permissions", error.message()));
  if (!found)
    throw InputError(impl_->folder.string(), "",
                     "is no session (it holds no session.db): give a folder that import or the recorder made");
  const SqliteDatabase index(index_path, SqliteDatabase::Mode::read_only);
  impl_->read_header(index);
  impl_->read_frames(index);
  impl_->read_arrivals(index);
  impl_->read_gaps(index);
  impl_->check_rows(index);
}

SessionReader::SessionReader(SessionReader&&) noexcept = default;
SessionReader::~SessionReader() = default;

const fs::path& SessionReader::folder() const {
  return impl_->folder;
}
const SessionHeader& SessionReader::header() const {
  return impl_->header;
}
const std::vector<SessionFrame>& SessionReader::frames() const {
  return impl_->frames;
}

const std::vector<FrameGap>& SessionReader::gaps() const {
  return impl_->gaps;
}

std::int64_t SessionReader::frames_without_row() const {
  return std::max<std::int64_t>(count_frame_files(impl_->folder) - static_cast<std::int64_t>(impl_->frames.size()), 0);
}

std::optional<nlohmann::json> SessionReader::document(const std::string& key) const {
  const auto found = impl_->documents.find(key);
  return found == impl_->documents.end() ? std::nullopt : std::optional(found->second);
}

std::vector<FrameTags> SessionReader::tags() const {
  const SqliteDatabase index(index_file(impl_->folder), SqliteDatabase::Mode::read_only);
  std::map<std::int64_t, FrameTags> seen;
  if (!has_table(index, "detections")) return {};
  SqliteStatement tag_rows(index, "SELECT * FROM detections ORDER BY frame, tag");
  while (tag_rows.step()) {
    TagDetection tag;
    tag.id = static_cast<int>(tag_rows.integer(1));
    for (int corner = 0; corner < 4; ++corner)
      tag.corners_px[static_cast<std::size_t>(corner)] = {tag_rows.real(2 + 2 * corner), tag_rows.real(3 + 2 * corner)};
    seen[tag_rows.integer(0)].tags.push_back(tag);
  }
  SqliteStatement pose_rows(index, "SELECT * FROM online_poses");
  while (pose_rows.step())
    seen[pose_rows.integer(0)].cam_from_mirror =
        Rigid3{Eigen::Quaterniond(pose_rows.real(1), pose_rows.real(2), pose_rows.real(3), pose_rows.real(4)),
               {pose_rows.real(5), pose_rows.real(6), pose_rows.real(7)}};
  std::vector<FrameTags> list;
  for (auto& [frame, tags] : seen) {
    tags.frame = frame;
    list.push_back(std::move(tags));
  }
  return list;
}

std::vector<SessionFrame> SessionReader::frames(FrameRole role) const {
  std::vector<SessionFrame> chosen;
  std::copy_if(impl_->frames.begin(), impl_->frames.end(), std::back_inserter(chosen),
               [&](const SessionFrame& frame) { return frame.info.role == role; });
  return chosen;
}

Frame SessionReader::read_frame(const SessionFrame& frame, const RowRange& rows) const {
  const fs::path path = impl_->folder / frame.file;
  if (frame.damaged)
    throw InputError(index_file(impl_->folder).string(), fmt::format("frames[{}]", frame.id),
                     "is damaged (its checksum differs): restore the index from a copy");
  const std::string bytes = read_file_bytes(path);
  const auto stored = static_cast<std::int64_t>(bytes.size());
  if (stored != frame.bytes)
    throw InputError(path.string(), "",
                     fmt::format("is {} ({} bytes, the index says {}): copy or record it again",
                                 stored < frame.bytes ? "truncated" : "damaged", stored, frame.bytes));
  if (crc32(bytes) != frame.crc32)
    throw InputError(path.string(), "", "is damaged or was changed (its checksum differs from the index): restore it");
  Frame read{frame.info, decode_tiff(bytes, path.string(), rows).pixels};
  const SessionHeader& header = impl_->header;
  if (width_of(read.pixels) != header.width || height_of(read.pixels) != header.height)
    throw InputError(path.string(), "",
                     fmt::format("has {} x {} pixels, the session {} x {}: restore it from a copy",
                                 width_of(read.pixels), height_of(read.pixels), header.width, header.height));
  if (channels_of(read.pixels) != header.format.stored_channels() ||
      std::holds_alternative<ImageF>(read.pixels) != header.format.linear_float)
    throw InputError(
        path.string(), "",
        fmt::format("is no {} picture as the session says: restore it from a copy", pixel_format_name(header.format)));
  return read;
}

}  // namespace mf
