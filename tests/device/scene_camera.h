// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <deque>
#include <random>
#include <utility>
#include <vector>

#include "device/camera_source.h"
#include "tests/device/picky_features.h"

namespace mf::test {

// A camera before a scene of given light, without waiting: settings reach its frames some frames later, as on real
// ones. Relative exposure 1 fills a linear pixel; read noise of one code, shot noise of 10⁴ electrons.
class SceneCamera final : public CameraSource {
 public:
  struct Limits {
    double least_s = 2e-6, most_s = 1;
    int latency_frames = 2;
  };
  SceneCamera(ImageF light_per_s, const PixelFormat& format, double black_level, const Limits& limits)
      : light_(std::move(light_per_s)), black_level_(black_level), limits_(limits) {
    description_.format = format;
    description_.width = light_.width;
    description_.height = light_.height;
    description_.exposure_s = 0.001;
    description_.frame_rate_hz = 37;
    std::normal_distribution<double> normal;
    for (double& value : noise_) value = normal(random_);
  }
  PickyFeatures& picky() { return features_; }
  void set_light(ImageF light_per_s) { light_ = std::move(light_per_s); }

  [[nodiscard]] const CameraDescription& description() const override { return description_; }
  void start() override {}
  [[nodiscard]] Received receive(CameraFrame& into, std::chrono::milliseconds /*at_most*/) override {
    on_their_way_.push_back({description_.exposure_s, response_now()});
    if (on_their_way_.size() <= static_cast<std::size_t>(limits_.latency_frames))
      on_their_way_.push_front(on_their_way_.front());
    const Shot shot = on_their_way_.front();
    on_their_way_.pop_front();
    while (on_their_way_.size() > static_cast<std::size_t>(limits_.latency_frames)) on_their_way_.pop_front();
    const double last = description_.format.level_count() - 1;
    for (std::size_t i = 0; i < light_.data.size(); ++i) {
      double light = static_cast<double>(light_.data[i]) * shot.exposure_s;
      light = std::max(0.0, light + std::sqrt(light / 1e4) * noise());
      const double code = black_level_ + (last - black_level_) * charge_of(shot.response, light) + noise();
      into.codes.data[i] = static_cast<std::uint16_t>(std::lround(std::clamp(code, 0.0, last)));
    }
    return Received::frame;
  }
  void set_exposure_s(double exposure_s) override {
    description_.exposure_s = std::clamp(exposure_s, limits_.least_s, limits_.most_s);
  }
  [[nodiscard]] FeatureAccess& features() override { return features_; }
  [[nodiscard]] SensorResponse response_now() {
    const ResponseSetting setting = apply_response(features_, std::nullopt, description_.exposure_s);
    if (const auto* slopes = std::get_if<MultiSlopeSensor>(&setting.in_force)) return *slopes;
    if (const auto* linlog = std::get_if<LinLogSensor>(&setting.in_force)) return *linlog;
    return LinearSensor{};
  }

 private:
  struct Shot {
    double exposure_s = 0;
    SensorResponse response;
  };
  double noise() { return noise_[random_() % noise_.size()]; }
  ImageF light_;
  double black_level_;
  Limits limits_;
  CameraDescription description_;
  PickyFeatures features_;
  std::deque<Shot> on_their_way_;
  std::mt19937_64 random_{11};
  std::vector<double> noise_ = std::vector<double>(4096);
};

}  // namespace mf::test
