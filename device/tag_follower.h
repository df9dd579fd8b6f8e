// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "common/tag_detector.h"
#include "device/frame_levels.h"

namespace mf {

struct TagFollowerOptions {
  std::vector<int> ids;      // of the tags that move: the mirror's; empty: every search is a full one
  int full_each = 8;         // ≥ 1; so many searches to a full one, which also sees the tags that stand still
  double margin = 0.2;       // ≥ 0; of the size of what was seen, on every side, besides how far it moved last
  double enough_tags = 0.8;  // 0 to 1; a search near the last place that finds a smaller share of the last full
                             // search's tags is repeated in the whole frame
};

// Where to look for the mirror's tags next. The hand moves little from frame to frame, so most searches can do with the
// surroundings of the last place. Nothing is lost by that: a tag found there is read as surely as in the whole frame,
// and a search that found too few is done again.
class TagFollower {
 public:
  explicit TagFollower(TagFollowerOptions);

  // A box in the frame, with edges at multiples of eight: AprilTag's tiles then lie as in the whole frame.
  [[nodiscard]] PixelBox next(int width, int height) const;

  // What a search of `box` found. False: search the whole frame instead; call again with that.
  [[nodiscard]] bool accept(const PixelBox& box, const PixelBox& frame, std::span<const TagDetection>);

 private:
  struct Place {
    Eigen::Vector2d low, high;
    int tags = 0;
  };
  [[nodiscard]] std::optional<Place> place_of(std::span<const TagDetection>) const;

  TagFollowerOptions options_;
  std::optional<Place> last_;
  Eigen::Vector2d step_ = Eigen::Vector2d::Zero();  // of the last place from the one before
  int tags_in_full_ = 0;
  int since_full_ = 0;
};

}  // namespace mf
