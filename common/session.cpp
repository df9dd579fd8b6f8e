// SPDX-License-Identifier: Apache-2.0
#include "common/session.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <utility>

#include "common/check.h"
#include "common/durable_file.h"
#include "common/error.h"
#include "common/file_bytes.h"
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
  fs::path folder;
  SessionHeader header;
  Options options;
  std::optional<SqliteDatabase> index;
  std::optional<SqliteStatement> insert;  // after the index, so that it goes first
  std::vector<fs::path> not_durable;
  std::int64_t next_id = 0;

  void begin();
};

void SessionWriter::Impl::begin() {
  make_folder(folder / "frames");
  index.emplace(index_file(folder), SqliteDatabase::Mode::create);
  // FULL: a commit is on the disk when it returns, so a row is never lost after append() has told of it.
  index->run("PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; BEGIN");
  index->run(schema);
  SqliteStatement write_meta(*index, "INSERT INTO meta (key, json) VALUES (?, ?)");
  for (const auto& [key, document] : session_header_to_json(header)) {
    write_meta.bind(1, key).bind(2, document.dump()).step();
    write_meta.reset();
  }
  index->run("COMMIT");
  insert.emplace(*index,
                 "INSERT INTO frames (id, role, name, exposure_s, nd_density, time_s, file, bytes, crc32) "
                 "VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)");
  sync_path(folder);
  if (!options.durable_each) index->run("BEGIN");
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

EncodedFrame SessionWriter::encode(const Frame& frame) const {
  const SessionHeader& header = impl_->header;
  check(std::holds_alternative<ImageF>(frame.pixels) == header.format.linear_float, "frame has the session's type");
  check(channels_of(frame.pixels) == header.format.stored_channels(), "frame has the session's channels");
  check(width_of(frame.pixels) == header.width && height_of(frame.pixels) == header.height,
        "frame has the session's size");
  return {frame.info, encode_tiff(frame.pixels)};
}

std::int64_t SessionWriter::append(const EncodedFrame& frame) {
  check(impl_->index.has_value(), "nothing is appended to a finished session");
  check(std::isfinite(frame.info.exposure_s) && frame.info.exposure_s > 0, "a frame's exposure is positive");
  const std::int64_t id = impl_->next_id;
  const std::string file = fmt::format("frames/{:06}.tif", id);
  const fs::path path = impl_->folder / file;
  write_whole_file(path, frame.tiff, impl_->options.durable_each);
  try {
    SqliteStatement& insert = *impl_->insert;
    insert.reset();
    insert.bind(1, id).bind(2, std::string(frame_role_name(frame.info.role))).bind(3, frame.info.name);
    insert.bind(4, frame.info.exposure_s).bind(5, frame.info.nd_density).bind(6, frame.info.time_s);
    insert.bind(7, file).bind(8, static_cast<std::int64_t>(frame.tiff.size()));
    insert.bind(9, std::int64_t{crc32(frame.tiff)});
    insert.step();
    insert.reset();  // ends the implicit transaction
  } catch (...) {
    std::error_code ignored;  // a file without a row: the next frame would overwrite it anyway
    fs::remove(path, ignored);
    throw;
  }
  if (!impl_->options.durable_each) impl_->not_durable.push_back(path);
  ++impl_->next_id;
  return id;
}

void SessionWriter::finish() {
  check(impl_->index.has_value(), "a session is finished once");
  for (const fs::path& file : std::exchange(impl_->not_durable, {})) sync_path(file);
  sync_path(impl_->folder / "frames");
  impl_->insert.reset();
  SqliteDatabase& index = *impl_->index;
  if (!impl_->options.durable_each) index.run("COMMIT");
  // A WAL database cannot be opened in a read-only folder; a finished session is one plain file, which can.
  index.run("PRAGMA wal_checkpoint(TRUNCATE); PRAGMA journal_mode = DELETE");
  index.close();
  impl_->index.reset();
  sync_path(impl_->folder);
}

struct SessionReader::Impl {
  fs::path folder;
  SessionHeader header;
  std::vector<SessionFrame> frames;

  void read_header(const SqliteDatabase&);
  void read_frames(const SqliteDatabase&);
};

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
  std::map<std::string, nlohmann::json> documents;
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

std::vector<SessionFrame> SessionReader::frames(FrameRole role) const {
  std::vector<SessionFrame> chosen;
  std::copy_if(impl_->frames.begin(), impl_->frames.end(), std::back_inserter(chosen),
               [&](const SessionFrame& frame) { return frame.info.role == role; });
  return chosen;
}

Frame SessionReader::read_frame(const SessionFrame& frame) const {
  const fs::path path = impl_->folder / frame.file;
  const std::string bytes = read_file_bytes(path);
  const auto stored = static_cast<std::int64_t>(bytes.size());
  if (stored != frame.bytes)
    throw InputError(path.string(), "",
                     fmt::format("is {} ({} bytes, the index says {}): copy or record it again",
                                 stored < frame.bytes ? "truncated" : "damaged", stored, frame.bytes));
  if (crc32(bytes) != frame.crc32)
    throw InputError(path.string(), "", "is damaged or was changed (its checksum differs from the index): restore it");
  Frame read{frame.info, decode_tiff(bytes, path.string()).pixels};
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
