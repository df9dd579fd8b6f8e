// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/resample.h"
#include "host/light_field/panorama.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <mutex>
#include <nlohmann/json.hpp>

#include "common/check.h"
#include "host/light_field/tile_resampler.h"

namespace mf {

namespace {

constexpr int panorama_width = 1024;  // 0.35° a pixel: finer than any cell, coarser than a camera's pixel

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

Surroundings choose_surroundings(const std::vector<FieldView>& views, const PlaneRectangle& rectangle,
                                 const std::string& proxy, int k, std::span<const Emitter> emitters,
                                 std::vector<SphereScore>& scores) {
  if (proxy == "plane") return {};
  if (proxy == "auto") return find_surroundings(views, rectangle, emitters);
  if (const auto radius = parse_sphere(proxy)) return sphere_surroundings(centre_of(rectangle), *radius);
  scores = score_spheres(views, rectangle, k);
  const auto best = std::min_element(scores.begin(), scores.end(), [](const SphereScore& a, const SphereScore& b) {
    return a.inconsistency < b.inconsistency;
  });
  return sphere_surroundings(centre_of(rectangle), best->radius_m);
}

std::string options_to_json(const ResampleOptions& o, int k, const Surroundings& surroundings) {
  nlohmann::json json{{"height", o.height_m},
                      {"directions", o.directions},
                      {"size", o.size},
                      {"proxy", surroundings_name(surroundings)},
                      {"k", k}};
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

void fill_tiles(const std::vector<FieldView>& views, LightField& field, const EmitterBlender& emitters, int k,
                const Progress& progress) {
  tbb::enumerable_thread_specific<TileResampler> resamplers([&] { return TileResampler(views, field, emitters, k); });
  std::mutex reporting;
  std::size_t done = 0;
  tbb::parallel_for(std::size_t{0}, field.directions.size(), [&](std::size_t i) {
    resamplers.local().fill(i, field.tile(i));
    const std::lock_guard lock(reporting);
    report_progress(progress, "resampling", static_cast<double>(++done) / static_cast<double>(field.directions.size()));
  });
}

}  // namespace

std::optional<std::string> ResampleOptions::validate() const {
  if (!std::isfinite(height_m)) return "height: must be a number of metres";
  if (directions < 11 || directions > 500000) return "directions: must be between 11 and 500000";
  if (size < 2 || size > 1024) return "size: must be between 2 and 1024 texels";
  if (k < 0 || k > 64) return "k: must be between 1 and 64 views (0 chooses)";
  if (proxy != "auto" && proxy != "sphere" && proxy != "plane" && !parse_sphere(proxy))
    return "proxy: must be auto, sphere, sphere:R (metres), sphere:inf or plane";
  if (rectangle && !((*rectangle)[2] > (*rectangle)[0] && (*rectangle)[3] > (*rectangle)[1]))
    return "rectangle: must be x0 y0 x1 y1 with x0 < x1 and y0 < y1, in metres";
  return std::nullopt;
}

FocusResult focus(const std::vector<FieldView>& views, const PlaneRectangle& rectangle, const ResampleOptions& options,
                  const Progress& progress) {
  check(!options.validate().has_value(), "resample options are validated by the caller");
  FocusResult result;
  LightField& field = result.field;
  field.plane = rectangle;
  field.resolution = options.size;
  field.directions = geodesic_hemisphere(options.directions);
  result.k = options.k > 0 ? options.k : options.proxy == "plane" ? 15 : 6;
  report_progress(progress, "focusing", 0);
  const std::vector<Emitter> emitters = options.proxy == "plane" ? std::vector<Emitter>{} : find_emitters(views);
  field.surroundings = choose_surroundings(views, rectangle, options.proxy, result.k, emitters, result.sphere_scores);
  const EmitterBlender emitter_blender(views, field.surroundings, emitters, rectangle);
  field.emitters = emitter_blender.emitters();
  if (!field.surroundings.is_plane())
    field.surroundings.panorama = make_panorama(views, field.surroundings, emitter_blender, panorama_width);
  report_progress(progress, "focusing", 1);
  field.options_json = options_to_json(options, result.k, field.surroundings);
  return result;
}

ResampleResult resample(const std::vector<FieldView>& views, const PlaneRectangle& rectangle,
                        const ResampleOptions& options, const Progress& progress) {
  auto start = Clock::now();
  FocusResult focused = focus(views, rectangle, options, progress);
  ResampleResult result;
  result.views = views.size();
  result.sphere_scores = std::move(focused.sphere_scores);
  result.field = std::move(focused.field);
  result.seconds["focusing"] = seconds_since(start);

  start = Clock::now();
  LightField& field = result.field;
  field.rgbc.assign(field.directions.size() * field.texel_count(), Eigen::Vector4f::Zero());
  const EmitterBlender emitters(views, field.surroundings, field.emitters);
  fill_tiles(views, field, emitters, focused.k, progress);
  result.seconds["blending"] = seconds_since(start);
  result.mean_confidence = mean_confidence(field);
  return result;
}

}  // namespace mf
