// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/lumigraph.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numeric>
#include <random>

#include "host/lumigraph/leave_one_out.h"
#include "host/lumigraph/tile_renderer.h"
#include "tests/host/lumigraph/made_photos.h"

namespace mf {
namespace {

using test::blotches;
using test::looking;
using test::pinhole;
using test::true_picture;

Proxy ball() {
  return MeshProxy(test::bumpy_ball_on_floor(48));
}

PhotoSet photos_of(const std::vector<View>& views, const Proxy& walls, const test::Paint& paint) {
  PhotoSet set;
  set.source = "made";
  for (std::size_t i = 0; i < views.size(); ++i)
    set.photos.push_back(test::photo_of(std::to_string(i), views[i], walls, paint));
  return set;
}

CameraModel distorted_camera() {
  CameraModel camera = pinhole(160, 50);
  camera.parameters = {170, 172, 78, 83, -0.12, 0.03, 0.001, -0.002, 0};
  return camera;
}

// Epipole consistency: whatever the proxy, a photo's own place gives its picture.
TEST(Lumigraph, ASourceCameraReturnsItsPhotoWithAnyProxy) {
  const Proxy walls = ball();
  const std::vector<View> views = test::cap_of_views(12, 4, 40, distorted_camera());
  const PhotoSet set = photos_of(views, walls, blotches(0.25F));
  std::vector<Proxy> proxies;
  proxies.emplace_back(ball());
  proxies.emplace_back(PlaneProxy{Eigen::Vector3f(0.2F, -0.1F, 1).normalized(), 0.6F});
  proxies.emplace_back(SphereProxy{Eigen::Vector3f::Zero(), 9});
  BoxProxy box;
  box.low.setConstant(-5);
  box.high.setConstant(5);
  proxies.emplace_back(box);
  for (Proxy& proxy : proxies) {
    const std::string name = describe(proxy);
    const Lumigraph lumigraph(set, std::move(proxy));
    for (const std::size_t i : {0U, 5U, 11U}) {
      const LumigraphPicture picture = lumigraph.render(views[i], {});
      const auto covered = static_cast<double>(std::count(picture.covered.data.begin(), picture.covered.data.end(),
                                                          static_cast<std::uint8_t>(Covered::seen)));
      EXPECT_GT(covered / static_cast<double>(picture.covered.data.size()), 0.6) << name;
      ImageU8 all = picture.covered;
      for (auto& c : all.data)
        if (c != Covered::nothing) c = Covered::seen;  // what lies at silhouettes is its own photo's too
      EXPECT_GT(psnr_db(picture.picture, set.photos[i].picture, all), 45) << name << ", photo " << i;
    }
  }
}

// Resolution that no photo has is asked of none: a picture finer than the photos still has its own photo alone.
TEST(Lumigraph, AFinerPictureFromAPhotosPlaceIsThatPhotos) {
  const Proxy walls = ball();
  const std::vector<View> views = test::cap_of_views(12, 4, 40, pinhole(100, 50));
  const Lumigraph lumigraph(photos_of(views, walls, blotches(0.25F)), ball());
  const View finer{pinhole(300, 50), views[5].cam_from_world};
  for (double x = 100.5; x < 200; x += 20) {
    const auto weights = lumigraph.weights_at(finer, {x, 150.5}, {});
    ASSERT_FALSE(weights.empty());
    EXPECT_EQ(weights.front().view, 5U);
    EXPECT_GT(weights.front().weight, 0.999F);
  }
}

// Independent of the renderer: the penalties of every photo in double precision, from their definition.
std::map<std::uint32_t, double> reference_weights(const std::vector<View>& views, const View& wanted,
                                                  const Eigen::Vector3d& x, const Eigen::Vector3d& normal,
                                                  const LumigraphOptions& o) {
  const auto focal2 = [](const View& view) { return view.camera.fx() * view.camera.fy(); };
  double finest = 0;
  for (const View& view : views) finest = std::max(finest, focal2(view));
  const auto area = [&](const View& view) {
    const Eigen::Vector3d to = x - view.cam_from_world.inverse().translation;
    const double z = (view.cam_from_world * x).z();
    return std::min(focal2(view), finest) * std::abs(normal.dot(to)) / (z * z * z);
  };
  const Eigen::Vector3d along = (x - wanted.cam_from_world.inverse().translation).normalized();
  std::vector<std::pair<double, std::uint32_t>> penalties;
  for (std::uint32_t i = 0; i < views.size(); ++i) {
    const View& view = views[i];
    if (!((view.cam_from_world * x).z() > 0)) continue;
    const Eigen::Vector2d pixel = view.camera.project(view.cam_from_world * x);
    const auto ramp = [&](double at, int size) {
      const double t = std::clamp(
          std::min(at, size - at) / (static_cast<double>(o.border) * std::min(view.camera.width, view.camera.height)),
          0.0, 1.0);
      return t * t * (3 - 2 * t);
    };
    const double weight = std::pow(ramp(pixel.x(), view.camera.width) * ramp(pixel.y(), view.camera.height), 2);
    if (!(weight > 0)) continue;
    const double chord = ((x - view.cam_from_world.inverse().translation).normalized() - along).norm();
    const double octaves = std::max(0.0, 0.5 * std::log2(area(wanted) / area(view)));
    penalties.emplace_back(
        (o.penalty.angle * chord + o.penalty.resolution * octaves) / std::pow(weight, o.penalty.border), i);
  }
  std::sort(penalties.begin(), penalties.end());
  const auto k = static_cast<std::size_t>(o.penalty.k);
  std::map<std::uint32_t, double> weights;
  double sum = 0;
  for (std::size_t i = 0; i < std::min(k, penalties.size()); ++i) {
    const double fade = penalties.size() > k ? 1 - penalties[i].first / penalties[k].first : 1;
    sum += weights[penalties[i].second] = fade / penalties[i].first;
  }
  for (auto& [view, weight] : weights) weight /= sum;
  return weights;
}

// Tiles and blocks drop photos; the picture must be as if every pixel had ranked them all.
TEST(Lumigraph, EveryPixelHasTheWeightsOfRankingAllPhotos) {
  const std::vector<View> views = test::cap_of_views(300, 4, 50, pinhole(64, 40));
  const PlaneProxy plane{Eigen::Vector3f(0.1F, 0.2F, 1).normalized(), 0.1F};
  PhotoSet set;
  for (std::size_t i = 0; i < views.size(); ++i)
    set.photos.push_back({std::to_string(i), views[i].camera, views[i].cam_from_world, ImageU8(64, 64, 3), {}, {}});
  const Lumigraph lumigraph(set, plane);
  const View wanted{pinhole(150, 45), looking({0.7, -0.9, 3.1}, {0.1, 0, 0})};
  for (const float beta : {0.0F, 0.3F}) {
    LumigraphOptions options;
    options.penalty.resolution = beta;
    std::mt19937 random(1);
    std::uniform_int_distribution<int> at(0, 149);
    for (int i = 0; i < 300; ++i) {
      const Eigen::Vector2d pixel(at(random) + 0.5, at(random) + 0.5);
      const auto x = lumigraph.point_at(wanted, pixel);
      ASSERT_TRUE(x);
      const auto expected = reference_weights(views, wanted, *x, plane.normal.cast<double>(), options);
      double difference = 0;
      for (const auto& [view, weight] : lumigraph.weights_at(wanted, pixel, options))
        difference += std::abs(weight - (expected.count(view) != 0 ? expected.at(view) : 0));
      EXPECT_LT(difference, 5e-3) << pixel.transpose() << ", beta " << beta;
    }
  }
}

// The picture against one pixel at a time, which no tile or block can mislead.
void expect_weights_of_pixels(const Lumigraph& lumigraph, const View& wanted) {
  const LumigraphPicture picture = lumigraph.render(wanted, {});
  for (int y = 1; y < wanted.camera.height; y += 3)
    for (int x = 0; x < wanted.camera.width; x += 3) {
      const LumigraphPicture alone = lumigraph.render(pixel_of_view(wanted, {x + 0.5, y + 0.5}), {});
      ASSERT_EQ(alone.covered.data[0], picture.covered.at(x, y)) << x << ", " << y;
      for (int c = 0; c < 3; ++c)
        ASSERT_NEAR(std::get<ImageF>(alone.picture).at(0, 0, c), std::get<ImageF>(picture.picture).at(x, y, c), 2e-4)
            << x << ", " << y;
    }
}

// With a mesh, where depth jumps inside of blocks and photos hide points from each other.
TEST(Lumigraph, APictureHasTheWeightsOfItsPixels) {
  const Proxy walls = ball();
  const std::vector<View> views = test::cap_of_views(80, 4, 60, pinhole(64, 40));
  const Lumigraph lumigraph(photos_of(views, walls, blotches(0.4F)), ball());
  expect_weights_of_pixels(lumigraph, {pinhole(96, 50), looking({1.5, -2, 2.5}, {0, 0, -0.3})});
}

// From their place nearly all of a tile needs no other photo, and its bound is next to 0.
TEST(Lumigraph, OtherPhotosSpeakWhereThoseOfThePlaceAreMasked) {
  const Proxy walls = ball();
  std::vector<View> views = test::cap_of_views(40, 4, 60, pinhole(96, 40));
  const View wanted = views[20];
  views.insert(views.end(), 6, wanted);
  PhotoSet set = photos_of(views, walls, blotches(0.4F));
  ImageU8 mask(96, 96, 1, 255);
  for (int y = 34; y < 46; ++y)
    for (int x = 50; x < 80; ++x) mask.at(x, y) = 0;
  for (const std::size_t i : {20U, 40U, 41U, 42U, 43U, 44U, 45U}) set.photos[i].mask = mask;
  expect_weights_of_pixels(Lumigraph(set, ball()), wanted);
}

TEST(Lumigraph, NewViewsOfAKnownShapeAreTheTruth) {
  const Proxy walls = ball();
  const auto paint = blotches(0.4F);
  const std::vector<View> views = test::cap_of_views(40, 4, 60, pinhole(200, 45));
  const Lumigraph lumigraph(photos_of(views, walls, paint), ball());
  const View wanted{pinhole(200, 40), looking({1.1, -1.4, 3.2}, {0, 0, -0.2})};
  const LumigraphPicture picture = lumigraph.render(wanted, {});
  EXPECT_GT(psnr_db(picture.picture, true_picture(wanted, walls, paint), picture.covered), 38);
}

// Nothing of the ball may appear on the floor that it hides from a photo.
TEST(Lumigraph, HiddenPointsGetNoForeground) {
  const Proxy walls = ball();
  const test::Paint paint = [](const Eigen::Vector3f& x) {
    return x.z() < -1.1F ? Eigen::Vector3f(0, 1, 0) : Eigen::Vector3f(1, 0, 0);
  };
  const Lumigraph lumigraph(photos_of(test::cap_of_views(30, 4, 65, pinhole(200, 60)), walls, paint), ball());
  const View wanted{pinhole(200, 60), looking({2.6, 0.4, 2.2}, {0, 0, -0.6})};
  const ImageF truth = true_picture(wanted, walls, paint);
  const LumigraphPicture picture = lumigraph.render(wanted, {});
  int floor = 0;
  for (int y = 0; y < 200; ++y)
    for (int x = 0; x < 200; ++x) {
      if (truth.at(x, y, 1) != 1 || picture.covered.at(x, y) != Covered::seen) continue;
      ++floor;
      EXPECT_LT(std::get<ImageF>(picture.picture).at(x, y, 0), 0.05F) << x << ", " << y;
    }
  EXPECT_GT(floor, 5000);
}

// In the manner of the paper's hallway: photos from far behind on the axis, whose rays deviate least where the corridor
// is far, and photos from beside the new view, which saw it finely.
TEST(Lumigraph, AHallwayIsDrawnFromThePhotosThatSawItFinely) {
  BoxProxy hall;
  hall.low = {-1, -1, -9};
  hall.high = {1, 1, 24};
  const auto paint = blotches(0.25F);
  std::vector<View> views;
  for (int i = 0; i < 6; ++i) views.push_back({pinhole(200, 60), looking({0.02 * i, 0, -8 + 1.2 * i}, {0, 0, 60})});
  for (int i = 0; i < 6; ++i)
    views.push_back({pinhole(200, 60), looking({0.5 * std::cos(1.05 * i), 0.5 * std::sin(1.05 * i), 6}, {0, 0, 60})});
  PhotoSet set;
  for (std::size_t i = 0; i < views.size(); ++i)
    set.photos.push_back(test::photo_of(std::to_string(i), views[i], hall, paint, 3));
  const Lumigraph lumigraph(set, hall);
  const View wanted{pinhole(200, 60), looking({0, 0, 6.1}, {0, 0, 60})};
  const ImageF truth = true_picture(wanted, hall, paint, 3);
  LumigraphOptions without;
  without.penalty.resolution = 0;
  const LumigraphPicture plain = lumigraph.render(wanted, without);
  const LumigraphPicture sharp = lumigraph.render(wanted, {});
  EXPECT_GT(psnr_db(sharp.picture, truth, sharp.covered), psnr_db(plain.picture, truth, plain.covered) + 1);
}

TEST(Lumigraph, AMaskedPhotoSaysNothingThere) {
  const PlaneProxy plane{Eigen::Vector3f::UnitZ(), 0};
  PhotoSet set;
  for (const View& view : test::cap_of_views(2, 4, 10, pinhole(64, 40))) {
    const auto level = static_cast<std::uint8_t>(set.photos.empty() ? 40 : 200);
    set.photos.push_back({std::to_string(level), view.camera, view.cam_from_world, ImageU8(64, 64, 3, level), {}, {}});
  }
  set.photos[0].mask = ImageU8(64, 64, 1, 0);
  const Lumigraph lumigraph(set, plane);
  const LumigraphPicture picture = lumigraph.render({set.photos[0].camera, set.photos[0].cam_from_world}, {});
  const auto& codes = std::get<ImageU8>(picture.picture);
  EXPECT_EQ(codes.at(32, 32, 0), 200);
}

TEST(Lumigraph, OptionsThatMeanNothingAreNamed) {
  LumigraphOptions options;
  options.border = 0.7F;
  EXPECT_NE(options.validate().value_or("").find("border"), std::string::npos);
  options = {};
  options.penalty.k = 0;
  EXPECT_NE(options.validate().value_or("").find("k:"), std::string::npos);
  EXPECT_NE((VisibilityOptions{2, 4}.validate().value_or("").find("tolerance")), std::string::npos);
}

}  // namespace
}  // namespace mf
