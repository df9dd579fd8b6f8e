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

// Path-traced pictures of the simulator's waved mirror on its desk, with the truth.
struct RenderedViews {
  CameraModel camera;
  MirrorTarget mirror;
  WorldTarget world;
  Rigid3 cam_from_world;
  std::vector<Rigid3> cam_from_mirror;
  std::vector<ImageF> radiance;  // three channels
};
// `size`: edge in pixels. All of the picture is traced, table and walls too. `samples` per pixel make the noise: with 8
// of them far above a sensor's, a quarter of the paper's light in some places; with 32 half of that.
[[nodiscard]] RenderedViews rendered_views(int size, int count, int samples);

// The same as a LinLog sensor codes them.
struct RenderedFrames : RenderedViews {
  ResponseCurve response;  // the sensor's true one
  PixelFormat format;
  std::vector<CameraFrame> frames;
};
// `knee`: radiance from which on the sensor is logarithmic; paper is at 0.2 to 1.
[[nodiscard]] RenderedFrames exposed(const RenderedViews&, const PixelFormat&, double knee);

struct CornerErrors {
  double rms_px = 0;
  int corners = 0;
  int tags = 0, tags_in_sight = 0;
  int false_tags = 0;  // no tag of the scene, or a corner more than 3 px off: pose estimation rejects these
};
// Of the mirror's and the world's tags.
void add_errors(const RenderedViews&, std::size_t frame, const std::vector<TagDetection>&, CornerErrors& sum);

}  // namespace mf::test
