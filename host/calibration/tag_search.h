// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <vector>

#include "common/frame.h"
#include "common/mirror_target.h"
#include "common/tag_detector.h"
#include "common/tag_pattern.h"
#include "host/calibration/target_view.h"

namespace mf {

// A target as the search needs it: where each tag is on it.
struct SearchedTarget {
  std::string family;
  std::map<int, std::array<Eigen::Vector3d, 4>> corners_in_target;  // by id
};
[[nodiscard]] SearchedTarget searched_target(const MirrorTarget&);
[[nodiscard]] SearchedTarget searched_target(const WorldTarget&);

struct TagSearchOptions {
  double quad_decimate = 2;      // see TagDetectorOptions; tags that it misses are looked for where they must be
  int few_tags = 4;              // with fewer than this, AprilTag looks again, at twice the size
  bool refine = true;            // align each tag's pattern with the picture; off: AprilTag's corners, for comparison
  bool complete = true;          // look for the target's other tags where those found say they are
  double raw_sigma_px = 0.3;     // what AprilTag's own corners are taken for, when refine is off
  double min_right_cells = 0.9;  // a tag counts when the picture confirms so many of its cells, 0 to 1
};

// Finds one target's tags in pictures. Not thread-safe: one search a thread.
class TagSearch {
 public:
  TagSearch(SearchedTarget, const TagSearchOptions&);

  // `picture`: linear, one channel, a mosaic or mono. Tags come in the order of their ids, each once.
  [[nodiscard]] std::vector<TagSighting> find(const ImageF& picture, PixelLayout);

 private:
  [[nodiscard]] std::vector<TagSighting> detect(TagDetector&, const ImageF& picture, PixelLayout, bool hard) const;
  void complete(const ImageF& picture, PixelLayout, std::vector<TagSighting>& found) const;
  [[nodiscard]] std::optional<TagSighting> align(const ImageF& picture, PixelLayout, int id, const TagCorners& start,
                                                 double initial_blur_px) const;

  SearchedTarget target_;
  TagSearchOptions options_;
  TagDetector detector_;
  TagDetector hard_detector_;  // for small and grazing tags
  std::map<int, TagPattern> patterns_;
};

// What the detector looks at: the mosaic under a 3 × 3 binomial filter. Its weights are ¼ red, ½ green, ¼ blue at every
// pixel whatever the order, so the mosaic's pattern vanishes at full resolution without a guess at the white balance,
// and noise falls to 0.14 of its variance. Mono pictures are filtered too. RGB: use luminance() first.
[[nodiscard]] ImageF smooth_mosaic(const ImageF& mosaic);

// (R + 2 G + B) / 4 of three channels; one channel passes.
[[nodiscard]] ImageF luminance(const ImageF& picture);

}  // namespace mf
