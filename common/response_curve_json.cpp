// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/json_file.h"
#include "common/response_curve.h"

namespace mf {

nlohmann::json to_json(const ResponseCurve& curve) {
  nlohmann::json json;
  json["black_level"] = curve.black_level;
  // JSON knows no infinity: null says that nothing saturates.
  json["saturation_code"] = std::isfinite(curve.saturation_code) ? nlohmann::json(curve.saturation_code) : nullptr;
  json["radiance_scale"] = curve.radiance_scale;
  json["absolute"] = curve.absolute;
  const Vignetting& v = curve.vignetting;
  json["vignetting"] = {{"centre_px", {v.centre_px.x(), v.centre_px.y()}},
                        {"radius_px", v.radius_px},
                        {"coefficients", {v.coefficients[0], v.coefficients[1], v.coefficients[2]}}};
  for (const char* key : {"exposure", "observed", "relative_sigma"}) json[key] = nlohmann::json::array();
  for (const ResponseChannel& channel : curve.channels) {
    json["exposure"].push_back(channel.exposure);
    json["observed"].push_back(channel.observed);
    json["relative_sigma"].push_back(channel.relative_sigma);
  }
  return json;
}

namespace {

using Table = std::vector<double>;

void require_channel(const ResponseChannel& channel, std::size_t levels, std::size_t c, const std::string& file) {
  const auto field = [&](const char* name) { return fmt::format("{}[{}]", name, c); };
  const Table& e = channel.exposure;
  if (e.size() < 2 || e.size() != levels)
    throw InputError(file, field("exposure"), "needs one value per code, as many in every channel");
  if (!std::all_of(e.begin(), e.end(), [](double v) { return std::isfinite(v) && v >= 0; }) ||
      !std::is_sorted(e.begin(), e.end()) || !(e.back() > 0))
    throw InputError(file, field("exposure"), "must be finite, never negative, never decreasing and not all zero");
  if (channel.observed.size() != levels) throw InputError(file, field("observed"), "needs one value per code");
  if (channel.relative_sigma.size() != levels)
    throw InputError(file, field("relative_sigma"), "needs one value per code");
}

Vignetting vignetting_from_json(const nlohmann::json& json, const std::string& file) {
  const auto centre = json_field<std::array<double, 2>>(json, "centre_px", file);
  const auto coefficients = json_field<std::array<double, 3>>(json, "coefficients", file);
  Vignetting vignetting;
  vignetting.centre_px = {centre[0], centre[1]};
  vignetting.radius_px = json_field<double>(json, "radius_px", file);
  vignetting.coefficients = {coefficients[0], coefficients[1], coefficients[2]};
  if (!(vignetting.radius_px > 0)) throw InputError(file, "vignetting.radius_px", "must be positive");
  return vignetting;
}

}  // namespace

ResponseCurve response_curve_from_json(const nlohmann::json& json, const std::string& file) {
  ResponseCurve curve;
  curve.black_level = json_field<double>(json, "black_level", file);
  const auto exposure = json_field<std::vector<Table>>(json, "exposure", file);
  if (exposure.empty()) throw InputError(file, "exposure", "needs one list for each channel");
  // A table that another tool made may lack these: then every code counts as observed, its uncertainty as unknown.
  const std::vector<std::vector<bool>> all_observed(exposure.size(), std::vector<bool>(exposure[0].size(), true));
  const std::vector<Table> no_sigma(exposure.size(), Table(exposure[0].size(), 0.0));
  const auto observed = json_field_or(json, "observed", file, all_observed);
  const auto sigma = json_field_or(json, "relative_sigma", file, no_sigma);
  if (observed.size() != exposure.size()) throw InputError(file, "observed", "needs as many lists as exposure");
  if (sigma.size() != exposure.size()) throw InputError(file, "relative_sigma", "needs as many lists as exposure");
  for (std::size_t c = 0; c < exposure.size(); ++c) {
    curve.channels.push_back({exposure[c], observed[c], sigma[c]});
    require_channel(curve.channels[c], exposure[0].size(), c, file);
  }
  const bool bounded = !json.contains("saturation_code") || !json.at("saturation_code").is_null();
  const double last = static_cast<double>(exposure[0].size() - 1);
  curve.saturation_code =
      bounded ? json_field_or(json, "saturation_code", file, last) : std::numeric_limits<double>::infinity();
  if (!(curve.black_level >= 0 && curve.black_level < std::min(last, curve.saturation_code)))
    throw InputError(file, "black_level", "must lie below saturation_code and the last code");
  curve.radiance_scale = json_field_or(json, "radiance_scale", file, Table(exposure.size(), 1.0));
  if (curve.radiance_scale.size() != exposure.size() ||
      !std::all_of(curve.radiance_scale.begin(), curve.radiance_scale.end(),
                   [](double s) { return std::isfinite(s) && s > 0; }))
    throw InputError(file, "radiance_scale", "needs one positive number for each channel");
  curve.absolute = json_field_or(json, "absolute", file, false);
  if (json.contains("vignetting")) curve.vignetting = vignetting_from_json(json.at("vignetting"), file);
  return curve;
}

ResponseCurve read_response_curve(const std::filesystem::path& path) {
  return response_curve_from_json(read_json_file(path), path.string());
}

}  // namespace mf
