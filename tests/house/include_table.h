// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace mf::house {

// Who may include what: the rules of the house, a row a folder. What a row doesn't name is forbidden.
struct FolderRule {
  std::string_view folder;                  // a path below the repository; the longest that matches a file counts
  std::vector<std::string_view> headers;    // project headers or folders ("common/", "host/light_field/light_field.h")
  std::vector<std::string_view> libraries;  // names in known_libraries()
};
[[nodiscard]] const std::vector<FolderRule>& include_table();

// A library from outside and the beginnings of its header names.
struct Library {
  std::string_view name;
  std::vector<std::string_view> headers;
};
[[nodiscard]] const std::vector<Library>& known_libraries();

// Everything wrong with one source file's includes, a line each: "FILE:LINE: includes X: why not". `file` is relative
// to the repository. Headers of the C++ standard library and of POSIX are free for all; a header that belongs to no
// known library is a fault too, so that every new dependency passes through the table.
[[nodiscard]] std::vector<std::string> check_includes(const std::filesystem::path& file, std::string_view source);

}  // namespace mf::house
