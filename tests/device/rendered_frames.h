// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "common/camera_model.h"
#include "common/mirror_target.h"
#include "common/response_curve.h"
#include "common/rigid3.h"
#include "device/camera_source.h"
#include "device/detection.h"

namespace mf::test {

// Path-traced frames of the simulator's waved mirror as its LinLog sensor (Bayer, 12 bits) codes them, with the truth.
struct RenderedFrames {
  CameraModel camera;
  MirrorTarget mirror;
  WorldTarget world;
  Rigid3 cam_from_world;
  ResponseCurve response;  // the sensor's true one
  PixelFormat format;
  std::vector<CameraFrame> frames;
  std::vector<Rigid3> cam_from_mirror;
};
// `size`: edge in pixels. The whole frame is read out, table and walls too. `knee`: radiance from which on the sensor
// is logarithmic; paper is at 0.2 to 1.
[[nodiscard]] RenderedFrames rendered_frames(int size, int count, int samples, double knee);

struct CornerErrors {
  double rms_px = 0;
  int corners = 0;
  int tags = 0, tags_in_sight = 0;
  int false_tags = 0;  // no tag of the scene, or a corner more than 3 px off: pose estimation rejects these
};
// Of the mirror's and the world's tags.
void add_errors(const RenderedFrames&, std::size_t frame, const std::vector<TagDetection>&, CornerErrors& sum);

}  // namespace mf::test
