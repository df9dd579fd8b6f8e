// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "common/response_curve.h"
#include "common/session.h"

namespace mf {

// What turns relative exposures into radiance: for each channel, the spot meter's reading divided by the mean over its
// disc (pixels whose centres lie inside) of the linearized frame. Where the picture around the disc is as even as its
// noise can tell, up to two and a half times as far, a plane fitted there gives that mean with less noise than the disc
// alone. `session` names the source in errors. Throws InputError when the disc leaves the picture, holds saturated
// pixels or no light, or the reading does not have one positive radiance for each channel.
[[nodiscard]] std::vector<double> reference_scale(const SessionHeader::Reference&, const Frame&, const PixelFormat&,
                                                  const ResponseCurve&, const std::string& session);

}  // namespace mf
