// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "common/progress.h"
#include "common/response_curve.h"
#include "common/session.h"
#include "host/calibration/calibrate.h"
#include "host/calibration/tag_search.h"

namespace mf {

// The tags of every mirror frame and of the scene frames, found in the **linearized** pictures on `threads` threads
// (0: as many as the machine has), each with its own detector. Mirror views come in the order of the session.
// Throws InputError naming the file when a frame cannot be read.
[[nodiscard]] CalibrationInput find_session_targets(const SessionReader&, const ResponseCurve&, const TagSearchOptions&,
                                                    int threads, const Progress&);

}  // namespace mf
