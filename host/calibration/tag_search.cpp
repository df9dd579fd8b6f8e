// SPDX-License-Identifier: Apache-2.0
#include "host/calibration/tag_search.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/check.h"
#include "common/homography.h"
#include "common/robust_homography.h"

namespace mf {

namespace {

double shortest_edge(const TagCorners& corners) {
  double shortest = INFINITY;
  for (std::size_t k = 0; k < 4; ++k) shortest = std::min(shortest, (corners[k] - corners[(k + 1) % 4]).norm());
  return shortest;
}

// Twice the signed area: AprilTag's order runs counter-clockwise on the page, where y is down.
double signed_area(const TagCorners& c) {
  const Eigen::Vector2d a = c[2] - c[0], b = c[3] - c[1];
  return b.x() * a.y() - b.y() * a.x();
}

Eigen::Vector2d centre(const std::array<Eigen::Vector3d, 4>& corners) {
  return 0.25 * (corners[0] + corners[1] + corners[2] + corners[3]).head<2>();
}

// Where a missing tag must be, as the tags nearest to it say (a distorted picture is nearly projective over a few
// tags); nothing when they don't say: all tags are then in one place, or it would face away.
std::optional<TagCorners> predict(const std::vector<TagSighting>& found,
                                  const std::array<Eigen::Vector3d, 4>& corners) {
  constexpr std::size_t neighbours = 6;
  std::vector<const TagSighting*> near;
  near.reserve(found.size());
  for (const TagSighting& tag : found) near.push_back(&tag);
  const Eigen::Vector2d at = centre(corners);
  std::sort(near.begin(), near.end(), [&](const TagSighting* a, const TagSighting* b) {
    return (centre(a->corners_in_target) - at).norm() < (centre(b->corners_in_target) - at).norm();
  });
  if (near.size() > neighbours) near.resize(neighbours);
  std::vector<Eigen::Vector2d> plane, picture;
  for (const TagSighting* tag : near)
    for (std::size_t k = 0; k < 4; ++k) {
      plane.emplace_back(tag->corners_in_target[k].head<2>());
      picture.push_back(tag->corners_px[k]);
    }
  const std::optional<Homography> h = fit_homography(plane, picture);
  if (!h) return std::nullopt;
  const double side = (h->matrix * plane.front().homogeneous()).z();
  TagCorners out;
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::Vector3d q = h->matrix * corners[k].head<2>().homogeneous();
    if (!(q.z() * side > 0)) return std::nullopt;
    out[k] = q.hnormalized();
  }
  return out;
}

bool inside(const TagCorners& corners, const ImageF& picture) {
  return std::all_of(corners.begin(), corners.end(), [&](const Eigen::Vector2d& c) {
    return c.x() >= 0 && c.y() >= 0 && c.x() <= picture.width && c.y() <= picture.height;
  });
}

// A tag read wrong, or a ghost, sits where no plane with the others has it.
void keep_consistent(std::vector<TagSighting>& found) {
  if (found.size() < 2) return;
  // Strong distortion bends a plane by this many pixels across a picture; ghosts are much further off.
  constexpr double threshold_px = 12;
  const std::optional<RobustHomography> plane = robust_homography(in_plane(found), threshold_px);
  if (!plane) return;
  std::vector<TagSighting> kept;
  for (std::size_t i = 0; i < found.size(); ++i)
    if (plane->tag_is_inlier[i]) kept.push_back(found[i]);
  found = std::move(kept);
}

// In the order of ids. The same id twice: one is a ghost, and nothing here says which, so neither stays.
void keep_unique(std::vector<TagSighting>& found) {
  std::sort(found.begin(), found.end(), [](const TagSighting& a, const TagSighting& b) { return a.id < b.id; });
  std::vector<TagSighting> kept;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const bool twin_before = i > 0 && found[i - 1].id == found[i].id;
    const bool twin_after = i + 1 < found.size() && found[i + 1].id == found[i].id;
    if (!twin_before && !twin_after) kept.push_back(found[i]);
  }
  found = std::move(kept);
}

struct PixelBox {
  int x = 0, y = 0, width = 0, height = 0;
};

