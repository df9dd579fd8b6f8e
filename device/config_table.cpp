// SPDX-License-Identifier: Apache-2.0
#include "device/config_table.h"

#include <sstream>

#include "common/error.h"

namespace mf {

namespace {

// In one place, so that no program takes another's table for a misspelt one.
const std::set<std::string>& config_tables() {
  static const std::set<std::string> names{"button",   "camera", "detection", "hid_button", "lamp",  "mirror",
                                           "metering", "plane",  "recording", "response",   "status"};
  return names;
}

std::string listed(const std::set<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  return list;
}

toml::table parse_config(const std::filesystem::path& file) {
  try {
    return toml::parse_file(file.string());
  } catch (const toml::parse_error& e) {
    std::ostringstream where;
    where << "line " << e.source().begin.line;
    throw InputError(file.string(), e.source().begin.line > 0 ? where.str() : "",
                     fmt::format("{}: mend it, or see docs/rig.md", e.description()));
  }
}

}  // namespace

toml::table read_config_file(const std::filesystem::path& file) {
  toml::table root = parse_config(file);
  for (const auto& [key, value] : root)
    if (!config_tables().contains(std::string(key.str())))
      throw InputError(file.string(), std::string(key.str()),
                       "is no table of this file: it has " + listed(config_tables()));
  return root;
}

ConfigTable::ConfigTable(const toml::table& root, std::string name, std::string file)
    : name_(std::move(name)), file_(std::move(file)), table_(root[name_].as_table()) {
  if (root.contains(name_) && table_ == nullptr) throw InputError(file_, name_, "must be a table: [" + name_ + "]");
}

std::optional<bool> ConfigTable::flag(const std::string& key) {
  return find<bool>(key, "true or false");
}

std::optional<std::string> ConfigTable::text(const std::string& key) {
  return find<std::string>(key, "a string");
}

std::optional<std::vector<std::string>> ConfigTable::texts(const std::string& key) {
  known_.insert(key);
  if (table_ == nullptr || !table_->contains(key)) return std::nullopt;
  const toml::array* list = (*table_)[key].as_array();
  if (list == nullptr) fail(key, "must be a list of strings");
  std::vector<std::string> values;
  for (const toml::node& node : *list) {
    const std::optional<std::string> value = node.value<std::string>();
    if (!value) fail(key, "must be a list of strings");
    values.push_back(*value);
  }
  return values;
}

std::optional<double> ConfigTable::number(const std::string& key, double low, double high) {
  const std::optional<double> value = find<double>(key, "a number");
  if (value && !(*value >= low && *value <= high)) fail(key, fmt::format("must lie from {} to {}", low, high));
  return value;
}

std::optional<std::vector<double>> ConfigTable::numbers(const std::string& key, double low, double high) {
  known_.insert(key);
  if (table_ == nullptr || !table_->contains(key)) return std::nullopt;
  const toml::array* list = (*table_)[key].as_array();
  if (list == nullptr) fail(key, "must be a list of numbers");
  std::vector<double> values;
  for (const toml::node& node : *list) {
    const std::optional<double> value = node.value<double>();
    if (!value || !(*value >= low && *value <= high))
      fail(key, fmt::format("must be a list of numbers from {} to {}", low, high));
    values.push_back(*value);
  }
  return values;
}

std::optional<int> ConfigTable::integer(const std::string& key, int low, int high) {
  const std::optional<std::int64_t> value = find<std::int64_t>(key, "a whole number");
  if (value && (*value < low || *value > high)) fail(key, fmt::format("must lie from {} to {}", low, high));
  return value ? std::optional(static_cast<int>(*value)) : std::nullopt;
}

std::optional<std::array<int, 4>> ConfigTable::region(const std::string& key) {
  known_.insert(key);
  if (table_ == nullptr || !table_->contains(key)) return std::nullopt;
  const toml::array* list = (*table_)[key].as_array();
  std::array<int, 4> region{};
  if (list == nullptr || list->size() != region.size()) fail(key, "must be [x, y, width, height]");
  for (std::size_t i = 0; i < region.size(); ++i) {
    const std::optional<std::int64_t> value = (*list)[i].value<std::int64_t>();
    if (!value || *value < 0 || *value > 65536) fail(key, "must hold whole numbers of pixels");
    region[i] = static_cast<int>(*value);
  }
  return region;
}

std::optional<std::filesystem::path> ConfigTable::path(const std::string& key) {
  const std::optional<std::string> value = text(key);
  if (!value) return std::nullopt;
  const std::filesystem::path given(*value);
  return given.is_absolute() ? given : std::filesystem::path(file_).parent_path() / given;
}

std::filesystem::path ConfigTable::needed_path(const std::string& key) {
  const std::optional<std::filesystem::path> value = path(key);
  if (!value) fail(key, "is missing");
  return *value;
}

void ConfigTable::refuse_unknown_keys() const {
  if (table_ == nullptr) return;
  for (const auto& [key, value] : *table_)
    if (!known_.contains(std::string(key.str())))
      fail(std::string(key.str()), fmt::format("is no key of [{}]: it has {}", name_, listed(known_)));
}

void ConfigTable::fail(const std::string& key, const std::string& problem) const {
  throw InputError(file_, name_ + "." + key, problem);
}

}  // namespace mf
