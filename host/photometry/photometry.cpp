// SPDX-License-Identifier: Apache-2.0
#include "host/photometry/photometry.h"

#include <algorithm>
#include <limits>

#include "common/error.h"
#include "host/photometry/reference_scale.h"

namespace mf {

namespace {

ExposureSweep read_sweep(const SessionReader& session, const Progress& progress) {
  const SessionHeader& header = session.header();
  ExposureSweep sweep;
  sweep.source = session.folder().string();
  sweep.format = header.format;
  sweep.black_level_hint = header.black_level_hint;
  const std::vector<SessionFrame> frames = session.frames(FrameRole::sweep);
  if (frames.empty())
    throw InputError(sweep.source, "sweep",
                     "the session has no exposure sweep: import it with one (sweep.json), or give --linear to take the "
                     "sensor as linear between the black level and its last code");
  for (const SessionFrame& frame : frames) {
    sweep.frames.push_back(session.read_frame(frame));
    report_progress(progress, "reading the sweep",
                    static_cast<double>(sweep.frames.size()) / static_cast<double>(frames.size()));
  }
  return sweep;
}

ResponseCurve identity_response(int channels) {
  ResponseCurve curve = linear_response(1, 0, 1, channels);
  curve.saturation_code = std::numeric_limits<double>::infinity();
  return curve;
}

void set_absolute_scale(const SessionReader& session, ResponseCurve& curve) {
  const std::optional<SessionHeader::Reference>& reference = session.header().reference;
  if (!reference) return;
  const std::vector<SessionFrame>& frames = session.frames();
  const auto named = [&](FrameRole role) {
    return std::find_if(frames.begin(), frames.end(), [&](const SessionFrame& frame) {
      return frame.info.role == role && frame.info.name == reference->frame;
    });
  };
  auto found = named(FrameRole::scene);
  if (found == frames.end()) found = named(FrameRole::mirror);
  if (found == frames.end())
    throw InputError(session.folder().string(), "reference.frame",
                     "the session has no frame named '" + reference->frame + "': name a scene frame");
  curve.radiance_scale = reference_scale(*reference, session.read_frame(*found), session.header().format, curve,
                                         session.folder().string());
  curve.absolute = true;
}

}  // namespace

PhotometryResult photometry(const SessionReader& session, const PhotometryOptions& options, const Progress& progress) {
  if (const std::optional<std::string> wrong = options.validate()) throw InputError("options", "", *wrong);
  const SessionHeader& header = session.header();
  PhotometryResult result;
  if (header.format.linear_float) {
    result.curve = identity_response(header.format.colour_channels());
  } else if (options.linear) {
    result.curve = linear_response(header.format.bits, header.black_level_hint, 1, header.format.colour_channels());
  } else {
    const ExposureSweep sweep = read_sweep(session, progress);
    ResponseEstimate estimate = estimate_response(sweep, options.response, progress);
    result.curve = std::move(estimate.curve);
    result.channels = std::move(estimate.channels);
    for (const Frame& frame : sweep.frames) result.sweep_frames.push_back(frame.info.name);
  }
  set_absolute_scale(session, result.curve);
  return result;
}

}  // namespace mf
