// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/resample.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <mutex>
#include <nlohmann/json.hpp>

#include "common/check.h"
#include "host/light_field/hole_filler.h"
#include "host/light_field/panorama.h"
#include "host/light_field/proxy_choice.h"
#include "host/light_field/tile_resampler.h"

namespace mf {

namespace {

constexpr int panorama_width = 1024;  // 0.35° a pixel: finer than any cell, coarser than a camera's pixel

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

std::string options_to_json(const ResampleOptions& o, int k, const Surroundings& surroundings) {
  nlohmann::json json{{"height", o.height_m},
                      {"directions", o.directions},
                      {"size", o.size},
                      {"proxy", surroundings_name(surroundings)},
                      {"k", k},
                      {"resolution", o.resolution},
                      {"border", o.border},
                      {"fill", o.fill}};
  if (o.rectangle) json["rectangle"] = *o.rectangle;
  return json.dump();
}

double mean_confidence(const LightField& field) {
  double sum = 0, weights = 0;
  for (std::size_t i = 0; i < field.directions.size(); ++i) {
    const double w = static_cast<double>(field.directions.solid_angles_sr[i] * field.directions.directions[i].z());
    double tile = 0;
    for (std::size_t t = 0; t < field.texel_count(); ++t) tile += static_cast<double>(field.tile(i)[t].w());
    sum += w * tile / static_cast<double>(field.texel_count());
    weights += w;
  }
  return sum / weights;
}

// Returns how many texels no view saw and were given a guess.
std::size_t fill_tiles(const std::vector<FieldView>& views, LightField& field, const EmitterBlender& emitters,
                       const PenaltyOptions& penalty, bool fill, const Progress& progress) {
  tbb::enumerable_thread_specific<TileResampler> resamplers(
      [&] { return TileResampler(views, field, emitters, penalty); });
  const auto filler = fill ? std::optional<HoleFiller>(field) : std::nullopt;
  std::atomic<std::size_t> filled = 0;
  std::mutex reporting;
  std::size_t done = 0;
  tbb::parallel_for(std::size_t{0}, field.directions.size(), [&](std::size_t i) {
    resamplers.local().fill(i, field.tile(i));
    if (filler) filled += filler->fill(i, field.tile(i));
    const std::lock_guard lock(reporting);
    report_progress(progress, "resampling", static_cast<double>(++done) / static_cast<double>(field.directions.size()));
  });
  return filled;
}

}  // namespace

std::optional<std::string> ResampleOptions::validate() const {
  if (!std::isfinite(height_m)) return "height: must be a number of metres";
  if (directions < 11 || directions > 500000) return "directions: must be between 11 and 500000";
  if (size < 2 || size > 1024) return "size: must be between 2 and 1024 texels";
  if (k < 0 || k > 64) return "k: must be between 1 and 64 views (0 chooses)";
  if (!(resolution >= 0) || !std::isfinite(resolution)) return "resolution: must be a number ≥ 0";
  if (!(border > 0) || !std::isfinite(border)) return "border: must be a number > 0";
  if (const auto fault = proxy_fault(proxy)) return "proxy: " + *fault;
  if (rectangle && !((*rectangle)[2] > (*rectangle)[0] && (*rectangle)[3] > (*rectangle)[1]))
    return "rectangle: must be x0 y0 x1 y1 with x0 < x1 and y0 < y1, in metres";
  return std::nullopt;
}

ResampleResult resample(const std::vector<FieldView>& views, const PlaneRectangle& rectangle,
                        const ResampleOptions& options, const Progress& progress) {
  check(!options.validate().has_value(), "resample options are validated by the caller");
  ResampleResult result;
  result.views = views.size();
  LightField& field = result.field;
  field.plane = rectangle;
  field.resolution = options.size;
  field.directions = geodesic_hemisphere(options.directions);
  const int k = options.k > 0 ? options.k : options.proxy == "plane" ? 15 : 6;
  const PenaltyOptions penalty{k, 1, static_cast<float>(options.resolution), static_cast<float>(options.border)};

  auto start = Clock::now();
  report_progress(progress, "focusing", 0);
  const std::vector<Emitter> emitters = options.proxy == "plane" ? std::vector<Emitter>{} : find_emitters(views);
  ProxyChoice choice = choose_proxy(views, rectangle, options.proxy, k, emitters);
  field.surroundings = std::move(choice.surroundings);
  result.sphere_scores = std::move(choice.sphere_scores);
  const EmitterBlender emitter_blender(views, field.surroundings, emitters, rectangle);
  field.emitters = emitter_blender.emitters();
  if (!field.surroundings.is_plane())
    field.surroundings.panorama = make_panorama(views, field.surroundings, emitter_blender, panorama_width);
  report_progress(progress, "focusing", 1);
  result.seconds["focusing"] = seconds_since(start);
  field.options_json = options_to_json(options, k, field.surroundings);

  start = Clock::now();
  field.rgbc.assign(field.directions.size() * field.texel_count(), Eigen::Vector4f::Zero());
  const std::size_t filled = fill_tiles(views, field, emitter_blender, penalty, options.fill, progress);
  result.filled_share = static_cast<double>(filled) / static_cast<double>(field.rgbc.size());
  result.seconds["blending"] = seconds_since(start);
  if (options.provenance) result.provenance = trace_provenance(views, field, emitter_blender, penalty, {});
  result.mean_confidence = mean_confidence(field);
  return result;
}

}  // namespace mf
