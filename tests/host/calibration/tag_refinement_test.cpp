// SPDX-License-Identifier: Apache-2.0
#include "host/calibration/tag_refinement.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>

#include "common/homography.h"
#include "host/calibration/tag_search.h"

namespace mf {
namespace {

struct Scene {
  TagCorners corners;
  std::array<double, 3> white{};  // radiance of white paper, by colour
  double ink = 0.05;              // of white
  Eigen::Vector2d gradient;       // of the light, per pixel from the tag's centre, relative
  double sigma = 0;               // noise of a pixel that sees white, absolute
};

// The light on every pixel by 8 × 8 samples of the sharp print: not the model that the alignment uses.
ImageF photograph(const TagPattern& pattern, const Scene& scene, int size, unsigned seed) {
  const std::array<Eigen::Vector2d, 4> unit{Eigen::Vector2d(-1, -1), Eigen::Vector2d(1, -1), Eigen::Vector2d(1, 1),
                                            Eigen::Vector2d(-1, 1)};
  const Homography tag_from_picture = *fit_homography(scene.corners, unit);
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const Eigen::Vector2d centre = 0.25 * (scene.corners[0] + scene.corners[1] + scene.corners[2] + scene.corners[3]);
  ImageF picture(size, size, 1);
  constexpr int n = 8;
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x) {
      double white = 0;
      for (int i = 0; i < n * n; ++i) {
        const int across = i % n, down = i / n;
        const Eigen::Vector2d at(x + (across + 0.5) / n, y + (down + 0.5) / n);
        const Eigen::Vector2d uv = tag_from_picture * at;
        const int column = static_cast<int>(std::floor(0.5 * (pattern.border_cells * uv.x() + pattern.cells)));
        const int row = static_cast<int>(std::floor(0.5 * (pattern.cells - pattern.border_cells * uv.y())));
        const bool outside = column < 0 || row < 0 || column >= pattern.cells || row >= pattern.cells;
        white += outside || pattern.at(column, row) == TagPattern::Cell::white ? 1.0 : 0.0;
      }
      white /= n * n;
      const auto c = static_cast<std::size_t>(colour_at(PixelLayout::bayer_rg, x, y));
      const double light = 1 + scene.gradient.dot(Eigen::Vector2d(x + 0.5, y + 0.5) - centre);
      const double value = scene.white[c] * light * (scene.ink + (1 - scene.ink) * white);
      picture.at(x, y) = static_cast<float>(value + scene.sigma * std::sqrt(0.1 + value) * normal(random));
    }
  return picture;
}

Scene ordinary_scene() {
  return {{Eigen::Vector2d(14.3, 46.1), Eigen::Vector2d(43.7, 49.2), Eigen::Vector2d(46.2, 20.4),
           Eigen::Vector2d(15.9, 13.8)},
          {1.3, 0.9, 0.5},
          0.05,
          {0.006, -0.004},
          0.05};
}

Eigen::Matrix<double, 8, 1> error_of(const TagCorners& found, const TagCorners& truth) {
  Eigen::Matrix<double, 8, 1> e;
  for (std::size_t k = 0; k < 4; ++k) e.segment<2>(2 * static_cast<Eigen::Index>(k)) = found[k] - truth[k];
  return e;
}

struct NoisyAlignments {
  double corner_rms_px = 0;
  double worst_bias_px = 0;        // of the mean error, over the eight coordinates
  double chi2_per_coordinate = 0;  // 1: the covariance is the errors' own; below: it promises less than it holds
};

NoisyAlignments align_noisy_mosaics(double sigma) {
  const TagPattern pattern = tag_pattern("tag36h11", 17);
  Scene scene = ordinary_scene();
  scene.sigma = sigma;
  double squared = 0, chi2 = 0;
  Eigen::Matrix<double, 8, 1> mean = Eigen::Matrix<double, 8, 1>::Zero();
  constexpr int trials = 60;
  for (unsigned i = 0; i < trials; ++i) {
    TagCorners start = scene.corners;
    for (std::size_t k = 0; k < 4; ++k)
      start[k] += Eigen::Vector2d(0.7 * std::sin(i + 2.0 * static_cast<double>(k)), 0.7 * std::cos(3.0 * i));
    const std::optional<RefinedTag> tag =
        refine_tag(photograph(pattern, scene, 64, i), PixelLayout::bayer_rg, pattern, start);
    EXPECT_TRUE(tag) << i;
    if (!tag) continue;
    EXPECT_GE(tag->right_cells, 0.95);
    const Eigen::Matrix<double, 8, 1> e = error_of(tag->corners_px, scene.corners);
    squared += e.squaredNorm();
    chi2 += e.dot(tag->information * e);
    mean += e;
  }
  return {std::sqrt(squared / (4 * trials)), (mean / trials).cwiseAbs().maxCoeff(), chi2 / (8 * trials)};
}

TEST(RefineTag, AlignsOnANoisyMosaicWithinItsOwnCovariance) {
  const NoisyAlignments noisy = align_noisy_mosaics(0.12);
  EXPECT_LT(noisy.corner_rms_px, 0.16);
  EXPECT_LT(noisy.worst_bias_px, 0.05) << "no bias from light, colours or sampling";
  EXPECT_NEAR(noisy.chi2_per_coordinate, 1, 0.35) << "the covariance is the errors' own";
}

// With little noise the model's own error (square pixels, Gaussian blur) weighs in the residuals: the covariance may
// then be larger than the errors, never smaller.
TEST(RefineTag, PromisesNoMoreThanItHoldsWithLittleNoise) {
  const NoisyAlignments quiet = align_noisy_mosaics(0.05);
  EXPECT_LT(quiet.corner_rms_px, 0.08);
  EXPECT_LT(quiet.worst_bias_px, 0.02) << "no bias from light, colours or sampling";
  EXPECT_LT(quiet.chi2_per_coordinate, 1.35);
  EXPECT_GT(quiet.chi2_per_coordinate, 0.3);
}

TEST(RefineTag, IsExactWithoutNoise) {
  const TagPattern pattern = tag_pattern("tag36h11", 3);
  Scene scene = ordinary_scene();
  scene.sigma = 0;
  TagCorners start = scene.corners;
  start[0] += Eigen::Vector2d(1.2, -1.0);
  start[2] += Eigen::Vector2d(-0.8, 0.9);
  const std::optional<RefinedTag> tag =
      refine_tag(photograph(pattern, scene, 64, 0), PixelLayout::bayer_rg, pattern, start);
  ASSERT_TRUE(tag);
  EXPECT_LT(error_of(tag->corners_px, scene.corners).cwiseAbs().maxCoeff(), 0.02);
}

TEST(RefineTag, IsNotPulledByAShadowOnThePaper) {
  const TagPattern pattern = tag_pattern("tag36h11", 5);
  const Scene scene = ordinary_scene();
  ImageF picture = photograph(pattern, scene, 64, 1);
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 20; ++x) picture.at(x, y) *= 0.3F;  // a hard edge across the first sixth
  const std::optional<RefinedTag> tag = refine_tag(picture, PixelLayout::bayer_rg, pattern, scene.corners);
  ASSERT_TRUE(tag);
  EXPECT_LT(error_of(tag->corners_px, scene.corners).cwiseAbs().maxCoeff(), 0.4);
}

