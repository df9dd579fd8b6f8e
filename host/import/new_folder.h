// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace mf {

// A session's folder that appears whole or not at all: made as the sibling "NAME.partial", renamed by commit(); without
// a commit the destructor removes it. A "NAME.partial" that a killed run left is replaced.
class NewSessionFolder {
 public:
  // Throws InputError naming the folder when it exists and is no session, or is one and `overwrite` is false, or when
  // its parent does not exist.
  NewSessionFolder(const std::filesystem::path& destination, bool overwrite);
  NewSessionFolder(const NewSessionFolder&) = delete;
  NewSessionFolder& operator=(const NewSessionFolder&) = delete;
  ~NewSessionFolder();

  // Where to write; does not exist yet.
  [[nodiscard]] const std::filesystem::path& path() const { return partial_; }

  // Puts the folder in place, durably. Nothing in it may be open. Throws InputError naming the destination.
  void commit();

 private:
  std::filesystem::path destination_;
  std::filesystem::path partial_;
  bool replaces_ = false;
};

}  // namespace mf
