// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <toml++/toml.h>
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace mf {

// The whole of mirrorfieldd.toml, which all programs of the rig read, each the tables that concern it. Throws
// InputError naming the file: no TOML (with the line), a table that no program has.
[[nodiscard]] toml::table read_config_file(const std::filesystem::path&);

// One table of the file; remembers which keys were asked for, so that a misspelt one is not passed over.
// Everything throws InputError naming file, table and key. A table that is absent has no keys.
class ConfigTable {
 public:
  // `root` must outlive this. `file` only names it, and says what paths are relative to.
  ConfigTable(const toml::table& root, std::string name, std::string file);

  template <typename T>
  [[nodiscard]] std::optional<T> find(const std::string& key, const char* kind) {
    known_.insert(key);
    if (table_ == nullptr || !table_->contains(key)) return std::nullopt;
    std::optional<T> value = (*table_)[key].value<T>();
    if (!value) fail(key, fmt::format("must be {}", kind));
    return value;
  }
  [[nodiscard]] std::optional<bool> flag(const std::string& key);
  [[nodiscard]] std::optional<std::string> text(const std::string& key);
  [[nodiscard]] std::optional<std::vector<std::string>> texts(const std::string& key);
  [[nodiscard]] std::optional<double> number(const std::string& key, double low, double high);
  [[nodiscard]] std::optional<std::vector<double>> numbers(const std::string& key, double low, double high);
  [[nodiscard]] std::optional<int> integer(const std::string& key, int low, int high);
  [[nodiscard]] std::optional<std::array<int, 4>> region(const std::string& key);  // x, y, width, height, pixels
  [[nodiscard]] std::optional<std::filesystem::path> path(const std::string& key);
  [[nodiscard]] std::filesystem::path needed_path(const std::string& key);
  void refuse_unknown_keys() const;
  [[noreturn]] void fail(const std::string& key, const std::string& problem) const;

 private:
  std::string name_;
  std::string file_;
  const toml::table* table_;
  std::set<std::string> known_;
};

}  // namespace mf
