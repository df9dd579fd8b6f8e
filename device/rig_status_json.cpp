// SPDX-License-Identifier: Apache-2.0
#include "device/rig_status_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "device/base64.h"

namespace mf {

namespace {

using Json = nlohmann::json;

constexpr std::array<std::string_view, 5> state_names{"idle", "metering", "recording", "done", "error"};

Json tag_to_json(const TagDetection& tag) {
  Json corners = Json::array();
  for (const Eigen::Vector2d& corner : tag.corners_px) corners.push_back({corner.x(), corner.y()});
  return {{"id", tag.id},
          {"corners_px", corners},
          {"corrected_bits", tag.corrected_bits},
          {"decision_margin", tag.decision_margin}};
}

Json preview_to_json(const RigPreview& preview) {
  Json tags = Json::array();
  for (const TagDetection& tag : preview.tags) tags.push_back(tag_to_json(tag));
  return {{"width", preview.grey.width},
          {"height", preview.grey.height},
          {"grey", to_base64(preview.grey.data)},
          {"frame_px_per_preview", preview.frame_px_per_preview},
          {"tags", tags},
          {"posed", preview.posed}};
}

Json coverage_to_json(const CoverageStatus& coverage) {
  Json patches = Json::array();
  for (const CoveragePatch& p : coverage.patches)
    patches.push_back({p.azimuth_deg, p.elevation_deg, p.weight, p.covered});
  Json all{{"covered", coverage.covered}, {"done", coverage.done}, {"patches", patches}};
  if (coverage.advice)
    all["advice"] = {{"azimuth_deg", coverage.advice->azimuth_deg},
                     {"elevation_deg", coverage.advice->elevation_deg},
                     {"text", coverage.advice->text}};
  return all;
}

// Reads the values of one object, and names it when one does not fit.
class StatusReader {
 public:
  StatusReader(const Json& object, std::string name, const std::string& source)
      : object_(object), name_(std::move(name)), source_(source) {
    if (!object_.is_object()) throw InputError(source_, name_, "is no object");
  }

