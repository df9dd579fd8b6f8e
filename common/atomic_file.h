// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string_view>

namespace mf {

// A file that appears whole or not at all: written aside, in the same folder, as "NAME.partial", made durable and
// renamed by commit(). Without a commit the destructor removes what was written.
class AtomicFile {
 public:
  explicit AtomicFile(std::filesystem::path destination);
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  ~AtomicFile();

  // Where to write. Whoever writes here closes the file before commit().
  [[nodiscard]] const std::filesystem::path& path() const { return partial_; }

  // fsync and rename. Throws InputError naming the destination (disk full, no permission, ...).
  void commit();

 private:
  std::filesystem::path destination_;
  std::filesystem::path partial_;
  bool committed_ = false;
};

// Throws InputError naming the destination when it cannot be written (disk full, missing folder, no permission).
void write_file_atomically(const std::filesystem::path& destination, std::string_view content);

// With all above it. Throws InputError naming it.
void make_folder(const std::filesystem::path&);

}  // namespace mf
