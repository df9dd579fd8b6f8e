// SPDX-License-Identifier: Apache-2.0
#include "common/session_index.h"

#include <fmt/format.h>

#include <charconv>
#include <string>

#include "common/durable_file.h"
#include "common/error.h"
#include "common/file_bytes.h"

namespace mf {

namespace {

namespace fs = std::filesystem;

fs::path commits_file(const fs::path& folder) {
  return folder / "session.db-commits";
}

std::string commits_line(std::int64_t commits) {
  return fmt::format("{} {:08x}\n", commits, crc32(fmt::to_string(commits)));
}

}  // namespace

fs::path session_index_file(const fs::path& session_folder) {
  return session_folder / "session.db";
}

FrameShape shape_of(const FramePixels& pixels) {
  const bool linear = std::holds_alternative<ImageF>(pixels);
  return std::visit([&](const auto& i) { return FrameShape{i.width, i.height, i.channels, linear}; }, pixels);
}

FrameShape shape_of(const SessionHeader& header) {
  return {header.width, header.height, header.format.stored_channels(), header.format.linear_float};
}

void note_commits(const fs::path& session_folder, std::int64_t commits) {
  write_whole_file(commits_file(session_folder), commits_line(commits), false);
}

void forget_commits(const fs::path& session_folder) {
  std::error_code none_is_right_too;
  fs::remove(commits_file(session_folder), none_is_right_too);
}

NotedCommits noted_commits(const fs::path& session_folder) {
  std::string line;
  std::error_code error;
  if (!fs::exists(commits_file(session_folder), error)) return {};
  try {
    line = read_file_bytes(commits_file(session_folder));
  } catch (const InputError&) {
    return {0, fs::exists(commits_file(session_folder), error)};  // not when the writer finished meanwhile
  }
  if (line.empty()) return {};
  NotedCommits noted;
  std::from_chars(line.data(), line.data() + line.size(), noted.count);
  return line == commits_line(noted.count) ? noted : NotedCommits{0, true};
}

}  // namespace mf
