// SPDX-License-Identifier: Apache-2.0
#include "host/import/new_folder.h"

#include <fcntl.h>
#include <fmt/format.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "common/durable_file.h"
#include "common/error.h"

namespace mf {

namespace {

namespace fs = std::filesystem;

bool is_session(const fs::path& folder) {
  return fs::is_regular_file(folder / "session.db");
}

// "S/" and "S/." mean S; without this their siblings would lie inside.
fs::path without_trailing_slash(const fs::path& path) {
  fs::path normal = fs::absolute(path).lexically_normal();
  return normal.has_filename() ? normal : normal.parent_path();
}

}  // namespace

NewSessionFolder::NewSessionFolder(const fs::path& destination, bool overwrite)
    : destination_(without_trailing_slash(destination)), partial_(destination_), replaces_(false) {
  partial_ += ".partial";
  if (!fs::is_directory(destination_.parent_path()))
    throw InputError(destination_.parent_path().string(), "", "is no folder: make it first");
  if (fs::exists(fs::symlink_status(destination_))) {
    if (!is_session(destination_))
      throw InputError(destination.string(), "", "exists and is no session: choose another name");
    if (!overwrite)
      throw InputError(destination.string(), "", "exists already: choose another name, or replace it with --overwrite");
    replaces_ = true;
  }
  if (!fs::exists(fs::symlink_status(partial_))) return;
  // Left by a run that was killed. Anything else of that name is not ours to remove.
  if (!is_session(partial_) && !(fs::is_directory(partial_) && fs::is_empty(partial_)))
    throw InputError(partial_.string(), "", "is in the way and no session: move it");
  fs::remove_all(partial_);
}

NewSessionFolder::~NewSessionFolder() {
  std::error_code ignored;  // nothing more can be done about a leftover in a destructor
  fs::remove_all(partial_, ignored);
}

void NewSessionFolder::commit() {
  // The exchange leaves either the old session or the new one under the name, whatever happens in between.
  const unsigned int flags = replaces_ ? RENAME_EXCHANGE : RENAME_NOREPLACE;
  if (::renameat2(AT_FDCWD, partial_.c_str(), AT_FDCWD, destination_.c_str(), flags) != 0) {
    const int error = errno;
    // Not every file system knows the flags.
    if (error == EINVAL && replaces_) fs::remove_all(destination_);
    if (error != EINVAL || std::rename(partial_.c_str(), destination_.c_str()) != 0)
      throw InputError(
          destination_.string(), "",
          fmt::format("cannot be put in place ({}): check the folder and its permissions", std::strerror(error)));
  }
  sync_path(destination_.parent_path());
}

}  // namespace mf
