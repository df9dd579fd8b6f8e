// SPDX-License-Identifier: Apache-2.0
#include "device/response_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "device/feature_rows.h"

namespace mf {

namespace {

// How the features of one knee give its time.
enum class KneeTime { share_elapsed, seconds_left };

struct ResponseRow {
  ResponseKind kind = ResponseKind::linear;
  std::string_view scheme{};
  SwitchRow mode{};
  FeatureNames needs{};  // beside the mode, where the mode alone says nothing
  int most_knees = 0;
  FeatureRow count{}, selector{};  // multi-slope with a selector
  KneeTime knee_time = KneeTime::share_elapsed;
  std::vector<FeatureRow> times{}, levels{};  // multi-slope: one that is selected, or one a knee
  FeatureRow gradient{}, intensity{};         // what may stand for a level
  std::array<FeatureRow, 4> linlog{};         // value 1, value 2, time 1, time 2
};

const std::vector<ResponseRow>& response_rows() {
  constexpr double percent = 100, microseconds = 1e6;
  static const std::vector<ResponseRow> rows{
      {.kind = ResponseKind::multi_slope,
       .scheme = "SFNC MultiSlope",
       .mode = {{"MultiSlopeMode"}, {"Manual"}, {"Off"}},
       .most_knees = 3,
       .count = {{"MultiSlopeKneePointCount"}},
       .selector = {{"MultiSlopeKneePointSelector"}},
       .times = {{{"MultiSlopeExposureLimit"}, percent}},
       .levels = {{{"MultiSlopeSaturationThreshold"}, percent}},
       .gradient = {{"MultiSlopeExposureGradient"}},
       .intensity = {{"MultiSlopeIntensityLimit"}, percent}},
      {.kind = ResponseKind::lin_log,
       .scheme = "Photonfocus LinLog",
       .mode = {{"LinLog_Mode", "LinLogMode"}, {"UserDefined"}, {"Off"}},
       .linlog = {{{{"LinLog_Value1", "LinLogValue1"}, 200},
                   {{"LinLog_Value2", "LinLogValue2"}, 200},
                   {{"LinLog_Time1", "LinLogTime1"}, 1000},
                   {{"LinLog_Time2", "LinLogTime2"}, 1000}}}},
      // The second threshold is described as both the later and the lower one, which no drained pixel is: it is set
      // like the first, which the description says switches it off.
      {.kind = ResponseKind::multi_slope,
       .scheme = "Allied Vision piecewise linear",
       .mode = {{"ExposureMode"}, {"PieceWiseLinearHDR"}, {"Timed"}},
       .needs = {"CmvExposureTimePWL1", "ExposureTimePWL1"},
       .most_knees = 1,
       .knee_time = KneeTime::seconds_left,
       .times = {{{"CmvExposureTimePWL1", "ExposureTimePWL1"}, microseconds},
                 {{"CmvExposureTimePWL2", "ExposureTimePWL2"}, microseconds}},
       .levels = {{{"CmvPWLThreshold1", "ThresholdPWL1"}, 63}, {{"CmvPWLThreshold2", "ThresholdPWL2"}, 63}}},
      {.kind = ResponseKind::wide_dynamic_range,
       .scheme = "V4L2 wide_dynamic_range",
       .mode = {{"wide_dynamic_range"}, {}, {}}},
      // The kernel leaves this menu's entries to the drivers.
      {.kind = ResponseKind::wide_dynamic_range,
       .scheme = "V4L2 hdr_sensor_mode",
       .mode = {{"hdr_sensor_mode"}, {"HDR Enabled", "Enabled", "HDR", "On"}, {"No HDR", "Disabled", "Off"}}},
  };
  return rows;
}

bool offers(const FeatureAccess& access, const ResponseRow& row) {
  return find_feature(access, row.mode.names) && (row.needs.empty() || find_feature(access, row.needs));
}

std::string index_of(std::size_t knee) {
  return fmt::format("[{}]", knee + 1);
}

// --- multi-slope

class MultiSlopeRow {
 public:
  MultiSlopeRow(FeatureNotes& notes, const ResponseRow& row, double exposure_s)
      : notes_(notes), row_(row), exposure_s_(exposure_s) {}

  void write(const MultiSlopeSensor& wanted);
  [[nodiscard]] std::variant<LinearSensor, MultiSlopeSensor, LinLogSensor, UnknownResponse> read();

