// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/lumigraph.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>
#include <numeric>

#include "common/check.h"
#include "host/blending/vectorized.h"
#include "host/lumigraph/proxy_rays.h"
#include "host/lumigraph/ray_answers.h"
#include "host/lumigraph/tile_renderer.h"

namespace mf {

namespace {

constexpr float least_seen = 0.02F;  // far above what hidden points keep, far below what is looked at squarely

template <typename T>
void store(Image<T>& picture, std::size_t pixel, Float4 colour) {
  for (int c = 0; c < 3; ++c) {
    if constexpr (std::is_integral_v<T>)
      picture.data[3 * pixel + static_cast<std::size_t>(c)] = static_cast<T>(colour[c] + 0.5F);  // of a mean of codes
    else
      picture.data[3 * pixel + static_cast<std::size_t>(c)] = colour[c];
  }
}

// Blends `colour_of(view, x, y, lod)` of the chosen photos into the picture.
template <typename T, typename ColourOf>
inline __attribute__((always_inline)) void blend(const ChosenViews& chosen, Image<T>& picture, ImageU8& covered,
                                                 const ColourOf& colour_of) {
  const std::size_t rays = chosen.pixel.size();
  for (std::size_t i = 0; i < rays; ++i) {
    if (chosen.pixel[i] < 0) continue;
    const auto pixel = static_cast<std::size_t>(chosen.pixel[i]);
    Float4 sum{};
    float sight = 0;
    for (std::size_t row = 0; row < static_cast<std::size_t>(chosen.k); ++row) {
      const float weight = chosen.weight[row * rays + i];
      if (!(weight > 0)) continue;
      const auto candidate = static_cast<std::size_t>(chosen.candidate[row * rays + i]);
      const std::size_t at = candidate * rays + i;
      sum += weight * colour_of(chosen.view[candidate], chosen.x[at], chosen.y[at], chosen.lod[at]);
      sight = std::max(sight, chosen.sight[at]);
    }
    if (!(sight > 0)) continue;
    store(picture, pixel, sum);
    covered.data[pixel] = sight > least_seen ? Covered::seen : Covered::guessed;
  }
}

MF_VECTORIZED void blend_photos(const ChosenViews& chosen, const std::vector<PhotoPyramid<std::uint8_t>>& photos,
                                ImageU8& picture, ImageU8& covered) {
  blend(chosen, picture, covered,
        [&photos](std::uint32_t view, float x, float y, float lod) { return photos[view].sample(x, y, lod); });
}

void blend_photos(const ChosenViews& chosen, const std::vector<PhotoPyramid<float>>& photos, ImageF& picture,
                  ImageU8& covered) {
  blend(chosen, picture, covered,
        [&photos](std::uint32_t view, float x, float y, float lod) { return photos[view].sample(x, y, lod); });
}

void blend_colours(const ChosenViews& chosen, ImageU8& picture, ImageU8& covered) {
  blend(chosen, picture, covered, [](std::uint32_t view, float, float, float) {
    const auto colour = field_colour(view);
    return Float4{static_cast<float>(colour[0]), static_cast<float>(colour[1]), static_cast<float>(colour[2]), 0};
  });
}

ViewTable table_of(const FrameInput& input) {
  ViewTable table;
  for (const std::uint32_t number : input.speaking) table.add(number, input.views[number]);
  return table;
}

void render_tiles(const TileFrame& frame, const TakeChosen& take, TilePool& pool) {
  const int columns = (frame.view.camera.width + tile_side - 1) / tile_side;
  const int rows = (frame.view.camera.height + tile_side - 1) / tile_side;
  tbb::parallel_for(0, columns * rows, [&](int tile) {
    TileRenderer(frame, pool.local(), take).render(tile % columns * tile_side, tile / columns * tile_side);
  });
}

}  // namespace

std::optional<std::string> LumigraphOptions::validate() const {
  if (auto wrong = penalty.validate()) return wrong;
  if (moment)
    if (auto wrong = moment->validate()) return wrong;
  if (!(border >= 0.001F && border <= 0.5F)) return "border: must be between 0.001 and 0.5 of a photo's shorter side";
  return std::nullopt;
}

Lumigraph::Lumigraph(const PhotoSet& set, Proxy proxy, const VisibilityOptions& visibility, const Progress& progress)
    : pyramids_(make_pyramids(set)),
      proxy_(std::move(proxy)),
      visibility_(visibility),
      pool_(std::make_unique<TilePool>()) {
  for (const PosedPhoto& photo : set.photos) {
    sources_.push_back({photo.name, photo.camera, photo.cam_from_world, photo.time_s});
    masks_.push_back(photo.mask);
    cameras_.push_back(answering_camera(photo.camera));
  }
  look_at_proxy(progress);
}

Lumigraph::Lumigraph(Lumigraph&&) noexcept = default;

Lumigraph::~Lumigraph() = default;

void Lumigraph::set_proxy(Proxy proxy, const Progress& progress) {
  std::visit([this]<typename T>(T&& other) { proxy_.emplace<std::remove_cvref_t<T>>(std::forward<T>(other)); },
             std::move(proxy));
  look_at_proxy(progress);
}

void Lumigraph::look_at_proxy(const Progress& progress) {
  sights_.assign(sources_.size(), {});
  std::mutex mutex;
  std::size_t done = 0;
  tbb::parallel_for(std::size_t{0}, sources_.size(), [&](std::size_t i) {
    sights_[i] = make_sight(sources_[i].camera, sources_[i].cam_from_world, masks_[i], proxy_, visibility_);
    const std::lock_guard lock(mutex);
    report_progress(progress, "looking at the proxy",
                    static_cast<double>(++done) / static_cast<double>(sources_.size()));
  });
}

std::vector<AnsweringView> Lumigraph::views_from(const Eigen::Vector3d& eye, const LumigraphOptions& options) const {
  std::vector<AnsweringView> views(sources_.size());
  for (std::size_t i = 0; i < views.size(); ++i) {
    views[i] = answering_view(cameras_[i], sources_[i].cam_from_world, sights_[i], eye, options.border);
    const std::optional<double>& taken = sources_[i].time_s;
    if (const auto& moment = options.moment; moment && taken)
      views[i].time_penalty =
          static_cast<float>(moment->penalty_per_s * time_between(moment->time_s, *taken, moment->period_s));
  }
  return views;
}

WantedResolution Lumigraph::resolution_of(const View& view, std::span<const std::uint32_t> speaking) const {
  float finest = 0;
  for (const std::uint32_t number : speaking) finest = std::max(finest, cameras_[number].fx * cameras_[number].fy);
  const auto focal2 = static_cast<float>(view.camera.fx() * view.camera.fy());
  return {std::min(focal2, finest), 0.5F * std::log2(std::max(focal2 / finest, 1.0F))};
}

FrameInput Lumigraph::frame_input(const View& view, const LumigraphOptions& options,
                                  std::span<const std::uint32_t> views) const {
  check(!options.validate(), "the lumigraph's options are valid");
  FrameInput input;
  input.speaking.assign(views.begin(), views.end());
  if (views.empty()) {
    input.speaking.resize(sources_.size());
    std::iota(input.speaking.begin(), input.speaking.end(), 0U);
  }
  for (const std::uint32_t number : input.speaking)
    check(number < sources_.size(), "a photo that may speak is one of the set");
  input.views = views_from(view.cam_from_world.inverse().translation, options);
  input.wanted = resolution_of(view, input.speaking);
  return input;
}

LumigraphPicture Lumigraph::render(const View& view, const LumigraphOptions& options,
                                   std::span<const std::uint32_t> views) const {
  const FrameInput input = frame_input(view, options, views);
  const ViewTable may_speak = table_of(input);
  const TileFrame frame{view, proxy_, options, visibility_.tolerance, input.views, may_speak, input.wanted};
  const int width = view.camera.width;
  const int height = view.camera.height;
  LumigraphPicture result{ImageU8(), ImageU8(width, height, 1)};
  if (options.shown == Shown::blending_field) {
    ImageU8 picture(width, height, 3);
    render_tiles(
        frame, [&](const ChosenViews& chosen) { blend_colours(chosen, picture, result.covered); }, *pool_);
    result.picture = std::move(picture);
    return result;
  }
  std::visit(
      [&]<typename T>(const std::vector<PhotoPyramid<T>>& photos) {
        Image<T> picture(width, height, 3);
        render_tiles(
            frame, [&](const ChosenViews& chosen) { blend_photos(chosen, photos, picture, result.covered); }, *pool_);
        result.picture = std::move(picture);
      },
      pyramids_);
  return result;
}

std::vector<ViewWeight> Lumigraph::weights_at(const View& view, const Eigen::Vector2d& pixel,
                                              const LumigraphOptions& options,
                                              std::span<const std::uint32_t> views) const {
  const View one = pixel_of_view(view, pixel);
  const FrameInput input = frame_input(view, options, views);
  const ViewTable may_speak = table_of(input);
  std::vector<ViewWeight> weights;
  const TakeChosen take = [&](const ChosenViews& chosen) {
    if (chosen.pixel[0] < 0) return;
    for (std::size_t row = 0; row < static_cast<std::size_t>(chosen.k); ++row)
      if (const std::size_t at = row * chosen.pixel.size(); chosen.weight[at] > 0)
        weights.push_back({chosen.view[static_cast<std::size_t>(chosen.candidate[at])], chosen.weight[at]});
  };
  const TileFrame frame{one, proxy_, options, visibility_.tolerance, input.views, may_speak, input.wanted};
  TileRenderer(frame, pool_->local(), take).render(0, 0);
  return weights;
}

std::optional<Eigen::Vector3d> Lumigraph::point_at(const View& view, const Eigen::Vector2d& pixel) const {
  const auto ray = view.camera.unproject(pixel);
  if (!ray) return std::nullopt;
  const Rigid3 world_from_cam = view.cam_from_world.inverse();
  const Eigen::Vector3d d = world_from_cam.rotation * *ray;
  const std::array<float, 3> direction{static_cast<float>(d.x()), static_cast<float>(d.y()), static_cast<float>(d.z())};
  std::array<float, 4> out{};
  const std::span<const float> in(direction);
  const std::span<float> o(out);
  trace(proxy_, {world_from_cam.translation.cast<float>(), in.subspan(0, 1), in.subspan(1, 1), in.subspan(2, 1),
                 o.subspan(0, 1), o.subspan(1, 1), o.subspan(2, 1), o.subspan(3, 1)});
  if (!std::isfinite(out[0])) return std::nullopt;
  return world_from_cam.translation + static_cast<double>(out[0]) * d;
}

// The principal point moves so that (0.5, 0.5) is the position.
View pixel_of_view(const View& view, const Eigen::Vector2d& pixel) {
  View one = view;
  one.camera.width = one.camera.height = 1;
  one.camera.parameters[2] -= pixel.x() - 0.5;
  one.camera.parameters[3] -= pixel.y() - 0.5;
  return one;
}

std::array<std::uint8_t, 3> field_colour(std::uint32_t view) {
  constexpr double golden = 0.61803398874989485;  // steps of the golden ratio never come close to each other
  const double hue = 6 * (view * golden - std::floor(view * golden));
  const auto channel = [&](double peak) {
    const double distance = std::min(std::abs(hue - peak), 6 - std::abs(hue - peak));
    return static_cast<std::uint8_t>(std::lround(255 * std::clamp(2 - distance, 0.1, 1.0)));
  };
  return {channel(0), channel(2), channel(4)};
}

}  // namespace mf
