// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/resample.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/global_control.h>
#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>

#include "common/check.h"
#include "common/seconds_since.h"
#include "host/light_field/hole_filler.h"
#include "host/light_field/light_field_writer.h"
#include "host/light_field/panorama.h"
#include "host/light_field/plane_tiles.h"
#include "host/light_field/proxy_choice.h"
#include "host/light_field/tile_resampler.h"

namespace mf {

namespace {

constexpr int panorama_width = 1024;  // 0.35° a pixel: finer than any cell, coarser than a camera's pixel

using Clock = std::chrono::steady_clock;

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

}  // namespace

std::optional<std::string> ResampleOptions::validate() const {
  if (!std::isfinite(height_m)) return "height: must be a number of metres";
  if (directions < 11 || directions > 500000) return "directions: must be between 11 and 500000";
  if (size < 2 || size > 1024) return "size: must be between 2 and 1024 texels";
  if (k < 0 || k > 64) return "k: must be between 1 and 64 views (0 chooses)";
  if (!(resolution >= 0) || !std::isfinite(resolution)) return "resolution: must be a number ≥ 0";
  if (!(border > 0) || !std::isfinite(border)) return "border: must be a number > 0";
  if (proxy == "plane" && resolution != 0) return "resolution: is for the other proxies; leave it out with plane";
  if (proxy == "plane" && border != 1) return "border: is for the other proxies; leave it out with plane";
  if (const auto fault = proxy_fault(proxy)) return "proxy: " + *fault;
  if (rectangle && !((*rectangle)[2] > (*rectangle)[0] && (*rectangle)[3] > (*rectangle)[1]))
    return "rectangle: must be x0 y0 x1 y1 with x0 < x1 and y0 < y1, in metres";
  return std::nullopt;
}

// ---- tiles on demand ----

struct Resampling::Impl {
  const std::vector<FieldView>& views;
  PenaltyOptions penalty;
  LightField field;
  std::vector<SphereScore> sphere_scores;
  double focusing_s = 0;
  std::optional<ProxyVisibility> visibility;
  // The plane needs the first and its tiles, every other proxy the others.
  std::optional<RectifiedViews> rectified;
  std::optional<EmitterBlender> emitters;
  std::optional<tbb::enumerable_thread_specific<PlaneTiles>> plane_tiles;
  std::optional<tbb::enumerable_thread_specific<TileResampler>> resamplers;
  std::optional<HoleFiller> filler;
};

Resampling::Resampling(const std::vector<FieldView>& views, const PlaneRectangle& rectangle,
                       const ResampleOptions& options, const Team& team, const Progress& progress)
    : impl_(new Impl{views, {}, {}, {}, 0, {}, {}, {}, {}, {}, {}}) {
  check(!options.validate().has_value(), "resample options are validated by the caller");
  const auto start = Clock::now();
  report_progress(progress, "focusing", 0);
  Impl& i = *impl_;
  LightField& field = i.field;
  field.plane = rectangle;
  field.resolution = options.size;
  field.directions = geodesic_hemisphere(options.directions);
  const int k = options.k > 0 ? options.k : options.proxy == "plane" ? 15 : 6;
  i.penalty = {k, 1, static_cast<float>(options.resolution), static_cast<float>(options.border)};
  const std::vector<Emitter> emitters = options.proxy == "plane" ? std::vector<Emitter>{} : find_emitters(views);
  ProxyChoice choice = choose_proxy(views, rectangle, options.proxy, k, emitters, team);
  field.surroundings = std::move(choice.surroundings);
  i.sphere_scores = std::move(choice.sphere_scores);
  field.options_json = options_to_json(options, k, field.surroundings);
  i.visibility.emplace(views, field.surroundings, rectangle);
  if (field.surroundings.is_plane()) {
    i.rectified.emplace(views, rectangle, options.size);
    i.plane_tiles.emplace([&i, k] { return PlaneTiles(*i.rectified, i.field, k); });
  } else {
    i.emitters.emplace(views, field.surroundings, emitters, rectangle, team);
    field.emitters = i.emitters->emitters();
    field.surroundings.panorama = make_panorama(views, field.surroundings, *i.emitters, panorama_width, team);
    i.resamplers.emplace([&i] { return TileResampler(i.views, i.field, *i.visibility, *i.emitters, i.penalty); });
  }
  if (options.fill) i.filler.emplace(field);
  report_progress(progress, "focusing", 1);
  i.focusing_s = seconds_since(start);
}

Resampling::~Resampling() = default;

const LightField& Resampling::field() const {
  return impl_->field;
}
const PenaltyOptions& Resampling::penalty() const {
  return impl_->penalty;
}
const std::vector<SphereScore>& Resampling::sphere_scores() const {
  return impl_->sphere_scores;
}
std::size_t Resampling::views() const {
  return impl_->views.size();
}
double Resampling::focusing_s() const {
  return impl_->focusing_s;
}

std::size_t Resampling::fill(std::size_t direction, Eigen::Vector4f* tile) {
  std::size_t guessed = 0;
  fill({&direction, 1}, tile, {&guessed, 1});
  return guessed;
}

void Resampling::fill(std::span<const std::size_t> directions, Eigen::Vector4f* tiles, std::span<std::size_t> guessed) {
  const std::size_t texels = impl_->field.texel_count();
  if (impl_->plane_tiles)
    impl_->plane_tiles->local().fill(directions, tiles);
  else
    for (std::size_t i = 0; i < directions.size(); ++i)
      impl_->resamplers->local().fill(directions[i], tiles + i * texels);
  for (std::size_t i = 0; i < directions.size(); ++i)
    guessed[i] = impl_->filler ? impl_->filler->fill(directions[i], tiles + i * texels) : 0;
}

std::size_t Resampling::directions_at_once() const {
  if (!impl_->plane_tiles) return 1;
  constexpr std::size_t most = 32;                          // what views show of a block is read once for all of them
  constexpr std::size_t texels_at_hand = most * 128 * 128;  // 8 MB a thread, however large the tiles
  return std::clamp(texels_at_hand / impl_->field.texel_count(), std::size_t{1}, most);
}

Provenance Resampling::provenance(std::vector<std::string> frame_names) const {
  // The plane goes without emitters.
  const EmitterBlender none(impl_->views, impl_->field.surroundings, std::vector<ShadedEmitter>{},
                            EmitterBlender::Lit::yes);
  return trace_provenance(impl_->views, impl_->field, *impl_->visibility, impl_->emitters ? *impl_->emitters : none,
                          impl_->penalty, std::move(frame_names));
}

// ---- all of them ----

namespace {

// A tile on its way: packed in any thread, stored in the order of directions.
struct FinishedTile {
  std::size_t direction = 0;
  std::string packed;
  double mean_confidence = 0;
  std::size_t filled = 0;
  double blending_s = 0;
  double packing_s = 0;
};

double mean_confidence_of(std::span<const Eigen::Vector4f> tile) {
  double sum = 0;
  for (const Eigen::Vector4f& texel : tile) sum += static_cast<double>(texel.w());
  return sum / static_cast<double>(tile.size());
}

// Fills and packs the tiles of successive directions.
template <typename Pack>
std::vector<FinishedTile> finish_tiles(Resampling& resampling, std::span<const std::size_t> directions,
                                       const Pack& pack) {
  const std::size_t texels = resampling.field().texel_count();
  thread_local std::vector<Eigen::Vector4f> tiles;
  tiles.resize(directions.size() * texels);
  std::vector<std::size_t> guessed(directions.size());
  auto start = Clock::now();
  resampling.fill(directions, tiles.data(), guessed);
  const double blending_s = seconds_since(start) / static_cast<double>(directions.size());
  std::vector<FinishedTile> finished;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const std::span<const Eigen::Vector4f> tile(tiles.data() + i * texels, texels);
    start = Clock::now();
    std::string packed = pack(directions[i], tile);
    finished.push_back(
        {directions[i], std::move(packed), mean_confidence_of(tile), guessed[i], blending_s, seconds_since(start)});
  }
  return finished;
}

std::size_t threads_at_work() {
  const auto allowed = tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
  return std::min(allowed, static_cast<std::size_t>(tbb::this_task_arena::max_concurrency()));
}

// Makes tiles until the team has all: (direction, tile) → string by `pack` in many threads, then `store` for those that
// this rank made, in the order of directions.
template <typename Pack, typename Store>
void make_tiles(Resampling& resampling, Turns& turns, const Pack& pack, const Store& store) {
  const std::size_t directions = resampling.field().directions.size();
  const std::size_t at_once = resampling.directions_at_once();
  // So many that a slow tile does not hold up the others.
  const std::size_t turns_at_hand = (at_once > 1 ? 2 : 8) * threads_at_work();
  const auto deal = [&](tbb::flow_control& control) {
    const std::size_t first = turns.take() * at_once;
    std::vector<std::size_t> dealt;
    for (std::size_t d = first; d < std::min(first + at_once, directions); ++d) dealt.push_back(d);
    if (dealt.empty()) control.stop();
    return dealt;
  };
  using Dealt = std::vector<std::size_t>;
  using Finished = std::vector<FinishedTile>;
  tbb::parallel_pipeline(
      turns_at_hand,
      tbb::make_filter<void, Dealt>(tbb::filter_mode::serial_in_order, deal) &
          tbb::make_filter<Dealt, Finished>(tbb::filter_mode::parallel,
                                            [&](const Dealt& dealt) { return finish_tiles(resampling, dealt, pack); }) &
          tbb::make_filter<Finished, void>(tbb::filter_mode::serial_in_order, [&](Finished finished) {
            for (FinishedTile& tile : finished) store(std::move(tile));
          }));
}

// What is summed up over the tiles, in their order.
struct Tally {
  double confidence = 0, weights = 0, blending_s = 0, packing_s = 0;
  std::size_t filled = 0;

