// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/response_curve.h"
#include "common/tag_detector.h"
#include "device/camera_source.h"

// Metering before a recording: exposure, and a programmable response's parameters, so that the brightest reflection
// survives and the tags stay readable. Then everything stays as it is: the session needs one response.

namespace mf {

struct MeteringOptions {
  double least_exposure_s = 10e-6;  // > 0
  double most_exposure_s = 0.008;   // how long the hand-held mirror may blur; the frame's period bounds it, too
  double clipped_share = 1e-4;      // of a linear sensor's pixels that may be saturated; (0, 1)
  double headroom = 1.5;            // ≥ 1: light that shall survive, over the brightest seen: reflections come and go
  double tag_white = 0.35;          // where a compressing response puts the tags' white, of a linear pixel; (0, 0.45]
  double tag_contrast = 0.04;       // between a tag's white and black that must be there, of all codes; (0, 0.3]
  int settle_frames = 3;            // frames on their way when a setting changes, which still have the old one; ≥ 0
  double most_seconds = 2;
  bool change_response = true;                 // otherwise only the exposure
  double black_level = 0;                      // code
  [[nodiscard]] std::string validate() const;  // what is wrong; empty: nothing
};

struct TagLevels {
  double white = 0, black = 0;  // codes
};

// What metering needs of a frame.
struct LevelCounts {
  std::vector<std::uint32_t> histogram;  // pixels by code
  std::optional<TagLevels> tags;         // the median tag's
};
[[nodiscard]] LevelCounts level_counts(const ImageU16& codes, const PixelFormat&, std::span<const TagDetection>);

struct MeteringState {
  double exposure_s = 0;
  ResponseCurve curve;            // in force; relative exposure 1 fills a linear pixel
  ResponseCapability capability;  // linear: only the exposure can be chosen
  double most_light = 1e6;        // that the response can be made to hold, in full linear pixels
};

struct MeteringStep {
  double exposure_s = 0;
  std::optional<ResponseRequest> response;  // nothing: as it is (linear sensors)
  double light = 0;                         // that this response has to hold, in full linear pixels
  bool good = false;                        // the frame was as it should be: nothing has to change
  double clipped_share = 0;                 // of the frame that was looked at
  std::optional<double> tag_contrast;       // of it, relative to all codes
};

// The next setting from a frame that was taken with `state`. Without tags, the brighter part of the picture stands for
// their white. A pure function. Precondition: valid options, a histogram with a pixel.
[[nodiscard]] MeteringStep next_setting(const LevelCounts&, const MeteringState&, const MeteringOptions&);

struct MeteringResult {
  double exposure_s = 0;     // read back
  ResponseSetting response;  // read back
  bool settled = false;      // within the time; otherwise the last setting is the best known
  bool camera_lost = false;
  int frames = 0;  // received
  double seconds = 0;
  double clipped_share = 0;            // of the last frame
  std::optional<double> tag_contrast;  // of it, of all codes; nothing without tags
  std::vector<std::string> remarks;    // one line each, for the operator
};

using FindTags = std::function<std::vector<TagDetection>(const ImageU16& codes, const ResponseCurve&)>;

// Runs on a started camera until two frames in a row are good, or the time is over, and leaves the camera set. What the
// camera refuses is a remark. Throws InputError for invalid options.
[[nodiscard]] MeteringResult meter(CameraSource&, const MeteringOptions&, const FindTags& find_tags = {});

}  // namespace mf
