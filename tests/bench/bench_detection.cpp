// SPDX-License-Identifier: Apache-2.0
//
// The rig's tag detection on path-traced frames of 1024², one core: time of a frame, and the corners' error against the
// simulator's truth, on linear light and, beside it, on the raw codes. The look-up and filter alone, too, and pose and
// coverage of a frame.
#include <benchmark/benchmark.h>

#include <cmath>

#include "device/coverage.h"
#include "device/guidance.h"
#include "device/online_pose.h"
#include "tests/device/rendered_frames.h"

namespace mf {
namespace {

// A sensor that is logarithmic from a tenth of the paper's light on.
test::RenderedFrames exposed_as(PixelLayout layout) {
  static const test::RenderedViews views = test::rendered_views(1024, 10, 32);
  return exposed(views, {layout, 12, false}, 0.05);
}
const test::RenderedFrames& rendered() {
  static const test::RenderedFrames frames = exposed_as(PixelLayout::bayer_rg);
  return frames;
}
const test::RenderedFrames& rendered_mono() {
  static const test::RenderedFrames frames = exposed_as(PixelLayout::mono);
  return frames;
}

void detect(benchmark::State& state, const test::RenderedFrames& (*frames)(), bool linear, double quad_decimate,
            bool follow) {
  const test::RenderedFrames& r = frames();
  DetectionOptions options;
  options.detector.quad_decimate = quad_decimate;
  if (follow)
    for (const PlanarTag& tag : r.mirror.tags) options.follow.ids.push_back(tag.id);
  FrameDetector detector(options, linear ? r.response : linear_response(12, 64, 1, r.format.colour_channels()),
                         r.format);
  test::CornerErrors errors;
  double milliseconds = 0, most = 0;
  std::size_t i = 0;
  for (auto _ : state) {
    // When it follows, eight frames of each place, as a slow hand gives them.
    const std::size_t frame = (follow ? i / 8 : i) % r.frames.size();
    const DetectedFrame found = detector.detect(r.frames[frame]);
    ++i;
    milliseconds += found.milliseconds;
    most = std::max(most, found.milliseconds);
    state.PauseTiming();
    add_errors(r, frame, found.tags, errors);
    state.ResumeTiming();
  }
  state.counters["cpu_ms"] = milliseconds / static_cast<double>(i);
  state.counters["most_ms"] = most;
  state.counters["rms_px"] = errors.rms_px;
  state.counters["found"] = static_cast<double>(errors.tags) / static_cast<double>(i);
  state.counters["false"] = errors.false_tags;
}
BENCHMARK_CAPTURE(detect, linearized, rendered, true, 2, false)->Unit(benchmark::kMillisecond)->Iterations(80);
BENCHMARK_CAPTURE(detect, raw_codes, rendered, false, 2, false)->Unit(benchmark::kMillisecond)->Iterations(80);
BENCHMARK_CAPTURE(detect, linearized_following, rendered, true, 2, true)->Unit(benchmark::kMillisecond)->Iterations(80);
BENCHMARK_CAPTURE(detect, linearized_full_size, rendered, true, 1, false)
    ->Unit(benchmark::kMillisecond)
    ->Iterations(10);
BENCHMARK_CAPTURE(detect, mono_linearized, rendered_mono, true, 2, false)
    ->Unit(benchmark::kMillisecond)
    ->Iterations(80);
BENCHMARK_CAPTURE(detect, mono_raw_codes, rendered_mono, false, 2, false)
    ->Unit(benchmark::kMillisecond)
    ->Iterations(80);

void levels(benchmark::State& state) {
  const test::RenderedFrames& r = rendered();
  const FrameLevels levels(r.response, r.format);
  for (auto _ : state) benchmark::DoNotOptimize(levels.levels(r.frames[0].codes, {0, 0, 1024, 1024}));
}
BENCHMARK(levels)->Unit(benchmark::kMillisecond);

void luminance(benchmark::State& state) {
  const test::RenderedFrames& r = rendered();
  const FrameLevels levels(r.response, r.format);
  for (auto _ : state) benchmark::DoNotOptimize(levels.luminance(r.frames[0].codes, 4));
}
BENCHMARK(luminance)->Unit(benchmark::kMillisecond);

void pose_coverage_and_advice(benchmark::State& state) {
  const test::RenderedFrames& r = rendered();
  FrameDetector detector({}, r.response, r.format);
  std::vector<DetectedFrame> seen;
  for (const CameraFrame& frame : r.frames) seen.push_back(detector.detect(frame));
  CoverageOptions options;
  options.plane = {{0, 0}, {0.34, 0.34}};
  Coverage coverage(options, MirrorReach(r.camera, r.cam_from_world, r.mirror));
  Guidance guidance;
  std::size_t i = 0;
  for (auto _ : state) {
    const DetectedFrame& frame = seen[i % seen.size()];
    const std::optional<OnlinePose> pose = online_mirror_pose(frame.tags, r.mirror, r.camera);
    if (pose) {
      coverage.add(pose->cam_from_target, frame.luminance, frame.reduction);
      benchmark::DoNotOptimize(guidance.advise(coverage, pose->cam_from_target, static_cast<double>(i) / 12));
    }
    ++i;
  }
}
BENCHMARK(pose_coverage_and_advice)->Unit(benchmark::kMillisecond)->Iterations(200);

}  // namespace
}  // namespace mf

BENCHMARK_MAIN();
