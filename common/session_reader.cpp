// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

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

// Sessions from before recorders have no arrivals and no gaps.
bool has_table(const SqliteDatabase& index, const std::string& name) {
  SqliteStatement statement(index, "SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = ?");
  statement.bind(1, name);
  return statement.step();
}

std::int64_t number_of(const SqliteDatabase& index, const char* sql) {
  SqliteStatement statement(index, sql);
  return statement.step() ? statement.integer(0) : 0;
}

}  // namespace

struct SessionReader::Impl {
  fs::path folder;
  SessionHeader header;
  std::map<std::string, nlohmann::json> documents;
  std::vector<SessionFrame> frames;
  std::vector<FrameGap> gaps;
  std::vector<std::string> damage;

  void read_header(const SqliteDatabase&);
  void read_frames(const SqliteDatabase&);
  void read_arrivals(const SqliteDatabase&);
  void read_gaps(const SqliteDatabase&);
  void check_documents(const SqliteDatabase&) const;
  void check_rows(const SqliteDatabase&);
  void check_commits(const SqliteDatabase&, const NotedCommits&);
  [[nodiscard]] std::int64_t frames_without_row() const {
    return std::max<std::int64_t>(count_frame_files(folder) - static_cast<std::int64_t>(frames.size()), 0);
  }
};

void SessionReader::Impl::read_header(const SqliteDatabase& index) {
  if (number_of(index, "PRAGMA application_id") != session_application_id)
    throw InputError(index.file(), "", "is no index of a session: give a folder that import or the recorder made");
  if (const std::int64_t version = number_of(index, "PRAGMA user_version"); version != session_schema_version)
    throw InputError(
        index.file(), "user_version",
        fmt::format("is {}, this program reads {}: use the version that wrote it", version, session_schema_version));
  SqliteStatement verdict(index, "PRAGMA integrity_check(1)");
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
  std::size_t damaged = 0;
  for (SessionFrame& frame : frames) {
    const auto found = checks.find(frame.id);
    frame.damaged = found == checks.end() || found->second != std::int64_t{row_check(frame)};
    damaged += frame.damaged ? 1 : 0;
    if (found != checks.end()) checks.erase(found);
  }
  if (damaged + checks.size() > 0)
    damage.push_back(fmt::format("{}: {} rows of its frames are damaged and {} are lost: restore it from a copy",
                                 index.file(), damaged, checks.size()));
}

// Sessions from before commits were counted are not checked, and finished ones have nothing noted.
void SessionReader::Impl::check_commits(const SqliteDatabase& index, const NotedCommits& noted) {
  if (noted.damaged)
    damage.push_back(
        fmt::format("{}-commits: is damaged: whether the index is whole cannot be told; restore it from a "
                    "copy, or remove it",
                    index.file()));
  if (!has_table(index, "commits")) return;
  const std::int64_t lost = noted.count - number_of(index, "SELECT count FROM commits");
  if (lost > 0)
    damage.push_back(
        fmt::format("{}-wal: is damaged: its last {} commits are lost, and {} files in frames have no "
                    "row; restore it from a copy",
                    index.file(), lost, frames_without_row()));
}

SessionReader::SessionReader(fs::path folder) : impl_(std::make_unique<Impl>()) {
  impl_->folder = std::move(folder);
  const fs::path index_path = session_index_file(impl_->folder);
  std::error_code error;
  const bool found = fs::is_regular_file(index_path, error);
  if (error && error != std::errc::no_such_file_or_directory && error != std::errc::not_a_directory)
    throw InputError(index_path.string(), "",
                     fmt::format("cannot be opened ({}): check its permissions", error.message()));
  if (!found)
    throw InputError(impl_->folder.string(), "",
                     "is no session (it holds no session.db): give a folder that import or the recorder made");
  const NotedCommits noted = noted_commits(impl_->folder);  // first: a writer may go on meanwhile
  const SqliteDatabase index(index_path, SqliteDatabase::Mode::read_only);
  impl_->read_header(index);
  impl_->read_frames(index);
  impl_->read_arrivals(index);
  impl_->read_gaps(index);
  impl_->check_rows(index);
  impl_->check_commits(index, noted);
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

const std::vector<std::string>& SessionReader::damage() const {
  return impl_->damage;
}

std::int64_t SessionReader::frames_without_row() const {
  return impl_->frames_without_row();
}

std::optional<nlohmann::json> SessionReader::document(const std::string& key) const {
  const auto found = impl_->documents.find(key);
  return found == impl_->documents.end() ? std::nullopt : std::optional(found->second);
}

std::vector<FrameTags> SessionReader::tags() const {
  const SqliteDatabase index(session_index_file(impl_->folder), SqliteDatabase::Mode::read_only);
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
    throw InputError(session_index_file(impl_->folder).string(), fmt::format("frames[{}]", frame.id),
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
  const FrameShape shape = shape_of(read.pixels), expected = shape_of(header);
  if (shape.width != expected.width || shape.height != expected.height)
    throw InputError(path.string(), "",
                     fmt::format("has {} x {} pixels, the session {} x {}: restore it from a copy", shape.width,
                                 shape.height, expected.width, expected.height));
  if (shape != expected)
    throw InputError(
        path.string(), "",
        fmt::format("is no {} picture as the session says: restore it from a copy", pixel_format_name(header.format)));
  return read;
}

}  // namespace mf
