// SPDX-License-Identifier: Apache-2.0
// Response curve and demosaicing: our figures beside OpenCV's, from the same input in the same run.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <random>

#include "common/demosaic.h"
#include "common/json_file.h"
#include "common/response_curve.h"
#include "host/photometry/response_estimate.h"
#if MF_HAVE_OPENCV
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/photo.hpp>
#endif

namespace mf {
namespace {

constexpr int side = 768;

Frame noise_frame() {
  std::mt19937 random(1);
  Frame frame;
  frame.info.exposure_s = 0.01;
  ImageU16 codes(side, side, 1);
  for (std::uint16_t& code : codes.data) code = static_cast<std::uint16_t>(random() % 4096);
  frame.pixels = std::move(codes);
  return frame;
}

void linearize_frame(benchmark::State& state) {
  const Frame frame = noise_frame();
  const ResponseCurve curve = linlog_response(12, 64, 0.001, 1, 3);
  for (auto _ : state) benchmark::DoNotOptimize(linearize(frame, *parse_pixel_format("BayerRG12"), curve));
}
BENCHMARK(linearize_frame)->Unit(benchmark::kMillisecond);

void demosaic_frame(benchmark::State& state) {
  const ImageF mosaic = linearize(noise_frame(), *parse_pixel_format("BayerRG12"), linear_response(12, 64, 1, 3));
  for (auto _ : state) benchmark::DoNotOptimize(demosaic(mosaic, PixelLayout::bayer_rg));
}
BENCHMARK(demosaic_frame)->Unit(benchmark::kMillisecond);

#if MF_HAVE_OPENCV

void opencv_bilinear_demosaic_frame(benchmark::State& state) {
  const Frame frame = noise_frame();
  cv::Mat raw(side, side, CV_16U), rgb;
  const ImageU16& codes = std::get<ImageU16>(frame.pixels);
  std::copy(codes.data.begin(), codes.data.end(), raw.ptr<std::uint16_t>());
  for (auto _ : state) cv::cvtColor(raw, rgb, cv::COLOR_BayerBG2RGB);
}
BENCHMARK(opencv_bilinear_demosaic_frame)->Unit(benchmark::kMillisecond);

// Debevec & Malik's Memorial Church, 16 exposures of 8 bits, cut to where every picture is valid.
struct Memorial {
  std::vector<cv::Mat> pictures;  // BGR
  std::vector<float> times;
  cv::Mat reference;  // their radiance map, BGR
  ExposureSweep sweep;
};

Memorial read_memorial(const std::filesystem::path& folder) {
  const cv::Rect valid(30, 40, 462, 688);
  Memorial out;
  out.sweep.source = folder.string();
  out.sweep.format = *parse_pixel_format("RGB8");
  for (const nlohmann::json& entry : read_json_file(folder / "exposures.json")) {
    const auto name = entry.at("frame").get<std::string>();
    out.times.push_back(entry.at("exposure_s").get<float>());
    out.pictures.push_back(cv::imread((folder / name).string())(valid).clone());
    Frame frame;
    frame.info.name = name;
    frame.info.exposure_s = out.times.back();
    const cv::Mat& picture = out.pictures.back();
    ImageU16 codes(picture.cols, picture.rows, 3);
    for (int y = 0; y < picture.rows; ++y)
      for (int x = 0; x < picture.cols; ++x)
        for (int c = 0; c < 3; ++c) codes.at(x, y, c) = picture.at<cv::Vec3b>(y, x)[2 - c];
    frame.pixels = std::move(codes);
    out.sweep.frames.push_back(std::move(frame));
  }
  out.reference = cv::imread((folder / "reference/memorial_headerfixed.hdr").string(), cv::IMREAD_UNCHANGED)(valid);
  return out;
}

// Robust standard deviation (1.4826 × MAD) of log2(merged / reference), by OpenCV's merging for both responses.
double spread_stops(const Memorial& memorial, const cv::Mat& response, int bgr_channel) {
  cv::Mat merged;
  cv::createMergeRobertson()->process(memorial.pictures, merged, memorial.times, response);
  std::vector<double> log_ratio;
  for (int y = 0; y < merged.rows; ++y)
    for (int x = 0; x < merged.cols; ++x) {
      const float a = merged.at<cv::Vec3f>(y, x)[bgr_channel], b = memorial.reference.at<cv::Vec3f>(y, x)[bgr_channel];
      if (a > 0 && b > 0) log_ratio.push_back(std::log2(a / b));
    }
  const auto median = [](std::vector<double>& v) {
    std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
    return v[v.size() / 2];
  };
  const double centre = median(log_ratio);
  for (double& v : log_ratio) v = std::abs(v - centre);
  return 1.4826 * median(log_ratio);
}

cv::Mat as_opencv(const ResponseCurve& curve) {
  cv::Mat response(256, 1, CV_32FC3);
  for (int m = 0; m < 256; ++m)
    for (int c = 0; c < 3; ++c)
      response.at<cv::Vec3f>(m, 0)[2 - c] =
          static_cast<float>(curve.channels[static_cast<std::size_t>(c)].exposure[static_cast<std::size_t>(m)]);
  return response;
}

void compare_on_memorial() {
  const std::filesystem::path folder = std::filesystem::path(MF_SHARED_DATA) / "memorial";
  if (!std::filesystem::exists(folder)) {
    std::printf("memorial: skipped, the pictures are not beside the checkout\n");
    return;
  }
  const Memorial memorial = read_memorial(folder);
  using Clock = std::chrono::steady_clock;
  const auto seconds = [](Clock::duration d) { return std::chrono::duration<double>(d).count(); };
  const auto start = Clock::now();
  const cv::Mat ours = as_opencv(estimate_response(memorial.sweep, {}).curve);
  const auto middle = Clock::now();
  cv::Mat theirs;
  cv::createCalibrateRobertson()->process(memorial.pictures, theirs, memorial.times);
  const auto end = Clock::now();
  std::printf("memorial, spread of log2 ratio to the published radiance map (stops):\n");
  for (int c = 0; c < 3; ++c) {
    const double a = spread_stops(memorial, ours, 2 - c), b = spread_stops(memorial, theirs, 2 - c);
    std::printf("  %s  ours %.3f  OpenCV Robertson %.3f  ratio %.2f\n", c == 0 ? "R" : c == 1 ? "G" : "B", a, b, a / b);
  }
  std::printf("  seconds  ours %.1f  OpenCV Robertson %.1f  ratio %.2f\n", seconds(middle - start),
              seconds(end - middle), seconds(middle - start) / seconds(end - middle));
}

#endif

}  // namespace
}  // namespace mf

int main(int argc, char** argv) {
#if MF_HAVE_OPENCV
  mf::compare_on_memorial();
#else
  std::printf("memorial: skipped, OpenCV's photo and imgcodecs modules are not installed\n");
#endif
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