  [[nodiscard]] bool has(const char* key) const { return object_.contains(key); }
  [[nodiscard]] const Json& at(const char* key) const {
    if (!has(key)) fail(key, "is missing");
    return object_.at(key);
  }
  // null: not a number that JSON can hold.
  [[nodiscard]] double number(const char* key) const { return number_of(at(key), key); }
  [[nodiscard]] double number_of(const Json& value, const char* key) const {
    if (value.is_null()) return std::numeric_limits<double>::quiet_NaN();
    if (!value.is_number()) fail(key, "must be a number");
    return value.get<double>();
  }
  [[nodiscard]] std::int64_t count(const char* key,
                                   std::int64_t most = std::numeric_limits<std::int64_t>::max()) const {
    const Json& value = at(key);
    // A whole number beyond 64 bits is read as another type, or wraps below 0.
    if (!value.is_number_integer() || value.get<std::int64_t>() < 0 || value.get<std::int64_t>() > most)
      fail(key, fmt::format("must be a whole number from 0 to {}", most));
    return value.get<std::int64_t>();
  }
  [[nodiscard]] int small_count(const char* key) const { return static_cast<int>(count(key, 1'000'000'000)); }
  [[nodiscard]] bool truth(const char* key) const {
    if (!at(key).is_boolean()) fail(key, "must be true or false");
    return at(key).get<bool>();
  }
  [[nodiscard]] std::string text(const char* key) const {
    if (!at(key).is_string()) fail(key, "must be a text");
    return at(key).get<std::string>();
  }
  [[nodiscard]] const Json& list(const char* key, std::size_t most) const {
    if (!at(key).is_array() || at(key).size() > most) fail(key, fmt::format("must be a list of at most {}", most));
    return at(key);
  }
  [[nodiscard]] StatusReader object(const char* key) const { return {at(key), name_of(key), source_}; }
  [[nodiscard]] StatusReader element(const Json& value, const char* key) const {
    return {value, name_of(key), source_};
  }
  [[noreturn]] void fail(const char* key, const std::string& why) const {
    throw InputError(source_, name_of(key), why);
  }

 private:
  [[nodiscard]] std::string name_of(const char* key) const { return name_.empty() ? key : name_ + "." + key; }
  const Json& object_;
  std::string name_;
  std::string source_;
};

TagDetection read_tag(const StatusReader& r) {
  TagDetection tag;
  tag.id = r.small_count("id");
  tag.corrected_bits = r.small_count("corrected_bits");
  tag.decision_margin = r.number("decision_margin");
  const Json& corners = r.list("corners_px", 4);
  if (corners.size() != 4) r.fail("corners_px", "must be four corners");
  for (std::size_t i = 0; i < 4; ++i) {
    if (!corners[i].is_array() || corners[i].size() != 2) r.fail("corners_px", "must be four corners [x, y]");
    tag.corners_px[i] = {r.number_of(corners[i][0], "corners_px"), r.number_of(corners[i][1], "corners_px")};
  }
  return tag;
}

RigPreview read_preview(const StatusReader& r) {
  RigPreview preview;
  preview.grey.width = static_cast<int>(r.count("width", most_preview_px));
  preview.grey.height = static_cast<int>(r.count("height", most_preview_px));
  const std::size_t pixels =
      static_cast<std::size_t>(preview.grey.width) * static_cast<std::size_t>(preview.grey.height);
  if (!r.at("grey").is_string()) r.fail("grey", "must be a text");
  std::optional<std::vector<std::uint8_t>> bytes = from_base64(r.at("grey").get_ref<const std::string&>());
  if (!bytes || bytes->size() != pixels) r.fail("grey", "must hold width × height bytes as base64");
  preview.grey.data = std::move(*bytes);
  preview.frame_px_per_preview = r.number("frame_px_per_preview");
  if (!(preview.frame_px_per_preview > 0)) r.fail("frame_px_per_preview", "must be above 0");
  preview.posed = r.truth("posed");
  for (const Json& tag : r.list("tags", most_status_tags)) preview.tags.push_back(read_tag(r.element(tag, "tags")));
  return preview;
}

CoverageStatus read_coverage(const StatusReader& r) {
  CoverageStatus coverage;
  coverage.covered = r.number("covered");
  coverage.done = r.truth("done");
  for (const Json& p : r.list("patches", most_status_patches)) {
    if (!p.is_array() || p.size() != 4)
      r.fail("patches", "must hold lists [azimuth_deg, elevation_deg, weight, covered]");
    coverage.patches.push_back({r.number_of(p[0], "patches"), r.number_of(p[1], "patches"),
                                r.number_of(p[2], "patches"), r.number_of(p[3], "patches")});
  }
  if (!r.has("advice")) return coverage;
  const StatusReader advice = r.object("advice");
  coverage.advice = CaptureAdvice{advice.number("azimuth_deg"), advice.number("elevation_deg"), advice.text("text")};
  return coverage;
}

RigState read_state(const StatusReader& r) {
  const auto* const found = std::find(state_names.begin(), state_names.end(), r.text("state"));
  if (found == state_names.end()) r.fail("state", "must be idle, metering, recording, done or error");
  return static_cast<RigState>(found - state_names.begin());
}

}  // namespace

std::string_view rig_state_name(RigState state) {
  return state_names.at(static_cast<std::size_t>(state));
}

nlohmann::json rig_status_to_json(const RigStatus& s) {
  Json all{{"state", rig_state_name(s.state)},
           {"problem", s.problem},
           {"session", s.session},
           {"seconds", s.seconds},
           {"durable_frames", s.durable_frames},
           {"lost_frames", s.lost_frames},
           {"gaps", s.gaps},
           {"queued", s.queued},
           {"queue_frames", s.queue_frames},
           {"frame_rate_hz", s.frame_rate_hz},
           {"free_bytes", s.free_bytes},
           {"camera", s.camera},
           {"exposure_s", s.exposure_s}};
  if (s.temperature_c) all["temperature_c"] = *s.temperature_c;
  if (s.preview) all["preview"] = preview_to_json(*s.preview);
  if (s.coverage) all["coverage"] = coverage_to_json(*s.coverage);
  return all;
}

RigStatus rig_status_from_json(const nlohmann::json& object, const std::string& source) {
  const StatusReader r(object, "", source);
  RigStatus s;
  s.state = read_state(r);
  s.problem = r.text("problem");
  s.session = r.text("session");
  s.seconds = r.number("seconds");
  s.durable_frames = r.count("durable_frames");
  s.lost_frames = r.count("lost_frames");
  s.gaps = r.count("gaps");
  s.queued = r.small_count("queued");
  s.queue_frames = r.small_count("queue_frames");
  s.frame_rate_hz = r.number("frame_rate_hz");
  s.free_bytes = r.count("free_bytes");
  s.camera = r.text("camera");
  s.exposure_s = r.number("exposure_s");
  if (r.has("temperature_c")) s.temperature_c = r.number("temperature_c");
  if (r.has("preview")) s.preview = read_preview(r.object("preview"));
  if (r.has("coverage")) s.coverage = read_coverage(r.object("coverage"));
  return s;
}

RigPreview shrunk_preview(const RigPreview& preview, int most_px) {
  const int factor = (std::max(preview.grey.width, preview.grey.height) + most_px - 1) / most_px;
  if (factor <= 1) return preview;
  RigPreview small;
  small.frame_px_per_preview = preview.frame_px_per_preview * factor;
  small.tags = preview.tags;
  small.posed = preview.posed;
  small.grey = ImageU8(preview.grey.width / factor, preview.grey.height / factor, 1);
  for (int y = 0; y < small.grey.height; ++y)
    for (int x = 0; x < small.grey.width; ++x) {
      int sum = 0;
      for (int k = 0; k < factor * factor; ++k)
        sum += preview.grey.at(x * factor + k % factor, y * factor + k / factor);
      small.grey.at(x, y) = static_cast<std::uint8_t>((sum + factor * factor / 2) / (factor * factor));
    }
  return small;
}

}  // namespace mf
