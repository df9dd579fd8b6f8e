// SPDX-License-Identifier: Apache-2.0
#include "device/detection.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <condition_variable>
#include <ctime>
#include <iostream>
#include <mutex>
#include <random>

#include "common/demosaic.h"
#include "common/error.h"
#include "device/clock.h"
#include "device/edge_alignment.h"
#include "tests/device/rendered_frames.h"

namespace mf {
namespace {

using test::add_errors;
using test::CornerErrors;
using test::RenderedFrames;

constexpr double knee = 0.05;  // a sensor that is logarithmic from a tenth of the paper's light on

const RenderedFrames& rendered() {
  static const RenderedFrames frames =
      exposed(test::rendered_views(512, 3, 8), {PixelLayout::bayer_rg, 12, false}, knee);
  return frames;
}

std::vector<int> mirror_ids() {
  std::vector<int> ids;
  for (const PlanarTag& tag : rendered().mirror.tags) ids.push_back(tag.id);
  return ids;
}

// Straight from the definition: linearize(), the binomial filter, and TagDetector's own stretch.
ImageF reference_luminance(const ImageU16& codes, const ResponseCurve& response, const PixelFormat& format) {
  Frame frame;
  frame.info.exposure_s = 1;
  frame.pixels = codes;
  return linearize(frame, format, response);
}

TEST(FrameLevels, LuminanceIsTheMeanOfTheCells) {
  const RenderedFrames& r = rendered();
  const FrameLevels levels(r.response, r.format);
  const ImageF cells = bin_cells(reference_luminance(r.frames[0].codes, r.response, r.format), r.format.layout);
  const ImageF found = levels.luminance(r.frames[0].codes, 4);
  ASSERT_EQ(found.width, 128);
  for (const auto& [x, y] : {std::pair(3, 5), std::pair(60, 70), std::pair(100, 50)}) {
    double sum = 0;
    for (int i = 0; i < 4; ++i) {
      const int cx = 2 * x + i % 2, cy = 2 * y + i / 2;
      sum += 0.25 * static_cast<double>(cells.at(cx, cy, 0) + 2 * cells.at(cx, cy, 1) + cells.at(cx, cy, 2)) / 4;
    }
    EXPECT_NEAR(static_cast<double>(found.at(x, y)), sum, 1e-5 * sum + 1e-9);
  }
}

// Every Bayer order of a grey ramp gives the ramp, to the rounding, also at the borders; nothing is shifted.
TEST(FrameLevels, TheMosaicVanishesAndNothingMoves) {
  for (const PixelLayout layout :
       {PixelLayout::bayer_rg, PixelLayout::bayer_gr, PixelLayout::bayer_gb, PixelLayout::bayer_bg}) {
    const PixelFormat format{layout, 12, false};
    ResponseCurve response = linear_response(12, 0, 1, 3);
    ImageU16 codes(64, 48, 1);
    for (int y = 0; y < 48; ++y)
      for (int x = 0; x < 64; ++x) {
        constexpr std::array<double, 3> balance{0.6, 1, 1.4};  // what the colours see of grey light
        codes.at(x, y) =
            static_cast<std::uint16_t>((200 + 20 * x) * balance[static_cast<std::size_t>(colour_at(layout, x, y))]);
      }
    const FrameLevels levels(response, format);
    const ImageF linear = levels.linear(codes, {0, 0, 64, 48});
    const ImageU8 out = levels.levels(codes, {0, 0, 64, 48});
    const double scale = static_cast<double>(linear.at(20, 20)) / (200 + 20 * 20);
    const double root = out.at(20, 20) / std::sqrt(200 + 20 * 20);
    for (int y = 0; y < 48; ++y)
      for (int x = 1; x < 62; ++x) {
        ASSERT_NEAR(static_cast<double>(linear.at(x, y)), scale * (200 + 20 * x), 1.2 * scale) << x << " " << y;
        ASSERT_NEAR(out.at(x, y), root * std::sqrt(200 + 20 * x), 3) << x << " " << y;
      }
  }
}

TEST(FrameLevels, ABoxIsThatPartOfTheFrame) {
  const RenderedFrames& r = rendered();
  const FrameLevels levels(r.response, r.format);
  const PixelBox box{160, 200, 240, 161};
  const ImageU8 part = levels.levels(r.frames[1].codes, box);
  ImageU16 cut(box.width, box.height, 1);
  for (int y = 0; y < box.height; ++y)
    std::copy_n(r.frames[1].codes.row(box.y + y).begin() + box.x, box.width, cut.row(y).begin());
  EXPECT_EQ(part.data, levels.levels(cut, {0, 0, box.width, box.height}).data);
}

// A dark square on bright paper, turned and antialiased, blurred by nothing else.
struct Square {
  ImageF picture{80, 80, 1};
  QuadCorners corners;
};

Square turned_square(const Eigen::Vector2d& centre, double turn) {
  constexpr double half = 17.4;
  const Eigen::Vector2d u(std::cos(turn), std::sin(turn)), v(-u.y(), u.x());
  Square out;
  constexpr int fine = 16;
  for (int y = 0; y < 80; ++y)
    for (int x = 0; x < 80; ++x)
      for (int i = 0; i < fine * fine; ++i) {
        const Eigen::Vector2d p(x + (i % fine + 0.5) / fine, y + (i / fine + 0.5) / fine);
        const bool dark = std::abs((p - centre).dot(u)) < half && std::abs((p - centre).dot(v)) < half;
        out.picture.at(x, y) += (dark ? 0.05F : 0.75F) / (fine * fine);
      }
  out.corners = {centre - half * u + half * v, centre + half * u + half * v, centre + half * u - half * v,
                 centre - half * u - half * v};
  return out;
}

TEST(EdgeAlignment, FindsTheCornersOfASquare) {
  const Eigen::Vector2d centre(40.3, 37.8);
  const Square square = turned_square(centre, 0.3);
  QuadCorners start = square.corners;
  for (Eigen::Vector2d& corner : start) corner += 0.05 * (centre - corner) + Eigen::Vector2d(0.3, -0.4);
  const std::optional<QuadCorners> found = align_edges(square.picture, start, 2);
  ASSERT_TRUE(found);
  for (std::size_t k = 0; k < 4; ++k) EXPECT_LT(((*found)[k] - square.corners[k]).norm(), 0.02) << k;
  EXPECT_FALSE(align_edges(ImageF(80, 80, 1, 0.5F), start, 2));
  for (Eigen::Vector2d& corner : start) corner += Eigen::Vector2d(30, 0);
  EXPECT_FALSE(align_edges(square.picture, start, 2));
}

// Noise of a fifth of the light.
TEST(EdgeAlignment, NoiseBesideAnEdgeDoesNotPullIt) {
  std::mt19937 random(1);
  std::normal_distribution<float> normal;
  double squares = 0;
  constexpr int squares_count = 40;
  for (int i = 0; i < squares_count; ++i) {
    Square square = turned_square({40 + 0.13 * (i % 7), 40 - 0.17 * (i % 5)}, 0.04 * i);
    for (float& light : square.picture.data) light *= 1 + 0.2F * normal(random);
    const std::optional<QuadCorners> found = align_edges(square.picture, square.corners, 3);
    ASSERT_TRUE(found) << i;
    for (std::size_t k = 0; k < 4; ++k) squares += ((*found)[k] - square.corners[k]).squaredNorm();
  }
  const double rms_px = std::sqrt(squares / (4 * squares_count));
  std::cout << "corner RMS " << rms_px << " px\n";
  EXPECT_LT(rms_px, 0.10);
}

// Corners against the simulator's truth, of a detector that knows the response or takes the codes for light.
CornerErrors errors_of(const RenderedFrames& r, const ResponseCurve& response) {
  CornerErrors out;
  FrameDetector detector({}, response, r.format);
  for (std::size_t i = 0; i < r.frames.size(); ++i) add_errors(r, i, detector.detect(r.frames[i]).tags, out);
  return out;
}

// 0.10 px at 1024² is what the rig asks for, whatever its camera; the raw codes stand beside it.
TEST(FrameDetector, FindsTheCornersToATenthOfAPixel) {
  const test::RenderedViews views = test::rendered_views(1024, 2, 16);
  for (const PixelLayout layout : {PixelLayout::mono, PixelLayout::bayer_rg, PixelLayout::bayer_gb})
    for (const int bits : {10, 12}) {
      const RenderedFrames r = exposed(views, {layout, bits, false}, knee);
      const std::string format = pixel_format_name(r.format);
      const CornerErrors linear = errors_of(r, r.response);
      const CornerErrors codes =
          errors_of(r, linear_response(bits, r.response.black_level, 1, r.format.colour_channels()));
      std::cout << format << ": corner RMS linearized " << linear.rms_px << " px (" << linear.tags << " tags, "
                << linear.tags_in_sight << " of the mirror in sight), on raw codes " << codes.rms_px << " px ("
                << codes.tags << ")\n";
      EXPECT_LE(linear.rms_px, 0.10) << format;
      EXPECT_LT(linear.rms_px, 0.5 * codes.rms_px) << format;
      EXPECT_GE(linear.tags, linear.tags_in_sight) << format;
      EXPECT_EQ(linear.false_tags, 0) << format;
    }
}

// Tags of 22 pixels, and more noise.
TEST(FrameDetector, FindsSmallTags) {
  const CornerErrors found = errors_of(rendered(), rendered().response);
  std::cout << "corner RMS at 512² " << found.rms_px << " px (" << found.tags << " tags)\n";
  EXPECT_GT(found.tags, 0.85 * found.tags_in_sight);
  EXPECT_LE(found.false_tags, 1);
  EXPECT_LE(found.rms_px, 0.15);
}

// A hand's motion, the frame shifted step by step: near searches find what full ones find.
TEST(FrameDetector, FollowingLosesNoTag) {
  const RenderedFrames& r = rendered();
  DetectionOptions following;
  following.follow.ids = mirror_ids();
  FrameDetector full({}, r.response, r.format), near(following, r.response, r.format);
  int searches_near = 0;
  for (int step = 0; step < 24; ++step) {
    // Shifted by whole cells of the mosaic, up to 40 pixels a frame; a jump to another frame in between.
    CameraFrame frame = r.frames[step < 14 ? 0 : 2];
    const int shift = 2 * (step % 14 < 7 ? 10 * (step % 14) : 10 * (14 - step % 14));
    for (int y = 0; y < frame.codes.height; ++y)
      std::rotate(frame.codes.row(y).begin(), frame.codes.row(y).begin() + shift, frame.codes.row(y).end());
    const DetectedFrame all = full.detect(frame), found = near.detect(frame);
    searches_near += found.searched.width < frame.codes.width ? 1 : 0;
    std::size_t mirror_tags = 0, found_too = 0;
    for (const TagDetection& tag : all.tags) {
      if (r.mirror.find(tag.id) == nullptr) continue;
      ++mirror_tags;
      for (const TagDetection& other : found.tags)
        found_too += other.id == tag.id && (other.corners_px[0] - tag.corners_px[0]).norm() < 0.5 ? 1 : 0;
    }
    EXPECT_GT(mirror_tags, 10U) << step;
    EXPECT_GE(found_too + 1, mirror_tags) << step;  // one at the edge of what AprilTag reads may differ
  }
  EXPECT_GE(searches_near, 9);
}

TEST(TagFollower, SearchesEverywhereWhenItFindsTooLittle) {
  TagFollowerOptions options;
  options.ids = {1, 2, 3, 4, 5};
  TagFollower follower(options);
  const PixelBox whole{0, 0, 1000, 800};
  EXPECT_EQ(follower.next(1000, 800), whole);
  std::vector<TagDetection> tags;
  for (int id = 1; id <= 5; ++id) {
    TagDetection tag;
    tag.id = id;
    for (Eigen::Vector2d& corner : tag.corners_px) corner = {400.0 + 20 * id, 300.0 + 10 * id};
    tags.push_back(tag);
  }
  EXPECT_TRUE(follower.accept(whole, whole, tags));
  const PixelBox near = follower.next(1000, 800);
  EXPECT_LT(near.width, 300);
  EXPECT_LT(near.x, 400);
  EXPECT_GT(near.x + near.width, 500);
  EXPECT_EQ(near.x % 8, 0);
  EXPECT_FALSE(follower.accept(near, whole, std::span(tags).first(3)));
  EXPECT_TRUE(follower.accept(whole, whole, std::span(tags).first(3)));
  EXPECT_TRUE(follower.accept(follower.next(1000, 800), whole, std::span(tags).first(3)));
  int nearby = 0;
  for (int i = 0; i < 40; ++i) {
    const PixelBox box = follower.next(1000, 800);
    nearby += box == whole ? 0 : 1;
    EXPECT_TRUE(follower.accept(box, whole, std::span(tags).first(3)));
  }
  EXPECT_NEAR(nearby, 35, 2);  // each eighth is full
}

TEST(Detection, OptionsAreChecked) {
  DetectionOptions options;
  options.duty = 0;
  EXPECT_THROW(FrameDetector(options, rendered().response, rendered().format), InputError);
  options = {};
  options.picture_reduction = 3;
  EXPECT_TRUE(options.validate());
}

// The capturing thread offers 100 frames a second: it is never kept waiting, and the detector keeps to its share.
TEST(Detection, NeverBlocksAndKeepsItsDuty) {
  const RenderedFrames& r = rendered();
  DetectionOptions options;
  options.duty = 0.2;
  std::mutex mutex;
  std::vector<std::int64_t> seen;
  double busy_ms = 0;
  const std::int64_t process_before = clock_ns(CLOCK_PROCESS_CPUTIME_ID);
  const std::int64_t own_before = clock_ns(CLOCK_THREAD_CPUTIME_ID);
  const std::int64_t start = clock_ns(CLOCK_MONOTONIC);
  {
    Detection detection(options, r.response, r.format, [&](const DetectedFrame& frame) {
      const std::lock_guard lock(mutex);
      seen.push_back(frame.arrival.device_frame);
      busy_ms += frame.milliseconds;
    });
    CameraFrame frame = r.frames[0];
    int taken = 0;
    for (int i = 1; i <= 150; ++i) {
      frame.arrival.device_frame = i;
      taken += detection.offer(frame) ? 1 : 0;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    const DetectionCounts counts = detection.counts();
    EXPECT_EQ(counts.offered, 150);
    EXPECT_EQ(counts.offered - counts.skipped, taken);
    EXPECT_LE(taken - counts.detected, 1);
    EXPECT_GE(taken, 3);
  }
  const double seconds = 1e-9 * static_cast<double>(clock_ns(CLOCK_MONOTONIC) - start);
  const double own = 1e-9 * static_cast<double>(clock_ns(CLOCK_THREAD_CPUTIME_ID) - own_before);
  const double all = 1e-9 * static_cast<double>(clock_ns(CLOCK_PROCESS_CPUTIME_ID) - process_before);
  EXPECT_GE(own, 0);
  EXPECT_LE(all - own, 0.2 * seconds + 0.1);  // the last frame's pause is cut short
  EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end()));
  EXPECT_NEAR(busy_ms / 1e3, all - own, 0.5 * (all - own) + 0.02);
}

TEST(Detection, EndsAtOnceWhileItPauses) {
  const RenderedFrames& r = rendered();
  DetectionOptions options;
  options.duty = 0.001;  // a pause of some ten seconds
  const std::int64_t start = clock_ns(CLOCK_MONOTONIC);
  {
    Detection detection(options, r.response, r.format, [](const DetectedFrame&) {});
    EXPECT_TRUE(detection.offer(r.frames[0]));
    while (detection.counts().detected == 0) std::this_thread::sleep_for(std::chrono::milliseconds(2));
    EXPECT_FALSE(detection.offer(r.frames[1]));
  }
  EXPECT_LT(1e-9 * static_cast<double>(clock_ns(CLOCK_MONOTONIC) - start), 5);
}

TEST(Preview, ShowsShadows) {
  ImageF luminance(10, 10, 1, 0.25F);
  luminance.at(3, 3) = 1000;
  luminance.at(4, 4) = 0;
  for (int x = 0; x < 10; ++x) luminance.at(x, 9) = 1;
  const ImageU8 grey = preview_of(luminance);
  EXPECT_EQ(grey.at(0, 9), 255);
  EXPECT_NEAR(grey.at(0, 0), 128, 1);
  EXPECT_EQ(grey.at(3, 3), 255);
  EXPECT_EQ(grey.at(4, 4), 0);
}

}  // namespace
}  // namespace mf