 private:
  [[nodiscard]] bool selected() const { return !row_.selector.names.empty(); }
  [[nodiscard]] const FeatureRow& of(const std::vector<FeatureRow>& rows, std::size_t knee) const {
    return selected() ? rows.front() : rows[std::min(knee, rows.size() - 1)];
  }
  [[nodiscard]] std::string label(std::size_t knee) const { return selected() ? index_of(knee) : std::string(); }
  bool select(std::size_t knee) { return !selected() || notes_.write(row_.selector, static_cast<double>(knee + 1)); }
  [[nodiscard]] double to_camera(double time) const {
    return row_.knee_time == KneeTime::seconds_left ? exposure_s_ * (1 - time) : time;
  }
  [[nodiscard]] double from_camera(double time) const {
    return row_.knee_time == KneeTime::seconds_left ? 1 - time / exposure_s_ : time;
  }
  [[nodiscard]] std::size_t knees_now();

  FeatureNotes& notes_;
  const ResponseRow& row_;
  double exposure_s_;
};

void MultiSlopeRow::write(const MultiSlopeSensor& wanted) {
  if (!row_.count.names.empty()) notes_.write(row_.count, static_cast<double>(wanted.knees.size()));
  for (std::size_t knee = 0; knee < wanted.knees.size(); ++knee) {
    if (!select(knee)) continue;
    notes_.write(of(row_.times, knee), to_camera(wanted.knees[knee].time), label(knee));
    notes_.write(of(row_.levels, knee), wanted.knees[knee].level, label(knee));
  }
  if (selected()) return;
  const SlopeKnee& last = wanted.knees.back();
  for (std::size_t knee = wanted.knees.size(); knee < row_.levels.size(); ++knee) {
    notes_.write(row_.times[knee], to_camera(last.time));
    notes_.write(row_.levels[knee], last.level);
  }
}

std::size_t MultiSlopeRow::knees_now() {
  if (row_.count.names.empty()) return static_cast<std::size_t>(row_.most_knees);
  const std::optional<double> count = notes_.read(row_.count);
  // Written so that no number at all counts as none.
  if (!count || !(*count >= 1)) return 0;
  if (*count > row_.most_knees) notes_.remark(fmt::format("only the first {} knees are used", row_.most_knees));
  return static_cast<std::size_t>(std::min<double>(*count, row_.most_knees));
}

// SFNC 2.7 §5.8.7: gradient n is the slope of level over time from knee n to the next, the last one ending at (1, 1).
void levels_from_gradients(std::vector<SlopeKnee>& knees, const std::vector<double>& gradients) {
  SlopeKnee next{1, 1};
  for (std::size_t i = knees.size(); i-- > 0;) {
    knees[i].level = next.level - gradients[i] * (next.time - knees[i].time);
    next = knees[i];
  }
}

// §5.8.6: intensity limit n is the light at which knee n begins to count, relative to the light that fills the pixel;
// between two knees the level rises by that light times the time between them.
void levels_from_intensities(std::vector<SlopeKnee>& knees, const std::vector<double>& limits) {
  double time = 0, sum = 0;
  for (std::size_t i = 0; i < knees.size(); ++i) {
    sum += limits[i] * (knees[i].time - time);
    knees[i].level = sum;
    time = knees[i].time;
  }
  sum += 1 - time;
  for (SlopeKnee& knee : knees) knee.level /= sum;
}

std::variant<LinearSensor, MultiSlopeSensor, LinLogSensor, UnknownResponse> MultiSlopeRow::read() {
  MultiSlopeSensor sensor;
  std::vector<double> gradients, limits;
  const std::size_t count = knees_now();
  std::size_t levels = 0;
  for (std::size_t knee = 0; knee < count; ++knee) {
    if (!select(knee)) return UnknownResponse{"its knees cannot be selected"};
    const std::optional<double> time = notes_.read(of(row_.times, knee), label(knee));
    if (!time) return UnknownResponse{fmt::format("the time of knee {} cannot be read", knee + 1)};
    const std::optional<double> level = notes_.read(of(row_.levels, knee), label(knee));
    levels += level ? 1U : 0U;
    sensor.knees.push_back({from_camera(*time), level.value_or(0)});
    if (const auto gradient = notes_.read(row_.gradient, label(knee))) gradients.push_back(*gradient);
    if (const auto limit = notes_.read(row_.intensity, label(knee))) limits.push_back(*limit);
  }
  if (sensor.knees.empty()) return UnknownResponse{"it is on and tells of no knee"};
  if (levels < count && gradients.size() == count)
    levels_from_gradients(sensor.knees, gradients);
  else if (levels < count && limits.size() == count)
    levels_from_intensities(sensor.knees, limits);
  else if (levels < count)
    return UnknownResponse{"its knees' levels cannot be read"};
  if (const std::string fault = fault_of(sensor); !fault.empty()) return UnknownResponse{"as read back, " + fault};
  return sensor;
}

// --- LinLog

void write_linlog(FeatureNotes& notes, const ResponseRow& row, const LinLogSensor& wanted) {
  const std::array values{wanted.value_1, wanted.value_2, wanted.time_1, wanted.time_2};
  for (std::size_t i = 0; i < values.size(); ++i) notes.write(row.linlog[i], values[i]);
}

std::variant<LinearSensor, MultiSlopeSensor, LinLogSensor, UnknownResponse> read_linlog(FeatureNotes& notes,
                                                                                        const ResponseRow& row) {
  std::array<double, 4> values{};
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::optional<double> value = notes.read(row.linlog[i]);
    if (!value) return UnknownResponse{fmt::format("{} cannot be read", row.linlog[i].names.front())};
    values[i] = *value;
  }
  const LinLogSensor sensor{values[0], values[1], values[2], values[3]};
  if (const std::string fault = fault_of(sensor); !fault.empty()) return UnknownResponse{"as read back, " + fault};
  return sensor;
}

// --- the whole table

ResponseKind kind_of(const ResponseRequest& request) {
  constexpr std::array kinds{ResponseKind::linear, ResponseKind::multi_slope, ResponseKind::lin_log,
                             ResponseKind::wide_dynamic_range};
  return kinds.at(request.index());
}

std::string_view name_of(ResponseKind kind) {
  constexpr std::array<std::string_view, 4> names{"multi_slope", "lin_log", "wide_dynamic_range", "linear"};
  return names.at(static_cast<std::size_t>(kind));
}

std::string fault_of_request(const ResponseRequest& request) {
  if (const auto* slopes = std::get_if<MultiSlopeSensor>(&request)) return fault_of(*slopes);
  if (const auto* linlog = std::get_if<LinLogSensor>(&request)) return fault_of(*linlog);
  return {};
}

const ResponseRow* row_for(const FeatureAccess& access, ResponseKind kind) {
  for (const ResponseRow& row : response_rows())
    if (row.kind == kind && offers(access, row)) return &row;
  return nullptr;
}

// The row that shall be used; nothing for a linear sensor.
const ResponseRow* row_for(const FeatureAccess& access, const ResponseRequest& request) {
  const ResponseKind kind = kind_of(request);
  if (const std::string fault = fault_of_request(request); !fault.empty())
    throw InputError("camera", "response", fault);
  if (kind == ResponseKind::linear) return nullptr;
  const ResponseRow* row = row_for(access, kind);
  const ResponseCapability capability = probe_response(access);
  if (row == nullptr)
    throw InputError("camera", "response",
                     fmt::format("this camera has no {}: it offers {}", name_of(kind),
                                 capability.kind == ResponseKind::linear ? std::string("only a linear response")
                                                                         : std::string(name_of(capability.kind))));
  const auto* slopes = std::get_if<MultiSlopeSensor>(&request);
  if (slopes != nullptr && slopes->knees.size() > static_cast<std::size_t>(row->most_knees))
    throw InputError("camera", "response", fmt::format("{} takes {} knees at most", row->scheme, row->most_knees));
  return row;
}

void write_request(FeatureAccess& access, FeatureNotes& notes, const ResponseRequest& request, double exposure_s) {
  const ResponseRow* wanted = row_for(access, request);
  for (const ResponseRow& row : response_rows())
    if (&row != wanted && offers(access, row)) notes.turn(row.mode, false);
  if (wanted == nullptr || !notes.turn(wanted->mode, true)) return;
  const auto write = [&](FeatureNotes& noted) {
    if (const auto* slopes = std::get_if<MultiSlopeSensor>(&request))
      MultiSlopeRow(noted, *wanted, exposure_s).write(*slopes);
    if (const auto* linlog = std::get_if<LinLogSensor>(&request)) write_linlog(noted, *wanted, *linlog);
  };
  // A value may be refused for where its neighbour still is: only what is refused twice is worth a remark.
  FeatureNotes first(access);
  write(first);
  if (!first.remarks.empty()) write(notes);
}

void read_row(FeatureNotes& notes, const ResponseRow& row, double exposure_s, ResponseSetting& setting) {
  std::string entry;
  const SwitchState state = notes.read_switch(row.mode, entry);
  if (state == SwitchState::off) return;
  setting.scheme = row.scheme;
  if (state == SwitchState::other)
    setting.in_force = UnknownResponse{fmt::format("{} is {}, whose curve is not told", row.mode.names.front(), entry)};
  else if (row.kind == ResponseKind::multi_slope)
    setting.in_force = MultiSlopeRow(notes, row, exposure_s).read();
  else if (row.kind == ResponseKind::lin_log)
    setting.in_force = read_linlog(notes, row);
  else
    setting.in_force = UnknownResponse{"the camera merges exposures by itself and tells no curve"};
}

// The exposure mode has entries beside "on" and "off" that are linear (trigger width): only "on" counts there.
bool is_on(FeatureAccess& access, const ResponseRow& row) {
  FeatureNotes unnoted(access);
  std::string entry;
  const SwitchState state = unnoted.read_switch(row.mode, entry);
  return row.needs.empty() ? state != SwitchState::off : state == SwitchState::on;
}

}  // namespace