// Where the picture is not black: a sensor that reads out a region of interest leaves the rest black.
PixelBox lit_box(const ImageF& picture) {
  const float top = *std::max_element(picture.data.begin(), picture.data.end());
  const float lit = 1e-6F * top;  // any light at all
  int x0 = picture.width, x1 = -1, y0 = picture.height, y1 = -1;
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x)
      if (picture.at(x, y) > lit) {
        x0 = std::min(x0, x), x1 = std::max(x1, x);
        y0 = std::min(y0, y), y1 = std::max(y1, y);
      }
  if (x1 < x0) return {0, 0, picture.width, picture.height};
  constexpr int margin = 8;  // a tag at the border keeps its surroundings
  x0 = std::max(0, x0 - margin), y0 = std::max(0, y0 - margin);
  x1 = std::min(picture.width - 1, x1 + margin), y1 = std::min(picture.height - 1, y1 + margin);
  return {x0, y0, x1 - x0 + 1, y1 - y0 + 1};
}

ImageF cropped(const ImageF& picture, const PixelBox& box) {
  ImageF out(box.width, box.height, 1);
  for (int y = 0; y < box.height; ++y)
    std::copy_n(picture.row(box.y + y).begin() + box.x, box.width, out.row(y).begin());
  return out;
}

// Bilinear; pixel edges stay where they are, so that positions double exactly.
ImageF twice_the_size(const ImageF& in) {
  ImageF out(2 * in.width, 2 * in.height, 1);
  for (int y = 0; y < out.height; ++y) {
    const int near_y = y / 2, far_y = std::clamp(near_y + (y % 2 == 0 ? -1 : 1), 0, in.height - 1);
    for (int x = 0; x < out.width; ++x) {
      const int near_x = x / 2, far_x = std::clamp(near_x + (x % 2 == 0 ? -1 : 1), 0, in.width - 1);
      out.at(x, y) = 0.5625F * in.at(near_x, near_y) + 0.1875F * (in.at(far_x, near_y) + in.at(near_x, far_y)) +
                     0.0625F * in.at(far_x, far_y);
    }
  }
  return out;
}

bool in_one_plane(const SearchedTarget& target) {
  double low = INFINITY, high = -INFINITY;
  for (const auto& [id, corners] : target.corners_in_target)
    for (const Eigen::Vector3d& c : corners) low = std::min(low, c.z()), high = std::max(high, c.z());
  return high - low < 1e-9;
}

}  // namespace

SearchedTarget searched_target(const MirrorTarget& target) {
  SearchedTarget out{target.family, {}};
  for (const PlanarTag& tag : target.tags) {
    const std::array<Eigen::Vector2d, 4> corners = tag.corners_m();
    for (std::size_t k = 0; k < 4; ++k) out.corners_in_target[tag.id][k] = {corners[k].x(), corners[k].y(), 0};
  }
  return out;
}

SearchedTarget searched_target(const WorldTarget& target) {
  SearchedTarget out{target.family, {}};
  for (const WorldTag& tag : target.tags) out.corners_in_target[tag.id] = tag.corners_in_world();
  return out;
}

ImageF smooth_mosaic(const ImageF& mosaic) {
  check(mosaic.channels == 1, "a mosaic has one channel");
  const int w = mosaic.width, h = mosaic.height;
  ImageF across(w, h, 1), out(w, h, 1);
  // Mirrored at the borders about the pixel, which keeps the weights of the colours.
  const auto reflected = [](int i, int n) { return std::clamp(i < 0 ? -i : (i >= n ? 2 * n - 2 - i : i), 0, n - 1); };
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x)
      across.at(x, y) =
          0.25F * (mosaic.at(reflected(x - 1, w), y) + mosaic.at(reflected(x + 1, w), y)) + 0.5F * mosaic.at(x, y);
  for (int y = 0; y < h; ++y) {
    const std::span<const float> above = std::as_const(across).row(reflected(y - 1, h));
    const std::span<const float> here = std::as_const(across).row(y);
    const std::span<const float> below = std::as_const(across).row(reflected(y + 1, h));
    const std::span<float> to = out.row(y);
    for (std::size_t x = 0; x < to.size(); ++x) to[x] = 0.25F * (above[x] + below[x]) + 0.5F * here[x];
  }
  return out;
}

ImageF luminance(const ImageF& picture) {
  if (picture.channels == 1) return picture;
  check(picture.channels == 3, "a colour picture has three channels");
  ImageF out(picture.width, picture.height, 1);
  for (std::size_t i = 0; i < out.data.size(); ++i)
    out.data[i] = 0.25F * (picture.data[3 * i] + picture.data[3 * i + 2]) + 0.5F * picture.data[3 * i + 1];
  return out;
}

namespace {

TagDetectorOptions detector_options(const std::string& family, double quad_decimate, bool aligned_later) {
  TagDetectorOptions options;
  options.family = family;
  options.quad_decimate = quad_decimate;
  options.square_root_levels = aligned_later;
  return options;
}

}  // namespace

