// SPDX-License-Identifier: Apache-2.0
//
// The lumigraph's speed against the number of photos and of speakers; the paper's own renderer beside it, on a hallway
// in the manner of the paper's (it leaves lumigraph_hallway.png in the working directory); and what β, γ and k are
// worth: real photos, each foretold from the others. The photos of `cube` must lie beside the checkout for that.
#include <benchmark/benchmark.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>

#include "common/error.h"
#include "host/gl/backend.h"
#include "host/io/image_file.h"
#include "host/lumigraph/frame_renderer.h"
#include "host/lumigraph/leave_one_out.h"
#include "host/lumigraph/read_photos.h"
#include "tests/bench/vertex_field.h"
#include "tests/host/lumigraph/made_photos.h"

namespace mf {
namespace {

namespace fs = std::filesystem;

constexpr int mesh_steps = 100;  // 20 002 triangles

// Photos in 8 bits of a ball on a floor, from a cap of 60°. Made once for each number and size.
std::shared_ptr<const Lumigraph> lumigraph_of(int photos, int size_px, bool mesh) {
  static std::map<std::array<int, 3>, std::shared_ptr<const Lumigraph>> made;
  auto& found = made[{photos, size_px, mesh ? 1 : 0}];
  if (found) return found;
  made.clear();  // one at a time in memory
  const Proxy walls = MeshProxy(test::bumpy_ball_on_floor(mesh_steps));
  PhotoSet set;
  for (const View& view : test::cap_of_views(photos, 4, 60, test::pinhole(size_px, 45))) {
    PosedPhoto photo = test::photo_of(std::to_string(set.photos.size()), view, walls, test::blotches(0.1F));
    photo.picture = test::codes_of(std::get<ImageF>(photo.picture));
    set.photos.push_back(std::move(photo));
  }
  Proxy proxy = PlaneProxy{Eigen::Vector3f::UnitZ(), 0};
  if (mesh) proxy.emplace<MeshProxy>(test::bumpy_ball_on_floor(mesh_steps));
  auto lumigraph = std::make_shared<const Lumigraph>(set, std::move(proxy));
  made[{photos, size_px, mesh ? 1 : 0}] = lumigraph;
  return lumigraph;
}

// A new view of 512² on a circle through the cap.
View around_the_cap(int i) {
  const double angle = 0.1 * i;
  return {test::pinhole(512, 45), test::looking({1.8 * std::cos(angle), 1.8 * std::sin(angle), 3.2}, {0, 0, -0.1})};
}

// Arguments: photos, their size, k, mesh or plane.
std::shared_ptr<const Lumigraph> lumigraph_of(const benchmark::State& state) {
  return lumigraph_of(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)), state.range(3) != 0);
}
void time_frames(benchmark::State& state, const FrameRenderer& renderer) {
  LumigraphOptions options;
  options.penalty.k = static_cast<int>(state.range(2));
  benchmark::DoNotOptimize(renderer.render(around_the_cap(0), options));  // a driver compiles its shaders
  int i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(renderer.render(around_the_cap(i++), options));
  state.SetLabel(renderer.description());
  state.counters["fps"] = benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}

void frames(benchmark::State& state) {
  const auto lumigraph = lumigraph_of(state);
  time_frames(state, *lumigraph);
}
BENCHMARK(frames)
    ->ArgNames({"photos", "size", "k", "mesh"})
    ->Args({200, 512, 4, 1})
    ->Args({200, 512, 4, 0})
    ->Args({200, 512, 8, 1})
    ->Args({50, 256, 4, 1})
    ->Args({200, 256, 4, 1})
    ->Args({1000, 256, 4, 1})
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime()
    ->Iterations(40);

// The same frames by OpenGL, on whatever there is: its name is the label.
void frames_on_gl(benchmark::State& state) {
  try {
    auto context = open_backend(Backend::gl);
    const auto lumigraph = lumigraph_of(state);
    time_frames(state, FrameRenderer(*lumigraph, std::move(context)));
  } catch (const InputError& missing) {
    state.SkipWithError(missing.what());
  }
}
BENCHMARK(frames_on_gl)
    ->ArgNames({"photos", "size", "k", "mesh"})
    ->Args({200, 512, 4, 1})
    ->Args({200, 512, 4, 0})
    ->Args({50, 256, 4, 1})
    ->Args({1000, 256, 4, 1})
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime()
    ->Iterations(10);

