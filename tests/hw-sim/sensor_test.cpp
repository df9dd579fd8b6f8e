// SPDX-License-Identifier: Apache-2.0
#include "hw-sim/sensor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>

#include "hw-sim/reacting_camera.h"
#include "hw-sim/wire_packing.h"

namespace mf::sim {
namespace {

struct Moments {
  double mean = 0, sigma = 0;
};
Moments moments_of(std::span<const std::uint16_t> codes) {
  Moments m;
  for (const std::uint16_t code : codes) m.mean += code;
  m.mean /= static_cast<double>(codes.size());
  for (const std::uint16_t code : codes) m.sigma += (code - m.mean) * (code - m.mean);
  m.sigma = std::sqrt(m.sigma / static_cast<double>(codes.size()));
  return m;
}

SensorTraits traits_of(PixelLayout layout, int bits) {
  SensorTraits traits;
  traits.format = {layout, bits, false};
  traits.black_level = bits == 8 ? 4 : 64;
  return traits;
}

const MultiSlopeSensor two_knees{{{0.9, 0.5}, {0.99, 0.75}}};
const LinLogSensor linlog{0.5, 0.5, 1, 1};

TEST(FastSensor, FollowsTheForwardModelAndItsNoise) {
  const SensorTraits traits = traits_of(PixelLayout::mono, 12);
  for (const SensorResponse& response :
       {SensorResponse{LinearSensor{}}, SensorResponse{two_knees}, SensorResponse{linlog}}) {
    const FastSensor sensor(traits, response, 0);
    for (const double light : {0.003, 0.1, 0.45, 0.8, 3.0, 20.0}) {
      const ImageF flat(128, 128, 1, 100.0F);
      std::vector<std::uint16_t> codes(flat.data.size());
      sensor.expose(flat, light * traits.full_exposure / 100, 5, codes);
      const Moments m = moments_of(codes);
      const double code = 64 + 4031 * charge_of(response, light);
      EXPECT_NEAR(m.mean, code, 0.5) << light;
      const double slope = (charge_of(response, light * 1.01) - charge_of(response, light)) / (0.01 * light) * 4031;
      const double sigma = std::sqrt(slope * slope * light / 1e4 + 1 + 1.0 / 12);
      if (code < 4000) {
        EXPECT_NEAR(m.sigma / sigma, 1, 0.06) << light;
      } else {
        EXPECT_LT(m.sigma, sigma + 0.5) << light;
      }
    }
  }
}

TEST(FastSensor, AgreesWithTheExactSensor) {
  const SensorTraits traits = traits_of(PixelLayout::bayer_gb, 12);
  Sensor exact;
  exact.format = traits.format;
  exact.response = sensor_response(two_knees, 12, 64, traits.full_exposure, 3);
  exact.electrons_per_exposure = traits.full_electrons / traits.full_exposure;
  exact.response.vignetting = {{64, 64}, 90, {-0.3, 0.05, 0}};
  SensorTraits dimmed = traits;
  dimmed.vignetting = exact.response.vignetting;
  ImageF radiance(128, 128, 3);
  for (int y = 0; y < 128; ++y)
    for (int x = 0; x < 128; ++x)
      for (int c = 0; c < 3; ++c)
        radiance.at(x, y, c) = std::exp2(static_cast<float>(x) / 16 - 4) * static_cast<float>(1 + c);
  const FastSensor fast(dimmed, two_knees, 0);
  std::vector<std::uint16_t> codes(128U * 128U);
  fast.expose(sensor_mosaic(radiance, dimmed), 0.01, 3, codes);
  const ImageU16 expected = exact.expose(radiance, 0.01, {0, 0, 128, 128}, 9);
  double difference = 0, most = 0;
  for (std::size_t i = 0; i < codes.size(); ++i) {
    const double d = std::abs(codes[i] - static_cast<double>(expected.data[i]));
    difference += d / static_cast<double>(codes.size());
    most = std::max(most, d);
  }
  EXPECT_LT(difference, 20);  // two noises
  EXPECT_LT(most, 250);
}

TEST(FastSensor, TakesEveryDepthAndGain) {
  for (const int bits : {8, 10, 12, 16}) {
    SensorTraits traits = traits_of(PixelLayout::mono, bits);
    const FastSensor sensor(traits, LinearSensor{}, 6.0206);
    const ImageF flat(64, 64, 1, 1.0F);
    std::vector<std::uint16_t> codes(flat.data.size());
    sensor.expose(flat, 0.25 * traits.full_exposure, 1, codes);
    EXPECT_NEAR(moments_of(codes).mean, traits.black_level + 0.5 * (std::exp2(bits) - 1 - traits.black_level),
                0.001 * std::exp2(bits));
  }
}

TEST(FastSensor, OneFramesNoiseIsNotTheNexts) {
  const SensorTraits traits = traits_of(PixelLayout::mono, 12);
  const FastSensor sensor(traits, LinearSensor{}, 0);
  const ImageF flat(256, 256, 1, 0.5F);
  std::vector<std::uint16_t> first(flat.data.size()), second(flat.data.size());
  sensor.expose(flat, 0.01, 1, first);
  sensor.expose(flat, 0.01, 2, second);
  const Moments a = moments_of(first), b = moments_of(second);
  double covariance = 0;
  for (std::size_t i = 0; i < first.size(); ++i)
    covariance += (first[i] - a.mean) * (second[i] - b.mean) / static_cast<double>(first.size());
  EXPECT_LT(std::abs(covariance / (a.sigma * b.sigma)), 0.05);
}

TEST(WirePacking, UnpackInvertsItInEveryFormat) {
  std::mt19937 random(4);
  for (const WireFormat& format : wire_formats())
    for (const std::size_t pixels : {std::size_t{1}, std::size_t{2}, std::size_t{7}, std::size_t{64}}) {
      std::vector<std::uint16_t> codes(pixels), back(pixels);
      for (std::uint16_t& code : codes) code = static_cast<std::uint16_t>(random() & ((1U << format.format.bits) - 1));
      std::vector<std::uint8_t> bytes(format.bytes_for(pixels));
      pack(format, codes, bytes);
      unpack(format, bytes, back);
      EXPECT_EQ(back, codes) << format.name << ' ' << pixels;
    }
}

TEST(ReactingPictures, ExposureAndResponseChangeTheNextFrame) {
  ReactingPictures pictures({ImageF(64, 48, 3, 0.2F)}, traits_of(PixelLayout::mono, 12), 1);
  const auto mean_at = [&](double exposure_s, const SensorResponse& response) {
    const GigeShot shot{1, exposure_s, 0, response, wire_format("Mono12").value()};
    std::vector<std::uint8_t> bytes(shot.format.bytes_for(64 * 48));
    pictures.fill(shot, bytes);
    std::vector<std::uint16_t> codes(64U * 48U);
    unpack(shot.format, bytes, codes);
    return moments_of(codes).mean;
  };
  EXPECT_NEAR(mean_at(0.01, LinearSensor{}), 64 + 0.2 * 4031, 2);
  EXPECT_NEAR(mean_at(0.04, LinearSensor{}), 64 + 0.8 * 4031, 3);
  EXPECT_NEAR(mean_at(1, two_knees), 64 + 0.95 * 4031, 3);
}

TEST(ReactingPictures, KeepsUpWithTheCamera) {
  std::mt19937 random(7);
  ImageF picture(1024, 1024, 1);
  for (float& value : picture.data) value = std::exp2(static_cast<float>(random() % 1000) / 50.0F - 10);
  ReactingPictures pictures({picture}, traits_of(PixelLayout::bayer_rg, 12), 1);
  const GigeShot shot{1, 0.01, 0, two_knees, wire_format("BayerRG12").value()};
  std::vector<std::uint8_t> bytes(shot.format.bytes_for(picture.data.size()));
  pictures.fill(shot, bytes);
  double best_ms = 1e9;
  for (int i = 0; i < 10; ++i) {
    const auto begun = std::chrono::steady_clock::now();
    pictures.fill(shot, bytes);
    best_ms =
        std::min(best_ms, std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begun).count());
  }
  std::printf("a frame of 1024 x 1024 pixels in %.1f ms\n", best_ms);
  EXPECT_LT(best_ms, 100);  // 13.5 is half a core at 37 frames a second; this machine may be busy
}

}  // namespace
}  // namespace mf::sim
