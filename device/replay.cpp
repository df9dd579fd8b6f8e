// SPDX-License-Identifier: Apache-2.0
#include "device/replay.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "common/session.h"

namespace mf {

namespace {

ResponseCurve response_of_session(const SessionReader& session) {
  const std::filesystem::path file = session.folder() / "response.json";
  if (std::filesystem::exists(file)) return read_response_curve(file);
  const SessionHeader& header = session.header();
  return linear_response(header.format.bits, header.black_level_hint, 1, header.format.colour_channels());
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

ReplayResult replay(const std::filesystem::path& folder, const LookoutOptions& options,
                    const std::function<void(const ReplayedFrame&)>& each) {
  const SessionReader session(folder);
  const SessionHeader& header = session.header();
  Sightseer seer(options.seeing, header.target, header.world, header.width, header.height);
  FrameDetector detector(detection_options(options, header.target), response_of_session(session), header.format);
  ReplayResult result;
  result.damage = session.damage();
  std::vector<double> tags, milliseconds;
  for (const SessionFrame& frame : session.frames(FrameRole::mirror)) {
    CameraFrame camera_frame;
    camera_frame.codes = std::get<ImageU16>(session.read_frame(frame).pixels);
    if (frame.arrival) camera_frame.arrival = *frame.arrival;
    const DetectedFrame detected = detector.detect(camera_frame);
    const bool posed = seer.add(detected).has_value();
    ++result.frames;
    result.posed += posed ? 1 : 0;
    if (!detected.tags.empty()) tags.push_back(static_cast<double>(detected.tags.size()));
    milliseconds.push_back(detected.milliseconds);
    if (each) each({&frame, &detected, posed});
  }
  result.with_tags = static_cast<int>(tags.size());
  result.median_tags = median(tags);
  result.median_ms = median(milliseconds);
  if (seer.coverage()) result.covered = seer.coverage()->covered;
  return result;
}

}  // namespace mf