ResponseCapability probe_response(const FeatureAccess& access) {
  for (const ResponseRow& row : response_rows()) {
    if (!offers(access, row)) continue;
    ResponseCapability found{row.kind, std::string(row.scheme), row.most_knees, {}};
    std::vector<FeatureRow> all{{row.mode.names}, row.count, row.selector, row.gradient, row.intensity};
    for (const auto* part : {&row.times, &row.levels}) all.insert(all.end(), part->begin(), part->end());
    all.insert(all.end(), row.linlog.begin(), row.linlog.end());
    for (const FeatureRow& feature : all)
      if (auto name = find_feature(access, feature.names)) found.features.push_back(*name);
    return found;
  }
  return {};
}

ResponseSetting apply_response(FeatureAccess& access, const std::optional<ResponseRequest>& request,
                               double exposure_s) {
  FeatureNotes notes(access);
  if (request) write_request(access, notes, *request, exposure_s);
  ResponseSetting setting;
  for (const ResponseRow& row : response_rows()) {
    if (!offers(access, row)) continue;
    if (setting.scheme == "linear" && is_on(access, row))
      read_row(notes, row, exposure_s, setting);
    else
      (void)(row.mode.on.empty() ? notes.read({row.mode.names}).has_value()
                                 : notes.read_choice(row.mode.names).has_value());
  }
  if (const auto* unknown = std::get_if<UnknownResponse>(&setting.in_force))
    notes.remark(fmt::format("{}: {}; frames are recorded, and taken as linear for now", setting.scheme, unknown->why));
  setting.readings = std::move(notes.readings);
  setting.remarks = std::move(notes.remarks);
  return setting;
}

