// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "common/image.h"

namespace mf {

// A tag found in a picture. Pixel centres at +0.5.
struct TagDetection {
  int id = 0;
  // The black square's corners, in the order of PlanarTag::corners_m(): lower left, lower right, upper right, upper
  // left as the tag is read (so they run counter-clockwise on the tag seen from its front).
  std::array<Eigen::Vector2d, 4> corners_px;
  int corrected_bits = 0;      // 0: every payload bit was read right
  double decision_margin = 0;  // mean contrast of the payload bits, in 8-bit levels
};

struct TagDetectorOptions {
  std::string family = "tag36h11";
  double quad_decimate = 1;  // quads are searched in a picture this many times smaller, ≥ 1; faster, misses small tags
  double quad_sigma = 0;     // Gaussian blur in pixels before the search, ≥ 0; for noisy pictures
  // The eight bits hold square roots, which spend more of them on shadows: finds more tags, but shifts edges towards
  // the dark by up to half a pixel. For who aligns the corners again on the linear picture.
  bool square_root_levels = false;
  int max_corrected_bits = 1;  // 0 to 3: more finds more tags and more ghosts
};

// AprilTag (Wang & Olson 2016) on **linear** pictures. Not thread-safe: one detector a thread (apriltag #387).
// Throws InputError for a family it does not know.
class TagDetector {
 public:
  explicit TagDetector(const TagDetectorOptions&);
  TagDetector(TagDetector&&) noexcept;
  TagDetector& operator=(TagDetector&&) noexcept;
  ~TagDetector();

  // `linear`: one channel, proportional to radiance, any scale: it is stretched to 8 bits, with a
  // shoulder for what is brighter than most of the picture.
  [[nodiscard]] std::vector<TagDetection> detect(const ImageF& linear);

  // The same on eight bits that were stretched already, proportional to radiance where the tags are. By value: AprilTag
  // blurs in place when it is told to blur.
  [[nodiscard]] std::vector<TagDetection> detect(ImageU8 levels);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mf
