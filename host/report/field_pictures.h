// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "common/image.h"
#include "host/light_field/light_field.h"

namespace mf {

// The hemisphere above the plane's middle, seen from below as a disc: azimuthal equal area (Lambert), zenith in the
// centre, plane +x to the right, +y up; equal areas are equal solid angles. Outside the disc everything is 0.
struct HemisphereDisc {
  ImageF radiance;    // three channels: the mean over the plane, weighted by confidence
  ImageF confidence;  // one channel: the mean over the plane
};
[[nodiscard]] HemisphereDisc draw_hemisphere(const LightField&, int size_px);

// Share of the cosine-weighted hemisphere that views looked at, mean over the plane, 0 to 1.
[[nodiscard]] double covered_share(const LightField&);

}  // namespace mf
