// SPDX-License-Identifier: Apache-2.0
#include "common/tag_detector.h"

#include <apriltag/apriltag.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/check.h"
#include "common/error.h"
#include "common/tag_family.h"

namespace mf {

namespace {

struct DetectorDeleter {
  void operator()(apriltag_detector_t* detector) const { apriltag_detector_destroy(detector); }
};
struct DetectionsDeleter {
  void operator()(zarray_t* detections) const { apriltag_detections_destroy(detections); }
};

void require_valid(const TagDetectorOptions& options) {
  const auto reject = [](const char* field, const char* what) { throw InputError("tag detector", field, what); };
  if (!(options.quad_decimate >= 1)) reject("quad_decimate", "must be 1 or more");
  if (!(options.quad_sigma >= 0)) reject("quad_sigma", "must be 0 or more pixels");
  if (options.max_corrected_bits < 0 || options.max_corrected_bits > 3) reject("max_corrected_bits", "must be 0 to 3");
}

float percentile(std::vector<float>& values, double fraction) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// Linear up to a bright surface, then a logarithmic shoulder: lamps and their reflections, which may be thousands of
// times brighter than paper, must neither squash the tags into a few levels nor hide a tag that is lit brighter than
// most of the picture. Black pixels that were never read out don't count.
class Stretch {
 public:
  explicit Stretch(const ImageF& linear) {
    std::vector<float> lit;
    for (const float v : linear.data)
      if (v > 0 && std::isfinite(v)) lit.push_back(v);
    if (lit.size() < 16) return;
    constexpr double bright_surface = 0.9;
    knee_ = percentile(lit, bright_surface);
    const float top = *std::max_element(lit.begin(), lit.end());
    shoulder_ = (255 - knee_level) / std::log(std::max(top / knee_, 1.5F));
  }
  std::uint8_t operator()(float v) const {
    if (!(v > 0) || !(knee_ > 0)) return 0;
    const float x = v / knee_;
    const float level = x <= 1 ? knee_level * x : knee_level + shoulder_ * std::log(x);
    return static_cast<std::uint8_t>(std::lround(std::min(level, 255.F)));
  }

 private:
  static constexpr float knee_level = 200;
  float knee_ = 0;
  float shoulder_ = 0;
};

ImageU8 to_8_bits(const ImageF& values) {
  const Stretch stretch(values);
  ImageU8 picture(values.width, values.height, 1);
  std::transform(values.data.begin(), values.data.end(), picture.data.begin(), stretch);
  return picture;
}

ImageF square_roots(ImageF picture) {
  for (float& v : picture.data) v = std::sqrt(std::max(v, 0.F));
  return picture;
}

}  // namespace

struct TagDetector::Impl {
  explicit Impl(const TagDetectorOptions& options)
      : family(make_tag_family(options.family)),
        detector(apriltag_detector_create()),
        square_root_levels(options.square_root_levels) {
    detector->nthreads = 1;  // more of them race (apriltag #387)
    detector->quad_decimate = static_cast<float>(options.quad_decimate);
    detector->quad_sigma = static_cast<float>(options.quad_sigma);
    detector->refine_edges = true;
    apriltag_detector_add_family_bits(detector.get(), family.get(), options.max_corrected_bits);
  }

  TagFamily family;  // outlives the detector, which points into it
  std::unique_ptr<apriltag_detector_t, DetectorDeleter> detector;
  bool square_root_levels;
};

TagDetector::TagDetector(const TagDetectorOptions& options) {
  require_valid(options);
  impl_ = std::make_unique<Impl>(options);
}
TagDetector::TagDetector(TagDetector&&) noexcept = default;
TagDetector& TagDetector::operator=(TagDetector&&) noexcept = default;
TagDetector::~TagDetector() = default;

std::vector<TagDetection> TagDetector::detect(const ImageF& linear) {
  check(linear.channels == 1, "tags are sought in a picture of one channel");
  if (linear.empty()) return {};
  return detect(to_8_bits(impl_->square_root_levels ? square_roots(linear) : linear));
}

std::vector<TagDetection> TagDetector::detect(ImageU8 levels) {
  check(levels.channels == 1, "tags are sought in a picture of one channel");
  if (levels.empty()) return {};
  image_u8_t view{levels.width, levels.height, levels.width, levels.data.data()};
  const std::unique_ptr<zarray_t, DetectionsDeleter> found(apriltag_detector_detect(impl_->detector.get(), &view));
  std::vector<TagDetection> tags;
  for (int i = 0; i < zarray_size(found.get()); ++i) {
    const apriltag_detection_t* detection = nullptr;
    zarray_get(found.get(), i, &detection);
    TagDetection tag{detection->id, {}, detection->hamming, static_cast<double>(detection->decision_margin)};
    for (std::size_t k = 0; k < 4; ++k) tag.corners_px[k] = {detection->p[k][0], detection->p[k][1]};
    tags.push_back(tag);
  }
  return tags;
}

}  // namespace mf
