// SPDX-License-Identifier: Apache-2.0
// Metering against a camera that reacts, over real GVCP and GVSP.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "device/aravis_source.h"
#include "device/metering.h"
#include "hw-sim/reacting_camera.h"

namespace mf::sim {
namespace {

// Walls, paper of this radiance on a third of the picture, and a lamp on 0.3 %.
ImageF room_with_lamp(float paper, float contrast) {
  ImageF radiance(320, 240, 1);
  for (int y = 0; y < 240; ++y)
    for (int x = 0; x < 320; ++x) radiance.at(x, y) = paper * (x < 200 ? 0.1F + 0.002F * static_cast<float>(x) : 1.0F);
  for (int y = 20; y < 36; ++y)
    for (int x = 150; x < 165; ++x) radiance.at(x, y) = paper * contrast;
  return radiance;
}

struct Case {
  const char* name;
  bool programmable;
  float paper, contrast;
};

class MeteringRig : public testing::TestWithParam<Case> {};

TEST_P(MeteringRig, SettlesAndKeepsTheLamp) {
  const Case& c = GetParam();
  GigeCameraOptions o;
  o.address = "127.0.6.1";
  o.format = wire_format("Mono12").value();
  o.width = 320;
  o.height = 240;
  o.programmable_response = c.programmable;
  SensorTraits traits;
  traits.full_exposure = 1;
  ReactingPictures pictures({room_with_lamp(c.paper, c.contrast)}, traits, 3);
  const GigeCamera server(
      o, GigeCamera::Expose([&](const GigeShot& shot, std::span<std::uint8_t> into) { pictures.fill(shot, into); }));
  CameraSettings settings;
  settings.address = o.address;
  settings.socket_buffer_bytes = 4 << 20;
  const std::unique_ptr<CameraSource> source = open_aravis_source(settings);
  source->start();
  MeteringOptions options;
  options.black_level = traits.black_level;
  options.clipped_share = 1e-3;
  const MeteringResult result = meter(*source, options);
  std::printf("%s: %.2f s, %d frames, %.3g ms, %s\n", c.name, result.seconds, result.frames, 1e3 * result.exposure_s,
              result.response.scheme.c_str());
  // On a machine that stalls it may run out of time; then it says so.
  EXPECT_TRUE(result.settled || !result.remarks.empty());
  if (!result.settled) GTEST_SKIP() << "the machine was too busy: " << result.remarks.back();
  SensorResponse response;
  if (const auto* slopes = std::get_if<MultiSlopeSensor>(&result.response.in_force)) response = *slopes;
  if (const auto* linlog = std::get_if<LinLogSensor>(&result.response.in_force)) response = *linlog;
  const double paper = c.paper * result.exposure_s;
  EXPECT_LT(charge_of(response, paper * static_cast<double>(c.contrast)), 1);
  EXPECT_GT(charge_of(response, paper) * 0.9, options.tag_contrast);
  EXPECT_EQ(c.contrast > 10, result.response.scheme == "SFNC MultiSlope");
}

INSTANTIATE_TEST_SUITE_P(Rooms, MeteringRig,
                         testing::Values(Case{"linear, dim", false, 20, 3}, Case{"linear, bright", false, 5000, 3},
                                         Case{"programmable, dim", true, 20, 1e4F},
                                         Case{"programmable, bright", true, 5000, 1e4F}));

}  // namespace
}  // namespace mf::sim
