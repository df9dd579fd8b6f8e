// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "common/response_curve.h"
#include "common/session.h"

namespace mf {

// What turns relative exposures into radiance: for each channel, the spot meter's reading divided by the mean of the
// linearized frame over its disc (the pixels that it touches). The disc's own pixels and no others: what texture and
// noise they have, the meter saw too.
//
// A mosaic shows each channel at some of them only. As far as chance explains by how much the channels' scales differ,
// they are taken as one, which every pixel tells whatever its colour (random effects: DerSimonian and Laird 1986).
// `session` names the source in errors. Throws InputError when the disc leaves the picture, holds saturated pixels, no
// light or no pixel of a colour, or the reading does not have one positive radiance for each channel.
[[nodiscard]] std::vector<double> reference_scale(const SessionHeader::Reference&, const Frame&, const PixelFormat&,
                                                  const ResponseCurve&, const std::string& session);

}  // namespace mf
