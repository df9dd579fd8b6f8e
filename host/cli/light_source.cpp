// SPDX-License-Identifier: Apache-2.0
#include "host/cli/light_source.h"

#include <chrono>

#include "common/error.h"
#include "common/seconds_since.h"
#include "host/cli/command.h"
#include "host/cli/session_views.h"
#include "host/light_field/just_in_time.h"

namespace mf {

namespace {

using Clock = std::chrono::steady_clock;

// Without --directions a picture is as good as with the whole light field; else it is a preview, with less care where
// the plane's own light is not shown.
JustInTimeOptions quality(const LightField& field, const LightOptions& options) {
  constexpr int preview_texels = 16;
  constexpr int block = 8;
  if (options.directions > 0) return {preview_texels, options.plane != LightOptions::Plane::all};
  return {(field.resolution + block - 1) / block * block, false};
}

// What each cell brings where the surroundings have no panorama: every cell has to be asked, roughly.
std::vector<double> light_of_capture(const Capture& capture, const Bounds& object) {
  const LightField& field = capture.focused;
  if (!field.surroundings.panorama.empty()) return light_on(field, object);
  std::vector<TileRequest> requests;
  requests.reserve(field.directions.size());
  for (std::uint32_t i = 0; i < field.directions.size(); ++i)
    requests.push_back({{i}, field.plane.min_m.cast<float>(), field.plane.max_m.cast<float>()});
  const std::vector<PlaneTile> tiles = resample_just_in_time(capture.views, field, capture.penalty, requests, {});
  std::vector<PlaneImage> images;
  images.reserve(tiles.size());
  for (const PlaneTile& tile : tiles) images.push_back(tile.image());
  return light_of_tiles(field.directions, images);
}

IncidentLight light_of(const Capture& capture, const Bounds& object, const LightOptions& options,
                       StageSeconds& seconds) {
  const LightField& field = capture.focused;
  auto start = Clock::now();
  const LightPlan plan = plan_light(field.directions, light_of_capture(capture, object), object, field.plane, options);
  seconds["choosing"] = seconds_since(start);
  start = Clock::now();
  std::vector<PlaneTile> tiles =
      resample_just_in_time(capture.views, field, capture.penalty, plan.requests, quality(field, options));
  IncidentLight light = incident_light(field, object, plan, std::move(tiles), options);
  seconds["resampling"] = seconds_since(start);
  return light;
}

void refuse_session_options(const std::filesystem::path& file, const ResampleOptions& given) {
  const ResampleOptions usual;
  const char* flag = nullptr;
  if (given.height_m != usual.height_m) flag = "--height";
  if (given.proxy != usual.proxy) flag = "--proxy";
  if (given.k != usual.k) flag = "-k";
  if (given.rectangle) flag = "--rectangle";
  if (flag != nullptr)
    throw InputError(file.string(), flag, "is for a session: this light field was resampled already; leave it out");
}

}  // namespace

LightSource open_light_source(const std::string& command, const std::filesystem::path& path,
                              const ResampleOptions& options, StageSeconds& seconds, const Progress& progress) {
  auto start = Clock::now();
  if (!std::filesystem::is_directory(path)) {
    refuse_session_options(path, options);
    LightField field = read_light_field(path);
    seconds["reading"] = seconds_since(start);
    return field;
  }
  SessionViews session = load_session_views(command, path, options, Team(), progress);
  seconds["loading"] = seconds_since(start);
  start = Clock::now();
  const Resampling focused(session.views, session.rectangle, options, Team(), progress);
  seconds["focusing"] = seconds_since(start);
  return Capture{std::move(session.views), focused.field(), focused.penalty()};
}

const PlaneRectangle& plane_of(const LightSource& source) {
  const auto* field = std::get_if<LightField>(&source);
  return field != nullptr ? field->plane : std::get<Capture>(source).focused.plane;
}

IncidentLight light_for(const LightSource& source, const TriangleMesh& mesh_in_world, const LightOptions& options,
                        StageSeconds& seconds) {
  const auto* field = std::get_if<LightField>(&source);
  const Bounds object = bounds_of(transformed(plane_of(source).world_from_plane.inverse(), mesh_in_world));
  if (field == nullptr) return light_of(std::get<Capture>(source), object, options, seconds);
  const auto start = Clock::now();
  IncidentLight light = incident_light(*field, object, options);
  seconds["merging"] = seconds_since(start);
  return light;
}

}  // namespace mf
