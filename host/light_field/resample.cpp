// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/resample.h"

#include <fmt/format.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <mutex>
#include <nlohmann/json.hpp>

#include "common/check.h"
#include "host/blending/view_weights.h"
#include "host/light_field/view_rays.h"

namespace mf {

namespace {

constexpr int grid_step = 8;            // texels between the points at which all views are ranked
constexpr std::size_t spare_views = 4;  // ranked beyond k, so that the k best of any texel are among its corners' lists
constexpr int cell_splits = 1;          // a cell is fetched in 6 · 2¹ parts
constexpr float smallest_weight = 0.02F;  // a view that shows less than this of the cell does not speak for it

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// What one direction's tile needs again and again.
struct TileDirection {
  Eigen::Vector3f in_world;
  std::vector<CellSample> parts;  // directions in the world
  float cell_angle_rad = 0;       // side of a square of the cell's solid angle
  float part_angle_rad = 0;
};

// One thread's working memory.
struct Scratch {
  std::vector<ViewPenalty> ranked;
  std::vector<std::vector<std::uint32_t>> best_at_vertex;
  std::vector<std::uint32_t> candidates;
  std::vector<std::uint32_t> mark;  // per view: the block that listed it last
  std::vector<ViewWeight> weights;
  std::uint32_t block = 0;
};

class Resampler {
 public:
  Resampler(const std::vector<FieldView>& views, const LightField& field, int k)
      : views_(views),
        field_(field),
        k_(k),
        centre_in_world_(
            (field.plane.world_from_plane * Eigen::Vector3d(field.plane.min_m.x() + 0.5 * field.plane.size_m().x(),
                                                            field.plane.min_m.y() + 0.5 * field.plane.size_m().y(), 0))
                .cast<float>()) {}

  void fill_tile(std::size_t direction, Eigen::Vector4f* tile, Scratch& scratch) const {
    const TileDirection d = prepare(direction);
    rank_at_vertices(d, scratch);
    const int n = field_.resolution, blocks = (n + grid_step - 1) / grid_step;
    for (int by = 0; by < blocks; ++by)
      for (int bx = 0; bx < blocks; ++bx) {
        gather_candidates(bx, by, blocks + 1, scratch);
        for (int y = by * grid_step; y < std::min(n, (by + 1) * grid_step); ++y)
          for (int x = bx * grid_step; x < std::min(n, (bx + 1) * grid_step); ++x)
            tile[y * n + x] = blend(d, point(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F), scratch);
      }
  }

 private:
  [[nodiscard]] bool plane_proxy() const { return field_.proxy.radius_m == 0; }

  [[nodiscard]] TileDirection prepare(std::size_t i) const {
    const Eigen::Matrix3f world_from_plane = field_.plane.world_from_plane.rotation.toRotationMatrix().cast<float>();
    TileDirection d;
    d.in_world = world_from_plane * field_.directions.directions[i];
    d.parts = split_cell(field_.directions, i, cell_splits);
    for (CellSample& part : d.parts) part.direction = world_from_plane * part.direction;
    d.cell_angle_rad = std::sqrt(field_.directions.solid_angles_sr[i]);
    d.part_angle_rad = std::sqrt(field_.directions.solid_angles_sr[i] / static_cast<float>(d.parts.size()));
    return d;
  }

  // World point of a texel position (texel centres at +0.5; row 0 at max y).
  [[nodiscard]] Eigen::Vector3f point(float x, float y) const {
    const double n = field_.resolution;
    const Eigen::Vector2d size = field_.plane.size_m();
    const Eigen::Vector3d p(field_.plane.min_m.x() + static_cast<double>(x) / n * size.x(),
                            field_.plane.max_m.y() - static_cast<double>(y) / n * size.y(), 0);
    return (field_.plane.world_from_plane * p).cast<float>();
  }

  [[nodiscard]] ProxyPoint focus(const Eigen::Vector3f& p, const Eigen::Vector3f& direction) const {
    if (plane_proxy()) return p.homogeneous();
    return proxy_point(p, direction, inverse_distance_to_sphere(p, direction, centre_in_world_, field_.proxy.radius_m));
  }

