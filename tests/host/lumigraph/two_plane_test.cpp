// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/two_plane.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "host/lumigraph/leave_one_out.h"
#include "host/lumigraph/read_photos.h"
#include "tests/host/lumigraph/made_photos.h"
#include "tests/support/expect_input_error.h"
#include "tests/support/temporary_folder.h"

namespace mf {
namespace {

using test::blotches;
using test::looking;
using test::pinhole;

TwoPlane tilted_planes() {
  TwoPlane planes;
  planes.world_from_uv = looking({0.4, -0.3, 4}, {0, 0, 0}).inverse();
  planes.cameras = {7, 5};
  planes.uv_size_m = {1.8, 1.2};
  planes.st_distance_m = 4;
  planes.st_centre_m = {0.1, -0.05};
  planes.st_size_m = {2.4, 1.8};
  planes.size_px = {160, 120};
  return planes;
}

// What the parameterization means: a point of the st plane is the same pixel of every picture.
TEST(TwoPlane, EveryCameraSeesTheSameWindow) {
  const TwoPlane planes = tilted_planes();
  const Eigen::Vector3d in_window(0.4, -0.3, planes.st_distance_m);
  const Eigen::Vector2d pixel((0.4 - (0.1 - 1.2)) / 2.4 * 160, (-0.3 - (-0.05 - 0.9)) / 1.8 * 120);
  for (int row = 0; row < 5; ++row)
    for (int column = 0; column < 7; ++column) {
      const View view = grid_view(planes, column, row);
      const Eigen::Vector3d x = view.cam_from_world * (planes.world_from_uv * in_window);
      EXPECT_LT((view.camera.project(x) - pixel).norm(), 1e-9);
      const Eigen::Vector3d centre = planes.world_from_uv.inverse() * view.cam_from_world.inverse().translation;
      const Eigen::Vector3d place(1.8 * (column / 6.0 - 0.5), 1.2 * (row / 4.0 - 0.5), 0);
      EXPECT_LT((centre - place).norm(), 1e-12);
    }
}

class TwoPlaneSet : public ::testing::Test {
 protected:
  static Proxy walls() { return MeshProxy(test::bumpy_ball_on_floor(48)); }

  static Lumigraph source() {
    PhotoSet set;
    set.source = "made";
    for (const View& view : test::cap_of_views(40, 4.3, 35, pinhole(160, 45)))
      set.photos.push_back(test::photo_of(std::to_string(set.photos.size()), view, walls(), blotches(0.35F)));
    return {set, walls()};
  }

