// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "common/session.h"

namespace mf {

// What a session's writer and its reader agree on, beside the schema (session_writer.cpp).

constexpr std::int64_t session_schema_version = 1;         // PRAGMA user_version
constexpr std::int64_t session_application_id = 0x4d4652;  // "MFR", PRAGMA application_id: other programs' differ

[[nodiscard]] std::filesystem::path session_index_file(const std::filesystem::path& session_folder);

// Width, height and channels of every frame in a session, and whether they are linear.
struct FrameShape {
  int width = 0, height = 0, channels = 0;
  bool linear_float = false;
  [[nodiscard]] bool operator==(const FrameShape&) const = default;
};
[[nodiscard]] FrameShape shape_of(const FramePixels&);
[[nodiscard]] FrameShape shape_of(const SessionHeader&);

// `session.db-commits`: how many commits the session's index has been told of, while it is written. SQLite takes what
// follows damage in its log for a commit that never ended, and drops it without a word; this number, outside of the
// log, gives it away. The file is one line, "COUNT CRC32" in decimal and hexadecimal. It is not synced: a power cut may
// leave an older count, or an empty file, and neither accuses anybody.
void note_commits(const std::filesystem::path& session_folder, std::int64_t commits);  // throws WriteError
void forget_commits(const std::filesystem::path& session_folder);                      // the session is finished
struct NotedCommits {
  std::int64_t count = 0;  // 0: nothing was noted
  bool damaged = false;
};
[[nodiscard]] NotedCommits noted_commits(const std::filesystem::path& session_folder);

}  // namespace mf
