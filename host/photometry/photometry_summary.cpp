// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/photometry/photometry.h"

namespace mf {

namespace {

std::string channel_name(std::size_t c, std::size_t count) {
  constexpr std::array<const char*, 3> names{"red", "green", "blue"};
  return count == 3 ? names[c] : "mono";
}

nlohmann::json channel_json(const ChannelReport& report, const std::string& name) {
  const SelfConsistency& c = report.consistency;
  nlohmann::json json{{"channel", name},
                      {"black_level", report.black_level},
                      {"black_sigma", report.black_sigma},
                      {"observed_fraction", report.observed_fraction},
                      {"iterations", report.iterations},
                      {"converged", report.converged},
                      {"pixels", report.pixels},
                      {"self_consistency", nullptr}};
  if (c.readings > 0)
    json["self_consistency"] = {{"rms", c.rms},           {"noise", c.noise}, {"systematic", c.systematic},
                                {"readings", c.readings}, {"share", c.share}, {"frame_mean", c.frame_mean}};
  return json;
}

std::string channel_line(const ChannelReport& report, const std::string& name) {
  const SelfConsistency& c = report.consistency;
  std::string line = fmt::format("  {:<5}  black {:.2f} ± {:.2f}, {:.0f} % of the codes observed, ", name,
                                 report.black_level, report.black_sigma, 100 * report.observed_fraction);
  if (c.readings > 0)
    line += fmt::format("filters agree within {:.2f} % RMS (noise alone {:.2f} %, curve {:.2f} %; {} readings)",
                        100 * c.rms, 100 * c.noise, 100 * c.systematic, c.readings);
  else
    line += "every reading is noisier than noise_limit: no self-consistency";
  if (!report.converged) line += fmt::format("; not converged after {} iterations", report.iterations);
  return line + "\n";
}

// What each frame's exposure is off against the others: the median over the channels, 0 where no reading tells.
std::vector<double> frame_deviations(const PhotometryResult& result) {
  std::vector<double> deviations;
  for (std::size_t i = 0; i < result.sweep_frames.size(); ++i) {
    std::vector<double> means;
    for (const ChannelReport& report : result.channels)
      if (i < report.consistency.frame_mean.size() && std::isfinite(report.consistency.frame_mean[i]))
        means.push_back(report.consistency.frame_mean[i]);
    std::sort(means.begin(), means.end());
    deviations.push_back(means.empty() ? 0 : means[means.size() / 2]);
  }
  return deviations;
}

}  // namespace

nlohmann::json response_json(const PhotometryResult& result, const PhotometryOptions& options) {
  nlohmann::json json = to_json(result.curve);
  const ResponseOptions& r = options.response;
  json["options"] = {{"linear", options.linear},           {"pixels", r.pixels},
                     {"knot_step", r.knot_step},           {"kink_scale", r.kink_scale},
                     {"outlier_sigmas", r.outlier_sigmas}, {"max_iterations", r.max_iterations},
                     {"noise_limit", r.noise_limit}};
  return json;
}

nlohmann::json photometry_summary(const PhotometryResult& result) {
  nlohmann::json json{{"black_level", result.curve.black_level},
                      {"saturation_code", nullptr},
                      {"levels", result.curve.channels.front().exposure.size()},
                      {"radiance_scale", result.curve.radiance_scale},
                      {"absolute", result.curve.absolute},
                      {"channels", nlohmann::json::array()},
                      {"frames", nlohmann::json::array()}};
  if (std::isfinite(result.curve.saturation_code)) json["saturation_code"] = result.curve.saturation_code;
  for (std::size_t c = 0; c < result.channels.size(); ++c)
    json["channels"].push_back(channel_json(result.channels[c], channel_name(c, result.channels.size())));
  const std::vector<double> deviations = frame_deviations(result);
  for (std::size_t i = 0; i < deviations.size(); ++i)
    json["frames"].push_back({{"name", result.sweep_frames[i]}, {"exposure_deviation", deviations[i]}});
  return json;
}

std::string photometry_text(const PhotometryResult& result) {
  const ResponseCurve& curve = result.curve;
  std::string text;
  if (std::isfinite(curve.saturation_code))
    text = fmt::format("response: {} codes, black level {:.2f}, saturation at {:.0f}\n",
                       curve.channels.front().exposure.size(), curve.black_level, curve.saturation_code);
  else
    text = "response: the identity, the frames are linear\n";
  for (std::size_t c = 0; c < result.channels.size(); ++c)
    text += channel_line(result.channels[c], channel_name(c, result.channels.size()));
  const std::vector<double> deviations = frame_deviations(result);
  for (std::size_t i = 0; i < deviations.size(); ++i)
    if (std::abs(deviations[i]) > 0.01)
      text += fmt::format("  frame {}: {:+.1f} % against the others: check its exposure_s and nd_density\n",
                          result.sweep_frames[i], 100 * deviations[i]);
  if (!curve.absolute) return text + "no reference reading: radiance is relative\n";
  text += "radiance scale from the reference reading:";
  for (const double scale : curve.radiance_scale) text += fmt::format(" {:.6g}", scale);
  text += "\n";
  return text;
}

}  // namespace mf