TagSearch::TagSearch(SearchedTarget target, const TagSearchOptions& options)
    : target_(std::move(target)),
      options_(options),
      detector_(detector_options(target_.family, options.quad_decimate, options.refine)),
      hard_detector_(detector_options(target_.family, 1, options.refine)) {
  for (const auto& [id, corners] : target_.corners_in_target) patterns_.emplace(id, tag_pattern(target_.family, id));
}

std::optional<TagSighting> TagSearch::align(const ImageF& picture, PixelLayout layout, int id, const TagCorners& start,
                                            double initial_blur_px) const {
  TagRefinementOptions refinement;
  refinement.initial_blur_px = initial_blur_px;
  const std::optional<RefinedTag> refined = refine_tag(picture, layout, patterns_.at(id), start, refinement);
  if (!refined || refined->right_cells < options_.min_right_cells) return std::nullopt;
  return TagSighting{id, target_.corners_in_target.at(id), refined->corners_px, refined->information, true};
}

// What AprilTag finds, aligned. `hard`: at twice the size, for grazing tags are a few pixels high.
std::vector<TagSighting> TagSearch::detect(TagDetector& detector, const ImageF& picture, PixelLayout layout,
                                           bool hard) const {
  const ImageF smooth = smooth_mosaic(picture);
  const PixelBox lit = lit_box(smooth);
  ImageF seen = cropped(smooth, lit);
  if (hard) seen = twice_the_size(seen);
  const double scale = hard ? 0.5 : 1;
  std::vector<TagSighting> found;
  for (const TagDetection& tag : detector.detect(seen)) {
    if (!target_.corners_in_target.contains(tag.id) || !(signed_area(tag.corners_px) > 0)) continue;
    TagCorners corners;
    for (std::size_t k = 0; k < 4; ++k) corners[k] = scale * tag.corners_px[k] + Eigen::Vector2d(lit.x, lit.y);
    if (!options_.refine) {
      found.push_back(
          {tag.id, target_.corners_in_target.at(tag.id), corners, isotropic_information(options_.raw_sigma_px), true});
      continue;
    }
    constexpr double usual_blur_px = 0.7;
    if (std::optional<TagSighting> s = align(picture, layout, tag.id, corners, usual_blur_px)) found.push_back(*s);
  }
  keep_unique(found);
  if (in_one_plane(target_)) keep_consistent(found);
  return found;
}

std::vector<TagSighting> TagSearch::find(const ImageF& picture, PixelLayout layout) {
  check(picture.channels == 1 && layout != PixelLayout::rgb, "tags are sought in a mosaic or a mono picture");
  if (picture.empty()) return {};
  const std::size_t few = std::min(static_cast<std::size_t>(options_.few_tags), target_.corners_in_target.size());
  std::vector<TagSighting> found = detect(detector_, picture, layout, false);
  if (found.size() < few) {
    std::vector<TagSighting> harder = detect(hard_detector_, picture, layout, true);
    if (harder.size() > found.size()) found = std::move(harder);
  }
  if (in_one_plane(target_) && options_.refine && options_.complete && !found.empty()) complete(picture, layout, found);
  return found;
}

// Every tag that is confirmed predicts its neighbours better: repeat until nothing new is found.
void TagSearch::complete(const ImageF& picture, PixelLayout layout, std::vector<TagSighting>& found) const {
  std::map<int, std::size_t> tried_with;  // id → how many tags were known at its last trial
  for (bool again = true; again;) {
    again = false;
    for (const auto& [id, corners] : target_.corners_in_target) {
      if (std::any_of(found.begin(), found.end(), [known = id](const TagSighting& t) { return t.id == known; }))
        continue;
      if (tried_with[id] == found.size()) continue;
      tried_with[id] = found.size();
      const std::optional<TagCorners> start = predict(found, corners);
      if (!start || !inside(*start, picture)) continue;
      constexpr double smallest_edge_px = 8;  // cells of one pixel: nothing can be confirmed
      if (shortest_edge(*start) < smallest_edge_px) continue;
      constexpr double wide_blur_px = 1.0;  // a wider catch than after a detection
      std::optional<TagSighting> tag = align(picture, layout, id, *start, wide_blur_px);
      if (!tag) continue;
      found.push_back(*tag);
      again = true;
    }
  }
  std::sort(found.begin(), found.end(), [](const TagSighting& a, const TagSighting& b) { return a.id < b.id; });
}

}  // namespace mf