  // Plane as proxy: the angle between the wanted and the captured ray. Else: how far the captured ray passes by.
  [[nodiscard]] float penalty(const FieldView& view, const TileDirection& d, const Eigen::Vector3f& p,
                              const ProxyPoint& x) const {
    if (!plane_proxy()) return ray_distance(p, x, view.centre_in_world);
    const Eigen::Vector3f ray = ray_to(x, view.centre_in_world);
    return std::atan2(ray.cross(d.in_world).norm(), ray.dot(d.in_world));
  }

  // The penalty over the field-of-view weight: it grows without bound towards the view's border.
  [[nodiscard]] std::optional<float> total_penalty(std::uint32_t index, const TileDirection& d,
                                                   const Eigen::Vector3f& p, const ProxyPoint& x) const {
    const FieldView& view = views_[index];
    const Eigen::Vector3f pixel = pixel_of(view, x);
    if (pixel.z() <= 0) return std::nullopt;
    const int level = plane_proxy() ? 0 : level_for_angle(view, x, d.cell_angle_rad);
    const float weight = view.fetch(level, pixel.x() / pixel.z(), pixel.y() / pixel.z()).w();
    if (weight < smallest_weight) return std::nullopt;
    return penalty(view, d, p, x) / weight;
  }

  void rank_at_vertices(const TileDirection& d, Scratch& s) const {
    const int n = field_.resolution, vertices = (n + grid_step - 1) / grid_step + 1;
    s.best_at_vertex.resize(static_cast<std::size_t>(vertices * vertices));
    const std::size_t keep = static_cast<std::size_t>(k_) + spare_views;
    for (int vy = 0; vy < vertices; ++vy)
      for (int vx = 0; vx < vertices; ++vx) {
        const Eigen::Vector3f p =
            point(static_cast<float>(std::min(vx * grid_step, n)), static_cast<float>(std::min(vy * grid_step, n)));
        const ProxyPoint x = focus(p, d.in_world);
        s.ranked.clear();
        for (std::uint32_t v = 0; v < views_.size(); ++v)
          if (const auto value = total_penalty(v, d, p, x)) s.ranked.push_back({v, *value});
        const std::size_t kept = std::min(keep, s.ranked.size());
        std::partial_sort(s.ranked.begin(), s.ranked.begin() + static_cast<std::ptrdiff_t>(kept), s.ranked.end(),
                          [](const ViewPenalty& a, const ViewPenalty& b) { return a.penalty < b.penalty; });
        auto& best = s.best_at_vertex[static_cast<std::size_t>(vy * vertices + vx)];
        best.clear();
        for (std::size_t i = 0; i < kept; ++i) best.push_back(s.ranked[i].view);
      }
  }

  // The views that any corner of a block ranked among its best, each once.
  static void gather_candidates(int bx, int by, int vertices, Scratch& s) {
    ++s.block;
    s.candidates.clear();
    for (const int corner :
         {by * vertices + bx, by * vertices + bx + 1, (by + 1) * vertices + bx, (by + 1) * vertices + bx + 1})
      for (const std::uint32_t v : s.best_at_vertex[static_cast<std::size_t>(corner)]) {
        if (s.mark[v] == s.block) continue;
        s.mark[v] = s.block;
        s.candidates.push_back(v);
      }
  }

  // Mean over the cell of what one view saw of it: premultiplied colour and weight.
  [[nodiscard]] Eigen::Vector4f fetch_cell(const FieldView& view, const TileDirection& d, const Eigen::Vector3f& p,
                                           const ProxyPoint& x) const {
    if (plane_proxy()) {
      const Eigen::Vector3f pixel = pixel_of(view, x);
      const float texel_m =
          static_cast<float>(field_.plane.size_m().maxCoeff()) / static_cast<float>(field_.resolution);
      return view.fetch(level_for_angle(view, x, texel_m), pixel.x() / pixel.z(), pixel.y() / pixel.z());
    }
    const int level = level_for_angle(view, x, d.part_angle_rad);
    const Eigen::Vector3f base = x.w() * (view.pixel_from_world.leftCols<3>() * p + view.pixel_from_world.col(3));
    Eigen::Vector4f sum = Eigen::Vector4f::Zero();
    float solid_angle = 0;
    for (const CellSample& part : d.parts) {
      const Eigen::Vector3f pixel = base + view.pixel_from_world.leftCols<3>() * part.direction;
      solid_angle += part.solid_angle_sr;
      if (pixel.z() > 0) sum += part.solid_angle_sr * view.fetch(level, pixel.x() / pixel.z(), pixel.y() / pixel.z());
    }
    return sum / solid_angle;
  }

