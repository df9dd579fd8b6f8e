// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/path_times.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/error.h"
#include "common/json_file.h"

namespace mf {

std::vector<double> read_path_times(const std::filesystem::path& path) {
  const std::string file = path.string();
  const nlohmann::json json = read_json_file(path);
  const bool keyed = json.is_object();
  const nlohmann::json& views = keyed && json.contains("views") ? json.at("views") : json;
  std::vector<double> keys;
  for (std::size_t i = 0; views.is_array() && i < views.size(); ++i) {
    const bool timed = views[i].is_object() && views[i].contains("time");
    const bool before = i == 0 ? timed : !keys.empty();
    if (timed != before)
      throw InputError(file, fmt::format("{}[{}].time", keyed ? "views" : "", i),
                       timed ? "is given, but not in the views before it: give all views a time, or none"
                             : "is missing: give all views a time, or none");
    if (timed) keys.push_back(json_field<double>(views[i], "time", file));
  }
  if (!keyed || keys.empty()) return keys;
  const int frames = json_field<int>(json, "frames", file);
  std::vector<double> times;
  const auto last = static_cast<int>(keys.size()) - 1;
  for (int frame = 0; frame < frames; ++frame) {
    const double at = static_cast<double>(frame) * last / std::max(frames - 1, 1);
    const int i = std::min(static_cast<int>(at), std::max(last - 1, 0));
    const double from = keys[static_cast<std::size_t>(i)];
    const double to = keys[static_cast<std::size_t>(std::min(i + 1, last))];
    times.push_back(from + (at - i) * (to - from));
  }
  return times;
}

}  // namespace mf
