// SPDX-License-Identifier: Apache-2.0
//
// Calibration against OpenCV's, on the same corners in the same run, and what each way of feeding AprilTag is worth on
// the desk capture (when it lies beside the checkout). `ratio` is the baseline's time over ours, or its error over
// ours.
#include <benchmark/benchmark.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/json_file.h"
#include "common/response_curve.h"
#include "common/seconds_since.h"
#include "host/calibration/calibrate.h"
#include "host/calibration/tag_search.h"
#include "host/io/image_file.h"
#include "tests/host/calibration/synthetic_views.h"

#if MF_HAVE_OPENCV
#include <opencv2/calib3d.hpp>
#endif

namespace mf {
namespace {

testing::SyntheticCapture capture_of(int views) {
  return testing::synthetic_capture(testing::ordinary_camera(), views, 0.1, 1);
}

CalibrationOptions brown() {
  CalibrationOptions options;
  options.distortion = DistortionChoice::brown;
  return options;
}

void calibrate_views(benchmark::State& state) {
  const testing::SyntheticCapture capture = capture_of(static_cast<int>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(calibrate(capture.input, brown(), {}));
  state.counters["views/s"] =
      benchmark::Counter(static_cast<double>(state.range(0)), benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(calibrate_views)->Arg(50)->Arg(420)->Arg(2200)->Unit(benchmark::kMillisecond)->Iterations(1);

#if MF_HAVE_OPENCV
void against_opencv(benchmark::State& state) {
  const testing::SyntheticCapture capture = capture_of(static_cast<int>(state.range(0)));
  std::vector<std::vector<cv::Point3f>> objects;
  std::vector<std::vector<cv::Point2f>> pixels;
  for (const TargetView& view : capture.input.mirror) {
    objects.emplace_back();
    pixels.emplace_back();
    for (const TagSighting& tag : view.tags)
      for (std::size_t k = 0; k < 4; ++k) {
        const Eigen::Vector3f x = tag.corners_in_target[k].cast<float>();
        objects.back().emplace_back(x.x(), x.y(), x.z());
        const Eigen::Vector2f p = (tag.corners_px[k].array() - 0.5).cast<float>();
        pixels.back().emplace_back(p.x(), p.y());
      }
  }
  double ours = 0, theirs = 0, our_error = 0, their_error = 0;
  for (auto _ : state) {
    auto start = std::chrono::steady_clock::now();
    const Calibration c = calibrate(capture.input, brown(), {}).calibration;
    ours = seconds_since(start);
    start = std::chrono::steady_clock::now();
    cv::Mat k, distortion;
    std::vector<cv::Mat> rotations, translations;
    cv::calibrateCamera(objects, pixels, {capture.camera.width, capture.camera.height}, k, distortion, rotations,
                        translations, cv::CALIB_FIX_K3);
    theirs = seconds_since(start);
    our_error = std::abs(c.camera.fx() / capture.camera.fx() - 1);
    their_error = std::abs(k.at<double>(0, 0) / capture.camera.fx() - 1);
  }
  state.counters["ours_s"] = ours;
  state.counters["opencv_s"] = theirs;
  state.counters["ratio"] = theirs / ours;
  state.counters["ours_f_ppm"] = 1e6 * our_error;
  state.counters["opencv_f_ppm"] = 1e6 * their_error;
}
BENCHMARK(against_opencv)->Arg(25)->Arg(50)->Arg(100)->Unit(benchmark::kMillisecond)->Iterations(1);
#endif

// ---- what is fed to the detector, on desk frames -------------------------------------------------------------------

enum class Feed { codes, linear, refined };

struct DeskFrames {
  std::vector<ImageF> codes, linear;
  std::vector<Rigid3> cam_from_mirror;
  CameraModel camera;
  MirrorTarget target;
};

// Every tenth frame. Linearized as code − black: the tags lie in the linear part of the LinLog response.
const DeskFrames& desk_frames() {
  static const DeskFrames frames = [] {
    DeskFrames out;
    const std::filesystem::path desk = std::filesystem::path(MF_SHARED_DATA) / "desk";
    if (!std::filesystem::exists(desk)) return out;
    const nlohmann::json truth = read_json_file(desk / "truth" / "calibration.json");
    const Rigid3 cam_from_world = rigid3_from_json(truth.at("cam_from_world"), "cam_from_world", "truth");
    out.target = mirror_target_from_json(read_json_file(desk / "target.json"), "target.json");
    out.camera.parameters = {truth.at("K").at(0).at(0),
                             truth.at("K").at(1).at(1),
                             truth.at("K").at(0).at(2),
                             truth.at("K").at(1).at(2),
                             0,
                             0,
                             0,
                             0,
                             0};
    const double black = read_json_file(desk / "camera.json").at("black_level_hint");
    const nlohmann::json names = read_json_file(desk / "frames.json");
    for (std::size_t i = 0; i < names.size(); i += 10) {
      const auto frame = std::get<ImageU16>(read_image(desk / "frames" / names[i].at("frame").get<std::string>()));
      ImageF codes(frame.width, frame.height, 1), linear = codes;
      for (std::size_t k = 0; k < frame.data.size(); ++k) {
        codes.data[k] = frame.data[k];
        linear.data[k] = std::max(0.F, static_cast<float>(frame.data[k] - black));
      }
      out.codes.push_back(codes);
      out.linear.push_back(linear);
      out.cam_from_mirror.push_back(
          cam_from_world * rigid3_from_json(truth.at("world_from_mirror").at(i), "world_from_mirror", "truth"));
    }
    return out;
  }();
  return frames;
}

void desk_corners(benchmark::State& state) {
  const DeskFrames& desk = desk_frames();
  if (desk.linear.empty()) {
    state.SkipWithError("the desk capture is absent");
    return;
  }
  const auto feed = static_cast<Feed>(state.range(0));
  TagDetector detector({});
  TagSearch search(searched_target(desk.target), {});
  double squares = 0;
  int corners = 0, tags = 0;
  const auto measure = [&](std::size_t frame, int id, const TagCorners& corners_px) {
    const PlanarTag* tag = desk.target.find(id);
    if (tag == nullptr) return;
    ++tags;
    for (std::size_t k = 0; k < 4; ++k) {
      const Eigen::Vector2d at = tag->corners_m()[k];
      const Eigen::Vector2d truth =
          desk.camera.project(desk.cam_from_mirror[frame] * Eigen::Vector3d(at.x(), at.y(), 0));
      const double squared = (corners_px[k] - truth).squaredNorm();
      if (squared < 9) squares += squared, ++corners;
    }
  };
  for (auto _ : state) {
    squares = corners = tags = 0;
    for (std::size_t i = 0; i < desk.linear.size(); ++i) {
      if (feed == Feed::refined)
        for (const TagSighting& tag : search.find(desk.linear[i], PixelLayout::bayer_rg))
          measure(i, tag.id, tag.corners_px);
      else
        for (const TagDetection& tag :
             detector.detect(feed == Feed::codes ? desk.codes[i] : smooth_mosaic(desk.linear[i])))
          measure(i, tag.id, tag.corners_px);
    }
  }
  state.counters["tags/frame"] = static_cast<double>(tags) / static_cast<double>(desk.linear.size());
  state.counters["corner_rms_px"] = std::sqrt(squares / corners);
  state.counters["ms/frame"] = benchmark::Counter(static_cast<double>(desk.linear.size()) / 1e3,
                                                  benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
BENCHMARK(desk_corners)
    ->ArgName("feed(0 codes, 1 linear, 2 aligned)")
    ->DenseRange(0, 2)
    ->Unit(benchmark::kMillisecond)
    ->Iterations(1);

}  // namespace
}  // namespace mf

BENCHMARK_MAIN();