// A corridor 2 m wide and 1.5 m high, photos along it that look ahead, and a new view between them: what is ahead was
// seen finely by the photos further on, what is beside it only by those behind.
struct Hallway {
  static constexpr int size_px = 512;
  Hallway() {
    for (int i = 0; i < 60; ++i) {
      const Eigen::Vector3d from(0.5 * std::sin(1.3 * i), 0.3 * std::cos(2.1 * i), 0.3 * i);
      PosedPhoto photo = test::photo_of(std::to_string(i), {camera, test::looking(from, {0, 0, 60})}, walls, paint, 2);
      photo.picture = test::codes_of(std::get<ImageF>(photo.picture));
      set.photos.push_back(std::move(photo));
    }
    photos = std::get<0>(make_pyramids(set));
    lumigraph = std::make_unique<const Lumigraph>(set, walls_of());
    for (std::size_t i = 0; i < frames; ++i) {
      const double z = 5 + 0.17 * static_cast<double>(i);
      views.push_back({camera, test::looking({0.2, -0.1, z}, {0, 0, 60})});
      truth.emplace_back(test::codes_of(test::true_picture(views.back(), walls, paint, 2)));
    }
    for (const double x : {-1.0, 1.0})
      for (const double y : {-0.75, 0.75}) edges.push_back({{x, y, -1}, {x, y, 30}});
    for (const double a : {-1.0, 1.0}) {
      edges.push_back({{a, -0.75, 30}, {a, 0.75, 30}});
      edges.push_back({{-1, 0.75 * a, 30}, {1, 0.75 * a, 30}});
    }
  }
  static BoxProxy walls_of() {
    BoxProxy box;
    box.low = {-1, -0.75F, -1};
    box.high = {1, 0.75F, 30};
    return box;
  }

  static constexpr std::size_t frames = 8;
  Proxy walls = walls_of();
  test::Paint paint = test::blotches(0.05F);
  CameraModel camera = test::pinhole(size_px, 60);
  PhotoSet set;
  std::vector<PhotoPyramid<std::uint8_t>> photos;
  std::unique_ptr<const Lumigraph> lumigraph;
  std::vector<bench::VertexField::Edge> edges;
  std::vector<View> views;
  std::vector<Picture> truth;
};
const Hallway& hallway() {
  static const Hallway hallway;
  return hallway;
}

// The mean over the frames, all of whose pixels are covered.
double quality(const std::vector<Picture>& pictures) {
  const Hallway& hall = hallway();
  const ImageU8 all(Hallway::size_px, Hallway::size_px, 1, Covered::seen);
  double sum = 0;
  for (std::size_t i = 0; i < Hallway::frames; ++i) sum += psnr_db(pictures[i], hall.truth[i], all);
  return sum / Hallway::frames;
}

template <typename Render>
std::vector<Picture> measure(benchmark::State& state, const Render& render) {
  (void)hallway();
  std::vector<Picture> pictures;
  for (auto _ : state) {
    pictures.clear();
    for (const View& view : hallway().views) pictures.emplace_back(render(view));
  }
  state.counters["dB"] = quality(pictures);
  state.counters["fps"] =
      benchmark::Counter(static_cast<double>(state.iterations()) * Hallway::frames, benchmark::Counter::kIsRate);
  return pictures;
}

LumigraphOptions with_resolution(std::int64_t thousandths) {
  LumigraphOptions options;
  options.penalty.resolution = static_cast<float>(thousandths) / 1000;
  return options;
}