  void add(const DirectionSet& set, const FinishedTile& tile) {
    const double w = static_cast<double>(set.solid_angles_sr[tile.direction] * set.directions[tile.direction].z());
    confidence += w * tile.mean_confidence;
    weights += w;
    filled += tile.filled;
    blending_s += tile.blending_s;
    packing_s += tile.packing_s;
  }
  void enter(ResampleResult& result) const {
    const double threads = static_cast<double>(threads_at_work());
    result.mean_confidence = confidence / weights;
    result.filled_share =
        static_cast<double>(filled) / static_cast<double>(result.field.directions.size() * result.field.texel_count());
    result.seconds["blending"] = blending_s / threads;
    result.seconds["packing"] = packing_s / threads;
  }
};

ResampleResult start_of_result(const Resampling& resampling) {
  ResampleResult result;
  result.views = resampling.views();
  result.field = resampling.field();
  result.sphere_scores = resampling.sphere_scores();
  result.seconds["focusing"] = resampling.focusing_s();
  return result;
}

// What goes before a tile's packed bytes when one rank sends it to another.
struct TileHead {
  std::size_t direction = 0;
  std::size_t filled = 0;
  double mean_confidence = 0;
};

std::string to_message(const FinishedTile& tile) {
  const TileHead head{tile.direction, tile.filled, tile.mean_confidence};
  std::string message(sizeof head, '\0');
  std::memcpy(message.data(), &head, sizeof head);
  return message + tile.packed;
}
FinishedTile from_message(const std::string& message) {
  TileHead head;
  std::memcpy(&head, message.data(), sizeof head);
  return {head.direction, message.substr(sizeof head), head.mean_confidence, head.filled};
}

}  // namespace