std::optional<ResponseCurve> response_curve_of(const ResponseSetting& setting, const PixelFormat& format,
                                               double black_level) {
  const auto curve = [&](const SensorResponse& sensor) {
    return sensor_response(sensor, format.bits, black_level, 1, format.colour_channels());
  };
  if (const auto* linear = std::get_if<LinearSensor>(&setting.in_force)) return curve(*linear);
  if (const auto* slopes = std::get_if<MultiSlopeSensor>(&setting.in_force)) return curve(*slopes);
  if (const auto* linlog = std::get_if<LinLogSensor>(&setting.in_force)) return curve(*linlog);
  return std::nullopt;
}

ResponseCurve approximate_response_curve(const ResponseSetting& setting, const PixelFormat& format,
                                         double black_level) {
  if (std::optional<ResponseCurve> curve = response_curve_of(setting, format, black_level)) return *curve;
  return linear_response(format.bits, black_level, 1, format.colour_channels());
}

nlohmann::json to_json(const std::vector<FeatureReading>& readings) {
  nlohmann::json json = nlohmann::json::object();
  for (const FeatureReading& reading : readings) json[reading.feature] = reading.value;
  return json;
}

nlohmann::json to_json(const ResponseSetting& setting) {
  nlohmann::json json{
      {"scheme", setting.scheme}, {"features", to_json(setting.readings)}, {"remarks", setting.remarks}};
  if (const auto* slopes = std::get_if<MultiSlopeSensor>(&setting.in_force)) {
    for (const SlopeKnee& knee : slopes->knees)
      json["multi_slope"].push_back({{"time", knee.time}, {"level", knee.level}});
  } else if (const auto* linlog = std::get_if<LinLogSensor>(&setting.in_force)) {
    json["lin_log"] = {{"value_1", linlog->value_1},
                       {"value_2", linlog->value_2},
                       {"time_1", linlog->time_1},
                       {"time_2", linlog->time_2}};
  } else if (const auto* unknown = std::get_if<UnknownResponse>(&setting.in_force)) {
    json["unknown"] = unknown->why;
  }
  return json;
}

}  // namespace mf