  [[nodiscard]] Eigen::Vector4f blend(const TileDirection& d, const Eigen::Vector3f& p, Scratch& s) const {
    const ProxyPoint x = focus(p, d.in_world);
    s.ranked.clear();
    for (const std::uint32_t v : s.candidates)
      if (const auto value = total_penalty(v, d, p, x)) s.ranked.push_back({v, *value});
    // Rays closer than a tenth of a millimetre (or of a milliradian) are the same ray.
    const std::size_t speaking = blend_weights(s.ranked, k_, 1e-4F, s.weights);
    Eigen::Vector3f colour = Eigen::Vector3f::Zero();
    float weight_sum = 0, confidence = 0;
    for (std::size_t i = 0; i < speaking; ++i) {
      const Eigen::Vector4f seen = fetch_cell(views_[s.weights[i].view], d, p, x);
      if (seen.w() < 1e-3F) continue;
      colour += s.weights[i].weight / seen.w() * seen.head<3>();
      weight_sum += s.weights[i].weight;
      confidence += seen.w();
    }
    if (weight_sum <= 0) return Eigen::Vector4f::Zero();
    Eigen::Vector4f texel;
    texel << colour / weight_sum, std::min(1.0F, confidence);
    return texel;
  }

  const std::vector<FieldView>& views_;
  const LightField& field_;
  int k_;
  Eigen::Vector3f centre_in_world_;
};

std::string options_to_json(const ResampleOptions& o, int k, const FieldProxy& proxy) {
  nlohmann::json json{
      {"height", o.height_m}, {"directions", o.directions}, {"size", o.size}, {"proxy", proxy_name(proxy)}, {"k", k}};
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

}  // namespace

std::optional<std::string> ResampleOptions::validate() const {
  if (!std::isfinite(height_m)) return "height: must be a number of metres";
  if (directions < 11 || directions > 500000) return "directions: must be between 11 and 500000";
  if (size < 2 || size > 1024) return "size: must be between 2 and 1024 texels";
  if (k < 0 || k > 64) return "k: must be between 1 and 64 views (0 chooses)";
  if (proxy != "auto" && !parse_proxy(proxy)) return "proxy: must be auto, plane, sphere:R (metres) or sphere:inf";
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

  auto start = Clock::now();
  if (options.proxy == "auto") {
    result.proxy_scores = score_proxies(views, rectangle, k);
    field.proxy =
        std::min_element(result.proxy_scores.begin(), result.proxy_scores.end(),
                         [](const ProxyScore& a, const ProxyScore& b) { return a.inconsistency < b.inconsistency; })
            ->proxy;
  } else {
    field.proxy = *parse_proxy(options.proxy);
  }
  result.seconds["proxy"] = seconds_since(start);
  field.options_json = options_to_json(options, k, field.proxy);

  start = Clock::now();
  field.rgbc.assign(field.directions.size() * field.texel_count(), Eigen::Vector4f::Zero());
  const Resampler resampler(views, field, k);
  tbb::enumerable_thread_specific<Scratch> scratch([&] {
    Scratch s;
    s.mark.assign(views.size(), 0);
    s.weights.resize(static_cast<std::size_t>(k));
    return s;
  });
  std::mutex reporting;
  std::size_t done = 0;
  tbb::parallel_for(std::size_t{0}, field.directions.size(), [&](std::size_t i) {
    resampler.fill_tile(i, field.tile(i), scratch.local());
    const std::lock_guard lock(reporting);
    report_progress(progress, "resampling", static_cast<double>(++done) / static_cast<double>(field.directions.size()));
  });
  result.seconds["blending"] = seconds_since(start);
  result.mean_confidence = mean_confidence(field);
  return result;
}

}  // namespace mf