  test::TemporaryFolder folder_;
};

TEST_F(TwoPlaneSet, ReadAgainReturnsItsPictures) {
  const Lumigraph lumigraph = source();
  const TwoPlane planes = tilted_planes();
  const TwoPlaneSummary written = write_two_plane(folder_.path(), lumigraph, planes, {}, {});
  EXPECT_EQ(written.pictures, 35);
  EXPECT_GT(written.covered, 0.95);
  const PhotoSet set = read_transforms(folder_ / "transforms.json");
  ASSERT_EQ(set.photos.size(), 35U);
  const Lumigraph light_field(set, make_proxy("plane:4", set, folder_.path()));
  for (const int i : {0, 17, 31}) {
    const View view = grid_view(planes, i % 7, i / 7);
    const LumigraphPicture truth = lumigraph.render(view, {});
    const LumigraphPicture again = light_field.render(view, {});
    ImageU8 both = again.covered;
    for (std::size_t p = 0; p < both.data.size(); ++p)
      both.data[p] = both.data[p] != Covered::nothing && truth.covered.data[p] != Covered::nothing ? Covered::seen
                                                                                                   : Covered::nothing;
    EXPECT_GT(psnr_db(again.picture, truth.picture, both), 45) << i;
  }
}

// Between the cameras a light field is what the lumigraph itself shows there, as far as its grid and the plane that it
// is focused on allow: with the scene's shape as proxy nearly exactly.
TEST_F(TwoPlaneSet, AViewBetweenTheCamerasIsTheLumigraphs) {
  const Lumigraph lumigraph = source();
  const TwoPlane planes = tilted_planes();
  static_cast<void>(write_two_plane(folder_.path(), lumigraph, planes, {}, {}));
  const PhotoSet set = read_transforms(folder_ / "transforms.json");
  Lumigraph light_field(set, walls());
  const View between{pinhole(150, 28), looking(planes.world_from_uv * Eigen::Vector3d(0.17, 0.11, 0.2), {0, 0, 0})};
  const LumigraphPicture truth = lumigraph.render(between, {});
  const LumigraphPicture of_shape = light_field.render(between, {});
  EXPECT_GT(std::count(of_shape.covered.data.begin(), of_shape.covered.data.end(), std::uint8_t{Covered::seen}), 15000);
  const double with_shape_db = psnr_db(of_shape.picture, truth.picture, of_shape.covered);
  light_field.set_proxy(make_proxy("plane:3.4", set, folder_.path()));
  const LumigraphPicture of_plane = light_field.render(between, {});
  const double with_plane_db = psnr_db(of_plane.picture, truth.picture, of_plane.covered);
  RecordProperty("with_shape_db", std::to_string(with_shape_db));
  RecordProperty("with_plane_db", std::to_string(with_plane_db));
  std::printf("between the cameras: %.1f dB with the shape, %.1f dB with a plane\n", with_shape_db, with_plane_db);
  EXPECT_GT(with_shape_db, 36);
  EXPECT_GT(with_plane_db, 22);
}

TEST(TwoPlaneLayout, ComesBackFromJson) {
  const TwoPlane planes = tilted_planes();
  const TwoPlane again = two_plane_from_json(to_json(planes), "layout.json");
  for (const auto& [column, row] : {std::pair{0, 0}, {6, 4}, {3, 1}}) {
    const View a = grid_view(planes, column, row);
    const View b = grid_view(again, column, row);
    EXPECT_EQ(a.camera.parameters, b.camera.parameters);
    EXPECT_LT((a.cam_from_world.matrix() - b.cam_from_world.matrix()).norm(), 1e-12);
  }
}

TEST(TwoPlaneLayout, IsRefusedWithItsField) {
  const auto refused = [](const char* key, const nlohmann::json& value) {
    nlohmann::json layout = to_json(tilted_planes());
    layout[key] = value;
    return test::input_error_of([&] { static_cast<void>(two_plane_from_json(layout, "layout.json")); });
  };
  for (const auto& [key, value] : std::vector<std::pair<const char*, nlohmann::json>>{{"cameras", {0, 3}},
                                                                                      {"uv_size_m", {-1, 1}},
                                                                                      {"st_distance_m", 0},
                                                                                      {"st_size_m", {1}},
                                                                                      {"size_px", {1, 100000}},
                                                                                      {"grid", 3}}) {
    const std::string line = refused(key, value);
    EXPECT_TRUE(test::contains(line, "layout.json")) << line;
    EXPECT_TRUE(test::contains(line, key)) << line;
  }
}

TEST(TwoPlaneFit, CoversWhereThePhotosWereAndWhatTheySaw) {
  PhotoSet set;
  set.source = "made";
  const PlaneProxy wall{Eigen::Vector3f::UnitZ(), 0};
  for (int i = 0; i < 49; ++i) {
    const double x = 0.2 * (i % 7 - 3);
    const double y = 0.1 * (i / 7 - 3);
    set.photos.push_back(
        test::photo_of(std::to_string(i), {pinhole(64, 40), looking({x, y, 3}, {x, y, 0})}, wall, blotches(0.4F)));
  }
  const Lumigraph lumigraph(set, wall);
  const TwoPlane planes = fitted_two_plane(lumigraph, set, {5, 4}, {});
  EXPECT_NEAR(planes.st_distance_m, 3, 1e-4);
  EXPECT_NEAR(planes.st_size_m.x(), 2 * 3 * std::tan(20 * 3.14159265 / 180), 1e-4);
  EXPECT_EQ(planes.size_px, (std::array<int, 2>{64, 64}));
  EXPECT_LT(planes.st_centre_m.norm(), 1e-5);
  EXPECT_LT((planes.world_from_uv.translation - Eigen::Vector3d(0, 0, 3)).norm(), 1e-5);
  // Four fifths of the centres, whichever way the frame's axes run.
  EXPECT_NEAR(planes.uv_size_m.maxCoeff(), 1.2, 1e-4);
  EXPECT_NEAR(planes.uv_size_m.minCoeff(), 0.6, 1e-4);
  EXPECT_NEAR(fitted_two_plane(lumigraph, set, {2, 2}, 5.0).st_distance_m, 5, 0);
}

}  // namespace
}  // namespace mf
