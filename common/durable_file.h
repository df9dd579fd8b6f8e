// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string_view>

namespace mf {

// Each throws WriteError naming the file (disk full, no permission, ...).

// Writes the file aside as "NAME.partial" and renames it, so that NAME never holds half of it. With `durable` the data
// and the name survive a power cut once this returns.
void write_whole_file(const std::filesystem::path& file, std::string_view bytes, bool durable);

// Whether the system keeps a file's bytes in memory once they are on the disk: drop what nobody reads soon.
enum class AfterSync { keep, drop };

// Makes what was written to a file, or the names in a folder, survive a power cut.
void sync_path(const std::filesystem::path& file_or_folder, AfterSync = AfterSync::keep);

}  // namespace mf