ResampleResult resample(const std::vector<FieldView>& views, const PlaneRectangle& rectangle,
                        const ResampleOptions& options, const Progress& progress) {
  Resampling resampling(views, rectangle, options, Team(), progress);
  ResampleResult result = start_of_result(resampling);
  LightField& field = result.field;
  field.rgbc.resize(field.directions.size() * field.texel_count());
  Tally tally;
  const auto keep = [&](std::size_t direction, std::span<const Eigen::Vector4f> tile) {
    std::copy(tile.begin(), tile.end(), field.tile(direction));
    return std::string();
  };
  Team alone;
  Turns turns(alone);
  make_tiles(resampling, turns, keep, [&](const FinishedTile& tile) {
    tally.add(field.directions, tile);
    report_progress(progress, "resampling",
                    static_cast<double>(tile.direction + 1) / static_cast<double>(field.directions.size()));
  });
  tally.enter(result);
  if (options.provenance) result.provenance = resampling.provenance({});
  return result;
}

ResampleResult resample_to_file(Resampling& resampling, const std::filesystem::path& path, bool absolute, Team& team,
                                const Progress& progress) {
  ResampleResult result = start_of_result(resampling);
  result.field.absolute = absolute;
  const DirectionSet& set = result.field.directions;
  const auto pack = [&](std::size_t, std::span<const Eigen::Vector4f> tile) {
    return LightFieldWriter::pack(tile.data(), result.field.resolution);
  };
  Tally tally;
  Turns turns(team);  // until all is received: it ends for all ranks together
  if (team.rank() > 0) {
    make_tiles(resampling, turns, pack, [&](const FinishedTile& tile) {
      tally.add(set, tile);
      team.send(to_message(tile));
    });
    tally.enter(result);
    return result;
  }
  LightFieldWriter writer(path, result.field);
  double writing_s = 0;
  std::size_t next = 0;
  std::map<std::size_t, FinishedTile> waiting;  // for those before them, by direction
  const auto append = [&](const FinishedTile& tile) {
    const auto start = Clock::now();
    writer.append(tile.packed);
    writing_s += seconds_since(start);
    tally.add(set, tile);
    ++next;
    report_progress(progress, "resampling", static_cast<double>(next) / static_cast<double>(set.size()));
  };
  const auto keep = [&](FinishedTile tile) {
    waiting.emplace(tile.direction, std::move(tile));
    for (auto first = waiting.begin(); first != waiting.end() && first->first == next; first = waiting.erase(first))
      append(first->second);
  };
  const auto keep_received = [&](Team::Wait wait) {
    while (team.size() > 1 && next < set.size()) {
      const std::optional<std::string> message = team.receive(wait);
      if (!message) return;
      keep(from_message(*message));
    }
  };
  make_tiles(resampling, turns, pack, [&](FinishedTile tile) {
    keep(std::move(tile));
    keep_received(Team::Wait::no);
  });
  keep_received(Team::Wait::yes);
  const auto start = Clock::now();
  writer.finish();
  result.seconds["writing"] = writing_s + seconds_since(start);
  tally.enter(result);
  return result;
}

}  // namespace mf
