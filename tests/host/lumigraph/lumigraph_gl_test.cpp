// SPDX-License-Identifier: Apache-2.0
// The two back ends make one picture: each is the other's reference. Skipped (77) where there is no OpenGL.
#include "host/lumigraph/lumigraph_gl.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <variant>

#include "host/gl/backend.h"
#include "host/lumigraph/frame_renderer.h"
#include "host/lumigraph/leave_one_out.h"
#include "tests/host/lumigraph/made_photos.h"
#include "tests/support/gl_test.h"

namespace mf {
namespace {

using test::blotches;
using test::looking;
using test::pinhole;

CameraModel distorted_camera(int size_px) {
  CameraModel camera = pinhole(size_px, 50);
  const double f = 1.07 * size_px;
  camera.parameters = {f, 1.01 * f, 0.49 * size_px, 0.52 * size_px, -0.12, 0.03, 0.001, -0.002, 0};
  return camera;
}

Proxy ball() {
  return MeshProxy(test::bumpy_ball_on_floor(48));
}

enum class Kind { codes, linear };

PhotoSet photos_of(const std::vector<View>& views, Kind kind) {
  const Proxy walls = ball();
  PhotoSet set;
  set.source = "made";
  for (std::size_t i = 0; i < views.size(); ++i) {
    set.photos.push_back(test::photo_of(std::to_string(i), views[i], walls, blotches(0.2F)));
    Picture& picture = set.photos.back().picture;
    if (kind == Kind::codes) picture = test::codes_of(std::get<ImageF>(picture));
  }
  return set;
}

View new_view(const CameraModel& camera) {
  return {camera, looking({1.5, -2, 2.5}, {0, 0, -0.3})};
}

// Of two pictures of one size.
struct Difference {
  double psnr_db = 0;    // over all pixels
  double off = 0;        // share of the pixels in which a channel differs by more than 2/255
  double uncovered = 0;  // share that one of them covers otherwise
};

Difference difference_of(const LumigraphPicture& a, const LumigraphPicture& b) {
  const std::size_t pixels = a.covered.data.size();
  Difference d;
  std::visit(
      [&]<typename T>(const Image<T>& x) {
        const auto& y = std::get<Image<T>>(b.picture);
        const float full = std::is_integral_v<T> ? 255.0F : 1.0F;
        for (std::size_t i = 0; i < pixels; ++i) {
          float largest = 0;
          for (std::size_t c = 0; c < 3; ++c)
            largest = std::max(
                largest,
                std::abs(static_cast<float>(x.data[3 * i + c]) - static_cast<float>(y.data[3 * i + c])) / full);
          d.off += largest > 2.0F / 255 ? 1 : 0;
          d.uncovered += a.covered.data[i] != b.covered.data[i] ? 1 : 0;
        }
      },
      a.picture);
  d.off /= static_cast<double>(pixels);
  d.uncovered /= static_cast<double>(pixels);
  d.psnr_db = psnr_db(a.picture, b.picture, ImageU8(a.covered.width, a.covered.height, 1, Covered::seen));
  return d;
}

double covered(const LumigraphPicture& picture) {
  const auto& data = picture.covered.data;
  return 1 - static_cast<double>(std::count(data.begin(), data.end(), static_cast<std::uint8_t>(Covered::nothing))) /
                 static_cast<double>(data.size());
}

class LumigraphOnGl : public test::GlTest {
 protected:
  // Outlines are where a mesh may be met a pixel away.
  void expect_same(const Lumigraph& lumigraph, const View& view, const LumigraphOptions& options, double outlines,
                   std::span<const std::uint32_t> views = {}) {
    const LumigraphPicture on_cpu = lumigraph.render(view, options, views);
    const LumigraphPicture on_gl = GlLumigraph(*context_, lumigraph).render(view, options, views);
    const Difference d = difference_of(on_gl, on_cpu);
    const std::string proxy = describe(lumigraph.proxy());
    EXPECT_GT(covered(on_cpu), 0.5) << proxy;
    EXPECT_GT(d.psnr_db, 45) << proxy;
    EXPECT_LE(d.off, outlines) << proxy;
    EXPECT_LE(d.uncovered, outlines) << proxy;
    RecordProperty(fmt::format("comparison_{}", ++comparisons_),
                   fmt::format("{}: {:.1f} dB, {:.3f} % off, {:.3f} % covered otherwise", proxy, d.psnr_db, 100 * d.off,
                               100 * d.uncovered));
  }

  int comparisons_ = 0;
};

constexpr double rounding = 2e-4;  // of the pixels: a photo at the threshold, on one side of it or the other
constexpr double outlines = 1e-3;

TEST_F(LumigraphOnGl, APlaneWithMorePhotosThanAUniformBlockHolds) {
  const PhotoSet set = photos_of(test::cap_of_views(400, 4, 60, pinhole(64, 45)), Kind::codes);
  expect_same(Lumigraph(set, PlaneProxy{Eigen::Vector3f(0.1F, -0.1F, 1).normalized(), 0.4F}),
              new_view(pinhole(200, 45)), {}, rounding);
}

TEST_F(LumigraphOnGl, ABoxAndASphereSeenFromInside) {
  const PhotoSet set = photos_of(test::cap_of_views(330, 4, 60, pinhole(64, 45)), Kind::linear);
  BoxProxy box;
  box.box_from_world.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 3).normalized()));
  box.low = {-6, -5, -std::numeric_limits<float>::infinity()};
  box.high = {5, std::numeric_limits<float>::infinity(), 7};
  expect_same(Lumigraph(set, box), new_view(pinhole(150, 60)), {}, rounding);
  expect_same(Lumigraph(set, SphereProxy{{0.1F, 0, -0.2F}, 6}), new_view(pinhole(150, 60)), {}, rounding);
}