void hallway_by_pixels(benchmark::State& state) {
  const LumigraphOptions options = with_resolution(state.range(0));
  const std::vector<Picture> pictures =
      measure(state, [&](const View& view) { return hallway().lumigraph->render(view, options).picture; });
  // The first frame of both runs beside the truth.
  static std::map<std::int64_t, ImageU8> first;
  first[state.range(0)] = std::get<ImageU8>(pictures.front());
  first[-1] = std::get<ImageU8>(hallway().truth.front());
  if (first.size() < 4) return;
  ImageU8 row(Hallway::size_px * 3, Hallway::size_px, 3);
  int column = 0;
  for (const std::int64_t key : {std::int64_t{0}, std::int64_t{200}, std::int64_t{-1}}) {
    for (int y = 0; y < Hallway::size_px; ++y) {
      const auto from = first[key].row(y);
      std::copy(from.begin(), from.end(), row.row(y).begin() + column * static_cast<std::ptrdiff_t>(from.size()));
    }
    ++column;
  }
  write_png("lumigraph_hallway.png", row);
}
BENCHMARK(hallway_by_pixels)
    ->ArgName("1000beta")
    ->Arg(0)
    ->Arg(100)
    ->Arg(200)
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime()
    ->Iterations(4);

#if MF_HAVE_OPENCV
void hallway_by_vertices(benchmark::State& state) {
  const LumigraphOptions options = with_resolution(state.range(1));
  measure(state, [&](const View& view) {
    const Hallway& hall = hallway();
    return bench::render_by_vertices(
        {hall.lumigraph->sources(), hall.photos, hall.walls, hall.edges, static_cast<int>(state.range(0))}, view,
        options);
  });
}
BENCHMARK(hallway_by_vertices)
    ->ArgNames({"grid_px", "1000beta"})
    ->ArgsProduct({{8, 16, 32}, {100, 200}})
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime()
    ->Iterations(4);
#endif

// One of the options changed, the others at their defaults. Arguments: k, 1000 β, 1000 γ, 1000 border, and silhouette.
void left_out(benchmark::State& state) {
  const fs::path folder = fs::path(MF_SHARED_DATA) / "cube";
  if (!fs::exists(folder)) {
    state.SkipWithError("the cube's photos are absent");
    return;
  }
  static const PhotoSet cube = scaled(read_colmap(folder), 0.5);
  VisibilityOptions visibility;
  visibility.silhouette = static_cast<float>(state.range(4));
  const Lumigraph lumigraph(cube, make_proxy("proxy.obj", cube, folder), visibility);
  LumigraphOptions options;
  options.penalty.k = static_cast<int>(state.range(0));
  options.penalty.resolution = static_cast<float>(state.range(1)) / 1000;
  options.penalty.border = static_cast<float>(state.range(2)) / 1000;
  options.border = static_cast<float>(state.range(3)) / 1000;
  for (auto _ : state) {
    const LeaveOneOut result = leave_one_out(lumigraph, cube, options);
    state.counters["dB"] = result.psnr_db;
    state.counters["nearest_dB"] = result.nearest_view_psnr_db;
    state.counters["SSIM"] = result.ssim;
  }
}
BENCHMARK(left_out)
    ->ArgNames({"k", "1000beta", "1000gamma", "1000border", "silhouette"})
    ->Args({4, 200, 500, 30, 8})
    ->Args({1, 200, 500, 30, 8})
    ->Args({2, 200, 500, 30, 8})
    ->Args({3, 200, 500, 30, 8})
    ->Args({6, 200, 500, 30, 8})
    ->Args({8, 200, 500, 30, 8})
    ->Args({4, 0, 500, 30, 8})
    ->Args({4, 100, 500, 30, 8})
    ->Args({4, 300, 500, 30, 8})
    ->Args({4, 1000, 500, 30, 8})
    ->Args({4, 200, 250, 30, 8})
    ->Args({4, 200, 1000, 30, 8})
    ->Args({4, 200, 2000, 30, 8})
    ->Args({4, 200, 500, 10, 8})
    ->Args({4, 200, 500, 60, 8})
    ->Args({4, 200, 500, 100, 8})
    ->Args({4, 200, 500, 30, 0})
    ->Args({4, 200, 500, 30, 4})
    ->Args({4, 200, 500, 30, 12})
    ->Args({4, 200, 250, 10, 16})
    ->Iterations(1)
    ->Unit(benchmark::kSecond);

}  // namespace
}  // namespace mf

BENCHMARK_MAIN();
