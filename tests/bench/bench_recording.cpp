// SPDX-License-Identifier: Apache-2.0
// What a recorded frame costs a core: 1024 × 1024 codes of 12 bits with sensor noise, as a TIFF file's bytes. Baseline:
// libtiff's own deflate (libdeflate) at its fastest level with the same predictor. Ratios are of medians in one run.
#include <benchmark/benchmark.h>
#include <tiffio.h>

#include <cmath>
#include <filesystem>
#include <random>

#include "common/file_bytes.h"
#include "common/tiff_image.h"

namespace {

constexpr int size = 1024;

// A smooth scene of a thousand codes with the shot noise of 10000 electrons in a full pixel.
mf::ImageU16 noisy_frame() {
  mf::ImageU16 image(size, size, 1);
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x) {
      const double code = 200 + 900 * (0.5 + 0.5 * std::sin(0.01 * x) * std::cos(0.013 * y));
      const double sigma = std::hypot(1.0, std::sqrt(code * 4095 / 10000.0));
      image.at(x, y) = static_cast<std::uint16_t>(std::clamp(code + sigma * normal(random), 0.0, 4095.0));
    }
  return image;
}

const mf::ImageU16& frame() {
  static const mf::ImageU16 image = noisy_frame();
  return image;
}

void report(benchmark::State& state, std::size_t bytes) {
  state.counters["ratio"] = 2.0 * size * size / static_cast<double>(bytes);
}

void ours(benchmark::State& state) {
  std::string bytes;
  for (auto _ : state) bytes = mf::encode_tiff(frame(), mf::TiffCompression::deflate);
  report(state, bytes.size());
}

void uncompressed(benchmark::State& state) {
  std::string bytes;
  for (auto _ : state) bytes = mf::encode_tiff(frame(), mf::TiffCompression::none);
  report(state, bytes.size());
}

void libtiff(benchmark::State& state) {
  const std::string file = "/dev/shm/mirrorfield_bench.tif";
  for (auto _ : state) {
    TIFF* tiff = TIFFOpen(file.c_str(), "w");
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, size);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, size);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 16);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 1);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE);
    TIFFSetField(tiff, TIFFTAG_PREDICTOR, PREDICTOR_HORIZONTAL);
    TIFFSetField(tiff, TIFFTAG_ZIPQUALITY, 1);
    TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, 128);
    for (int strip = 0; strip < size / 128; ++strip)
      TIFFWriteEncodedStrip(tiff, static_cast<std::uint32_t>(strip),
                            const_cast<std::uint16_t*>(frame().row(128 * strip).data()), 128 * 2 * size);
    TIFFClose(tiff);
  }
  report(state, std::filesystem::file_size(file));
  std::filesystem::remove(file);
}

void checksum(benchmark::State& state) {
  const std::string bytes = mf::encode_tiff(frame(), mf::TiffCompression::deflate);
  for (auto _ : state) benchmark::DoNotOptimize(mf::crc32(bytes));
}

BENCHMARK(libtiff)->Unit(benchmark::kMillisecond)->Repetitions(5)->ReportAggregatesOnly();
BENCHMARK(ours)->Unit(benchmark::kMillisecond)->Repetitions(5)->ReportAggregatesOnly();
BENCHMARK(uncompressed)->Unit(benchmark::kMillisecond)->Repetitions(5)->ReportAggregatesOnly();
BENCHMARK(checksum)->Unit(benchmark::kMillisecond)->Repetitions(5)->ReportAggregatesOnly();

}  // namespace

BENCHMARK_MAIN();