TEST_F(LumigraphOnGl, AMeshThatHidesItself) {
  const PhotoSet set = photos_of(test::cap_of_views(310, 4, 60, pinhole(96, 45)), Kind::codes);
  const Lumigraph lumigraph(set, ball());
  expect_same(lumigraph, new_view(pinhole(200, 50)), {}, outlines);
  LumigraphOptions options;
  options.penalty = {9, 1, 0.3F, 0.8F};
  options.border = 0.1F;
  expect_same(lumigraph, new_view(distorted_camera(200)), options, outlines);
}

TEST_F(LumigraphOnGl, PhotosThatDistortAndAreMasked) {
  PhotoSet set = photos_of(test::cap_of_views(40, 4, 50, distorted_camera(160)), Kind::linear);
  for (std::size_t i = 0; i < set.photos.size(); i += 2) {
    ImageU8& mask = set.photos[i].mask = ImageU8(160, 160, 1, 255);
    for (int y = 0; y < 160; ++y)
      for (int x = 0; x < 70; ++x) mask.at(x, y) = 0;
  }
  expect_same(Lumigraph(set, ball()), new_view(distorted_camera(180)), {}, outlines);
  expect_same(Lumigraph(set, PlaneProxy{Eigen::Vector3f::UnitZ(), 0}), new_view(distorted_camera(180)), {}, rounding);
}

TEST_F(LumigraphOnGl, WallsAreLookedThroughFromOutside) {
  const PhotoSet set = photos_of(test::cap_of_views(30, 4, 40, pinhole(96, 45)), Kind::linear);
  const Lumigraph lumigraph(set, MeshProxy(test::bumpy_ball_on_floor(48), Eigen::Vector3f(0, 0, 0)));
  expect_same(lumigraph, new_view(pinhole(160, 50)), {}, outlines);
}

TEST_F(LumigraphOnGl, MomentsAndChosenPhotos) {
  PhotoSet set = photos_of(test::cap_of_views(60, 4, 60, pinhole(96, 45)), Kind::codes);
  for (std::size_t i = 0; i < set.photos.size(); ++i) set.photos[i].time_s = 0.1 * static_cast<double>(i % 10);
  LumigraphOptions options;
  options.moment = Moment{0.93, 1.0, 4.0};
  const Lumigraph lumigraph(set, PlaneProxy{Eigen::Vector3f::UnitZ(), 0.5F});
  expect_same(lumigraph, new_view(pinhole(160, 45)), options, rounding);
  std::vector<std::uint32_t> some;
  for (std::uint32_t i = 1; i < 60; i += 3) some.push_back(i);
  expect_same(lumigraph, new_view(pinhole(160, 45)), {}, rounding, some);
  const std::vector<std::uint32_t> two{7, 30};  // fewer than k
  expect_same(lumigraph, new_view(pinhole(160, 45)), {}, rounding, two);
}

TEST_F(LumigraphOnGl, WhichPhotosSpeakIsShownInTheSameColours) {
  const PhotoSet set = photos_of(test::cap_of_views(80, 4, 60, pinhole(64, 45)), Kind::linear);
  LumigraphOptions options;
  options.shown = Shown::blending_field;
  expect_same(Lumigraph(set, PlaneProxy{Eigen::Vector3f::UnitZ(), 0.5F}), new_view(pinhole(160, 45)), options,
              rounding);
}

// Epipole consistency: whatever the proxy, a photo's own place gives its picture.
TEST_F(LumigraphOnGl, ASourceCameraReturnsItsPhoto) {
  const std::vector<View> views = test::cap_of_views(12, 4, 40, distorted_camera(160));
  const PhotoSet set = photos_of(views, Kind::linear);
  std::vector<Proxy> proxies;
  proxies.emplace_back(ball());
  proxies.emplace_back(PlaneProxy{Eigen::Vector3f(0.2F, -0.1F, 1).normalized(), 0.6F});
  for (Proxy& proxy : proxies) {
    const std::string name = describe(proxy);
    const Lumigraph lumigraph(set, std::move(proxy));
    const GlLumigraph frames(*context_, lumigraph);
    for (const std::size_t i : {0U, 5U, 11U}) {
      const LumigraphPicture picture = frames.render(views[i], {});
      EXPECT_GT(covered(picture), 0.6) << name;
      ImageU8 all = picture.covered;
      for (auto& c : all.data)
        if (c != Covered::nothing) c = Covered::seen;
      EXPECT_GT(psnr_db(picture.picture, set.photos[i].picture, all), 45) << name << ", photo " << i;
    }
  }
}

// The renderer that commands use takes either back end.
TEST_F(LumigraphOnGl, PhotosAreForetoldAlike) {
  const PhotoSet set = photos_of(test::cap_of_views(8, 4, 30, pinhole(128, 45)), Kind::codes);
  const Lumigraph lumigraph(set, ball());
  const LeaveOneOut on_cpu = leave_one_out(lumigraph, set, {});
  const FrameRenderer renderer(lumigraph, open_backend(Backend::gl));
  EXPECT_NE(renderer.description().find("gl ("), std::string::npos);
  const LeaveOneOut on_gl = leave_one_out(renderer, set, {});
  for (std::size_t i = 0; i < set.photos.size(); ++i) {
    EXPECT_NEAR(on_gl.views[i].psnr_db, on_cpu.views[i].psnr_db, 0.15) << i;
    EXPECT_NEAR(on_gl.views[i].covered, on_cpu.views[i].covered, 0.01) << i;
  }
}

}  // namespace
}  // namespace mf
