// SPDX-License-Identifier: Apache-2.0
#include "device/config.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>
#include <string>

#include "common/error.h"

namespace mf {

namespace {

namespace fs = std::filesystem;

std::string listed(const std::set<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  return list;
}

// One table of the file; remembers which keys were asked for, so that a misspelt one is not passed over.
class Table {
 public:
  Table(const toml::table& root, std::string name, std::string file)
      : name_(std::move(name)), file_(std::move(file)), table_(root[name_].as_table()) {
    if (root.contains(name_) && table_ == nullptr) throw InputError(file_, name_, "must be a table: [" + name_ + "]");
  }

  template <typename T>
  [[nodiscard]] std::optional<T> find(const std::string& key, const char* kind) {
    known_.insert(key);
    if (table_ == nullptr || !table_->contains(key)) return std::nullopt;
    std::optional<T> value = (*table_)[key].value<T>();
    if (!value) fail(key, fmt::format("must be {}", kind));
    return value;
  }
  [[nodiscard]] std::optional<std::string> text(const std::string& key) { return find<std::string>(key, "a string"); }
  [[nodiscard]] std::optional<double> number(const std::string& key, double low, double high) {
    const std::optional<double> value = find<double>(key, "a number");
    if (value && !(*value >= low && *value <= high)) fail(key, fmt::format("must lie from {} to {}", low, high));
    return value;
  }
  [[nodiscard]] std::optional<int> integer(const std::string& key, int low, int high) {
    const std::optional<std::int64_t> value = find<std::int64_t>(key, "a whole number");
    if (value && (*value < low || *value > high)) fail(key, fmt::format("must lie from {} to {}", low, high));
    return value ? std::optional(static_cast<int>(*value)) : std::nullopt;
  }
  [[nodiscard]] std::optional<std::array<int, 4>> region(const std::string& key);
  [[nodiscard]] std::optional<fs::path> path(const std::string& key) {
    const std::optional<std::string> value = text(key);
    if (!value) return std::nullopt;
    const fs::path given(*value);
    return given.is_absolute() ? given : fs::path(file_).parent_path() / given;
  }
  [[nodiscard]] fs::path needed_path(const std::string& key) {
    const std::optional<fs::path> value = path(key);
    if (!value) fail(key, "is missing");
    return *value;
  }
  void refuse_unknown_keys() const {
    if (table_ == nullptr) return;
    for (const auto& [key, value] : *table_)
      if (!known_.contains(std::string(key.str())))
        fail(std::string(key.str()), fmt::format("is no key of [{}]: it has {}", name_, listed(known_)));
  }

 private:
  [[noreturn]] void fail(const std::string& key, const std::string& problem) const {
    throw InputError(file_, name_ + "." + key, problem);
  }
  std::string name_;
  std::string file_;
  const toml::table* table_;
  std::set<std::string> known_;
};

std::optional<std::array<int, 4>> Table::region(const std::string& key) {
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

toml::table parse(const fs::path& file) {
  try {
    return toml::parse_file(file.string());
  } catch (const toml::parse_error& e) {
    std::ostringstream where;
    where << "line " << e.source().begin.line;
    throw InputError(file.string(), e.source().begin.line > 0 ? where.str() : "",
                     fmt::format("{}: mend it, or see docs/rig.md", e.description()));
  }
}

CameraSettings camera_settings(Table table) {
  CameraSettings s;
  s.address = table.text("address").value_or("");
  s.pixel_format = table.text("pixel_format");
  s.region_px = table.region("region_px");
  s.exposure_s = table.number("exposure_s", 1e-7, 60);
  s.gain_db = table.number("gain_db", -20, 80);
  s.frame_rate_hz = table.number("frame_rate_hz", 0.01, 10000);
  s.packet_bytes = table.integer("packet_bytes", 576, 16000).value_or(s.packet_bytes);
  s.socket_buffer_bytes = table.integer("socket_buffer_bytes", 65536, 1 << 30).value_or(s.socket_buffer_bytes);
  table.refuse_unknown_keys();
  return s;
}

}  // namespace

DeviceConfig read_device_config(const fs::path& file) {
  const toml::table root = parse(file);
  static const std::set<std::string> tables{"camera", "mirror", "recording"};
  for (const auto& [key, value] : root)
    if (!tables.contains(std::string(key.str())))
      throw InputError(file.string(), std::string(key.str()), "is no table of this file: it has " + listed(tables));
  DeviceConfig config;
  config.camera = camera_settings(Table(root, "camera", file.string()));
  Table mirror(root, "mirror", file.string());
  config.target = mirror.needed_path("target");
  config.world = mirror.path("world");
  config.mirror_reflectance = mirror.number("reflectance", 0.01, 1).value_or(config.mirror_reflectance);
  mirror.refuse_unknown_keys();
  Table recording(root, "recording", file.string());
  config.recordings = recording.needed_path("folder");
  config.black_level_hint = recording.number("black_level_hint", 0, 65535).value_or(config.black_level_hint);
  config.recorder.queue_frames = recording.integer("queue_frames", 2, 10000).value_or(config.recorder.queue_frames);
  recording.refuse_unknown_keys();
  return config;
}

}  // namespace mf
