// SPDX-License-Identifier: Apache-2.0
#include "host/viewer/lumigraph_view.h"

#include <gtest/gtest.h>

#include "tests/host/viewer/viewer_photos.h"

namespace mf {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using test::view_from;
using test::wall_distance_m;
using test::wall_photo_x;
using test::wall_photos;
using test::wall_picture;

const PlaneProxy wall{Eigen::Vector3f::UnitY(), static_cast<float>(wall_distance_m)};

LumigraphView wall_view() {
  return LumigraphView(Lumigraph(wall_photos(), wall));
}

// Mean difference in codes over the middle of the pictures: their rims show what no photo saw.
double mean_difference(const ImageU8& a, const ImageU8& b) {
  double sum = 0;
  int count = 0;
  for (int y = a.height / 5; y < a.height - a.height / 5; ++y)
    for (int x = a.width / 5; x < a.width - a.width / 5; ++x)
      for (int c = 0; c < 3; ++c, ++count) sum += std::abs(a.at(x, y, c) - b.at(x, y, c));
  return sum / count;
}

Vector3d centre(const LumigraphView& view) {
  return view.navigation().world_from_cam.translation;
}

TEST(LumigraphView, StartsAtTheMiddlePhotoUpright) {
  const LumigraphView view = wall_view();
  EXPECT_LT(centre(view).norm(), 1e-9);
  EXPECT_TRUE(view.navigation().up_in_world.isApprox(Vector3d::UnitZ()));
  EXPECT_NEAR(view.navigation().focus_distance, wall_distance_m, 1e-5);
  EXPECT_NEAR(view.aspect(), 160.0 / 120, 1e-12);
  EXPECT_EQ(view.view(320).camera.height, 240);
  EXPECT_NEAR(view.view(320).camera.fx(), 300, 1e-9);
}

TEST(LumigraphView, JumpsToAPhotoAndShowsIt) {
  LumigraphView view = wall_view();
  view.jump(4);
  EXPECT_TRUE(centre(view).isApprox(Vector3d(wall_photo_x(4), 0, 0)));
  EXPECT_LT(mean_difference(view.render(view.view(160), 0), wall_picture(view_from(wall_photo_x(4)))), 1);
}

TEST(LumigraphView, IsSharpWhereItIsFocused) {
  LumigraphView view = wall_view();
  view.navigate(moved(view.navigation(), {0.15, 0, 0}));
  const ImageU8 truth = wall_picture(view_from(0.15));
  EXPECT_LT(mean_difference(view.render(view.view(160), 0), truth), 1.5);
  view.focus_at(1);
  EXPECT_NEAR(view.depth_ahead(), 1, 1e-5);
  EXPECT_GT(mean_difference(view.render(view.view(160), 0), truth), 6);
  view.focus_at(wall_distance_m);
  EXPECT_LT(mean_difference(view.render(view.view(160), 0), truth), 1.5);
}

TEST(LumigraphView, TurnsThePlaneToTheCamera) {
  LumigraphView view = wall_view();
  view.navigate(orbited(view.navigation(), 0.3, 0));
  view.face_plane();
  const auto& plane = std::get<PlaneProxy>(view.lumigraph().proxy());
  EXPECT_TRUE(plane.normal.isApprox(Eigen::Vector3f(-std::sin(0.3F), std::cos(0.3F), 0), 1e-5F))
      << plane.normal.transpose();
  EXPECT_NEAR(view.depth_ahead(), wall_distance_m, 1e-5);
}

// The pivot lies on what the middle of the picture shows: orbiting keeps its colour there.
TEST(LumigraphView, OrbitsAboutWhatItShows) {
  LumigraphView view = wall_view();
  view.navigate(moved(view.navigation(), {0, 0, 1}));
  view.grab();
  EXPECT_NEAR(view.navigation().focus_distance, wall_distance_m - 1, 1e-5);
  const auto middle = [&] {
    const ImageU8 picture = view.render(view.view(161), 0);
    return Vector3d(picture.at(80, 60, 0), picture.at(80, 60, 1), picture.at(80, 60, 2));
  };
  const Vector3d before = middle();
  view.navigate(orbited(view.navigation(), 0.2, 0.1));
  EXPECT_LT((middle() - before).cwiseAbs().maxCoeff(), 4) << before.transpose() << " became " << middle().transpose();
}

TEST(LumigraphView, TellsWhoSpeaks) {
  LumigraphView view = wall_view();
  view.jump(3);
  const auto alone = view.weights_at({0.4, 0.6}, 160);
  ASSERT_FALSE(alone.empty());
  EXPECT_EQ(alone.front().view, 3U);
  EXPECT_GT(alone.front().weight, 0.99F);
  view.navigate(moved(view.navigation(), {-0.15, 0, 0}));
  float sum = 0;
  for (const ViewWeight& w : view.weights_at({0.5, 0.5}, 160)) sum += w.weight;
  EXPECT_NEAR(sum, 1, 1e-5);
  EXPECT_NEAR(view.weights_at({0.5, 0.5}, 160).front().weight, view.weights_at({0.5, 0.5}, 160)[1].weight, 0.02);
}

TEST(LumigraphView, BlendingFieldShowsThePhotosOwnColour) {
  LumigraphView view = wall_view();
  view.jump(1);
  LumigraphOptions options = view.options();
  options.shown = Shown::blending_field;
  view.set_options(options);
  const ImageU8 picture = view.render(view.view(160), 0);
  const auto colour = field_colour(1);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(picture.at(90, 50, c), colour[static_cast<std::size_t>(c)], 3);
}

TEST(LumigraphView, ExposesLinearPhotos) {
  PhotoSet set = wall_photos();
  for (PosedPhoto& photo : set.photos) {
    const auto& codes = std::get<ImageU8>(photo.picture);
    ImageF linear(codes.width, codes.height, 3);
    for (std::size_t i = 0; i < linear.data.size(); ++i) linear.data[i] = 20.0F * codes.data[i];
    photo.picture = std::move(linear);
  }
  const LumigraphView view(Lumigraph(set, wall));
  EXPECT_TRUE(view.is_linear());
  EXPECT_FALSE(wall_view().is_linear());
  const ImageU8 dark = view.render(view.view(160), -2), right = view.render(view.view(160), 0);
  EXPECT_GT(right.at(100, 60, 0), 100);
  EXPECT_LT(right.at(100, 60, 0), 255);
  EXPECT_LT(dark.at(100, 60, 0), right.at(100, 60, 0) * 0.6);
}

TEST(Pace, MakesPicturesAsLargeAsTimeAllows) {
  Pace pace;
  EXPECT_EQ(pace.divisor(), 1);
  pace.took(0.1, 1);
  EXPECT_EQ(pace.divisor(), 2);
  pace.took(0.1, 2);  // 0.4 s at full size
  EXPECT_EQ(pace.divisor(), 4);
  pace.took(0.002, 4);
  EXPECT_EQ(pace.divisor(), 1);
}

}  // namespace
}  // namespace mf