TEST(RefineTag, DoesNotConfirmAnotherTagOrPlainNoise) {
  const Scene scene = ordinary_scene();
  const ImageF picture = photograph(tag_pattern("tag36h11", 8), scene, 64, 1);
  const std::optional<RefinedTag> other =
      refine_tag(picture, PixelLayout::bayer_rg, tag_pattern("tag36h11", 9), scene.corners);
  EXPECT_LT(other ? other->right_cells : 0, 0.9);
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(0, 1);
  ImageF noise(64, 64, 1);
  for (float& v : noise.data) v = uniform(random);
  const std::optional<RefinedTag> ghost =
      refine_tag(noise, PixelLayout::mono, tag_pattern("tag36h11", 9), scene.corners);
  EXPECT_LT(ghost ? ghost->right_cells : 0, 0.9);
  EXPECT_FALSE(refine_tag(ImageF(64, 64, 1), PixelLayout::mono, tag_pattern("tag36h11", 9), scene.corners));
}

TEST(SmoothMosaic, HidesTheMosaicOfAnEvenColour) {
  ImageF mosaic(12, 9, 1);
  for (int y = 0; y < 9; ++y)
    for (int x = 0; x < 12; ++x) {
      static constexpr std::array<float, 3> colour{2.0F, 0.7F, 0.2F};
      mosaic.at(x, y) = colour[static_cast<std::size_t>(colour_at(PixelLayout::bayer_gr, x, y))];
    }
  for (const float v : smooth_mosaic(mosaic).data) EXPECT_NEAR(v, 0.25 * 2.0 + 0.5 * 0.7 + 0.25 * 0.2, 1e-6);
}

// A frame of tags of which the detector's ordinary pass cannot see all.
TEST(TagSearch, CompletesAFrameFromTheTagsThatWereFound) {
  SearchedTarget target{"tag36h11", {}};
  ImageF picture(260, 120, 1, 0.8F);
  for (int i = 0; i < 4; ++i) {
    const double x0 = 20 + 60.0 * i;
    const TagCorners corners{Eigen::Vector2d(x0, 80), Eigen::Vector2d(x0 + 40, 80), Eigen::Vector2d(x0 + 40, 40),
                             Eigen::Vector2d(x0, 40)};
    for (std::size_t k = 0; k < 4; ++k)
      target.corners_in_target[i][k] = {0.001 * corners[k].x(), -0.001 * corners[k].y(), 0};
    Scene scene{corners, {0.8, 0.8, 0.8}, 0.05, {0, 0}, 0.02};
    const ImageF tag = photograph(tag_pattern("tag36h11", i), scene, 260, static_cast<unsigned>(i));
    for (int y = 32; y < 88; ++y)
      for (int x = static_cast<int>(x0) - 7; x < static_cast<int>(x0) + 47; ++x) picture.at(x, y) = tag.at(x, y);
  }
  // A glare over two border cells of tag 2: no quad closes there, but most of its print is to be seen.
  for (int y = 36; y < 50; ++y)
    for (int x = 138; x < 150; ++x) picture.at(x, y) = 0.8F;
  TagSearchOptions options;
  TagSearch search(target, options);
  const std::vector<TagSighting> found = search.find(picture, PixelLayout::mono);
  ASSERT_EQ(found.size(), 4U);
  for (const TagSighting& tag : found)
    for (std::size_t k = 0; k < 4; ++k)
      EXPECT_LT(
          (tag.corners_px[k] - 1000 * Eigen::Vector2d(tag.corners_in_target[k].x(), -tag.corners_in_target[k].y()))
              .norm(),
          tag.id == 2 ? 1.0 : 0.1)
          << "the corner below the glare is extrapolated";
  options.complete = false;
  EXPECT_EQ(TagSearch(target, options).find(picture, PixelLayout::mono).size(), 3U);
}

}  // namespace
}  // namespace mf
