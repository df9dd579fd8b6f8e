// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/visual_hull.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include "common/json_file.h"
#include "host/lumigraph/marching_tetrahedra.h"
#include "host/lumigraph/proxy_rays.h"
#include "tests/host/lumigraph/made_photos.h"
#include "tests/support/expect_input_error.h"

namespace mf {
namespace {

constexpr double pi = std::numbers::pi;

double volume_of(const TriangleMesh& mesh) {  // divergence theorem: positive when triangles turn outwards
  double six = 0;
  for (const auto& [a, b, c] : mesh.triangles)
    six +=
        mesh.positions[a].cast<double>().dot(mesh.positions[b].cast<double>().cross(mesh.positions[c].cast<double>()));
  return six / 6;
}

// Every edge is passed once each way: closed, no crack, and of one orientation.
bool is_watertight(const TriangleMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> passes;
  for (const auto& triangle : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i) ++passes[{triangle[i], triangle[(i + 1) % 3]}];
  return std::all_of(passes.begin(), passes.end(), [&](const auto& pass) {
    const auto back = passes.find({pass.first.second, pass.first.first});
    return pass.second == 1 && back != passes.end() && back->second == 1;
  });
}

// The camera's mask of a shape: white where the ray through a pixel's centre meets it.
using Shape = std::function<bool(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction)>;
PosedPhoto silhouette_of(const Shape& shape, const View& view, const std::string& name) {
  PosedPhoto photo;
  photo.name = name;
  photo.camera = view.camera;
  photo.cam_from_world = view.cam_from_world;
  photo.picture = ImageU8(view.camera.width, view.camera.height, 3);
  photo.mask = ImageU8(view.camera.width, view.camera.height, 1);
  const Rigid3 world_from_cam = view.cam_from_world.inverse();
  for (int y = 0; y < photo.mask.height; ++y)
    for (int x = 0; x < photo.mask.width; ++x)
      if (shape(world_from_cam.translation,
                world_from_cam.rotation * view.camera.unproject({x + 0.5, y + 0.5}).value()))
        photo.mask.at(x, y) = 255;
  return photo;
}

PhotoSet silhouettes_from_all_sides(const Shape& shape, int count, const Eigen::Vector3d& about) {
  PhotoSet set;
  set.source = "made";
  for (const View& view : test::cap_of_views(count, 4, 180, test::pinhole(256, 45))) {
    View moved = view;
    moved.cam_from_world = view.cam_from_world * Rigid3{Eigen::Quaterniond::Identity(), -about};
    set.photos.push_back(silhouette_of(shape, moved, std::to_string(set.photos.size())));
  }
  return set;
}

Shape ball(const Eigen::Vector3d& centre, double radius) {
  return [=](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
    const Eigen::Vector3d to = centre - o;
    return to.cross(d).norm() < radius * d.norm();
  };
}

Shape box(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  return [=](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
    const Eigen::Vector3d a = (low - o).cwiseQuotient(d);
    const Eigen::Vector3d b = (high - o).cwiseQuotient(d);
    return a.cwiseMin(b).maxCoeff() < a.cwiseMax(b).minCoeff();
  };
}

TEST(SignedDistance, IsExactForAStraightOutline) {
  ImageU8 mask(20, 9, 1);
  for (int y = 0; y < 9; ++y)
    for (int x = 7; x < 20; ++x) mask.at(x, y) = 255;
  const ImageF distance = signed_distance(mask);
  for (int x = 0; x < 20; ++x) EXPECT_FLOAT_EQ(distance.at(x, 4), static_cast<float>(x) + 0.5F - 7);
}

TEST(ZeroSurface, OfABallIsClosedAndHasItsVolume) {
  ScalarGrid grid;
  grid.origin = Eigen::Vector3d::Constant(-1.2);
  grid.spacing = 0.06;
  grid.corners = {41, 41, 41};
  for (int z = 0; z < 41; ++z)
    for (int y = 0; y < 41; ++y)
      for (int x = 0; x < 41; ++x) grid.values.push_back(static_cast<float>(1 - grid.position(x, y, z).norm()));
  const TriangleMesh mesh = zero_surface(grid);
  EXPECT_TRUE(is_watertight(mesh));
  EXPECT_NEAR(volume_of(mesh), 4 * pi / 3, 0.005 * 4 * pi / 3);
  const std::size_t edges = mesh.triangles.size() * 3 / 2;
  EXPECT_EQ(mesh.positions.size() + mesh.triangles.size() - edges, 2U);  // Euler: a sphere
  for (std::size_t i = 0; i < mesh.positions.size(); ++i)
    EXPECT_GT(mesh.normals[i].dot(mesh.positions[i].normalized()), 0.97F);
}

TEST(ZeroSurface, OfAnyFieldIsClosed) {
  ScalarGrid grid;
  grid.corners = {17, 14, 15};
  std::mt19937 random(3);
  std::normal_distribution<float> value;
  for (int z = 0; z < 15; ++z)
    for (int y = 0; y < 14; ++y)
      for (int x = 0; x < 17; ++x) {
        const bool border = x == 0 || y == 0 || z == 0 || x == 16 || y == 13 || z == 14;
        grid.values.push_back(border ? -1 : value(random));
      }
  const TriangleMesh mesh = zero_surface(grid);
  EXPECT_GT(mesh.triangles.size(), 5000U);
  EXPECT_TRUE(is_watertight(mesh));
}

TEST(VisualHull, OfABallIsTheBall) {
  const Eigen::Vector3d centre(5, -2, 1);
  const PhotoSet set = silhouettes_from_all_sides(ball(centre, 0.9), 60, {5.1, -2, 1.05});
  const double truth = 4 * pi / 3 * std::pow(0.9, 3);
  for (const int resolution : {32, 96}) {
    const TriangleMesh hull = visual_hull(set, {resolution, {}});
    EXPECT_TRUE(is_watertight(hull));
    const double error =
        volume_of(TriangleMesh(transformed({Eigen::Quaterniond::Identity(), -centre}, hull))) / truth - 1;
    std::printf("ball, %d cells: volume %+.2f %%\n", resolution, 100 * error);
    EXPECT_GT(error, -0.01);  // a hull is never smaller, but for the pixels of its outlines
    EXPECT_LT(error, 0.02);
  }
}

TEST(VisualHull, OfABoxIsTheBox) {
  const Eigen::Vector3d low(-0.7, -0.5, -0.3);
  const Eigen::Vector3d high(0.6, 0.4, 0.5);
  const TriangleMesh hull = visual_hull(silhouettes_from_all_sides(box(low, high), 100, {0, 0, 0}), {128, {}});
  EXPECT_TRUE(is_watertight(hull));
  const double error = volume_of(hull) / (1.3 * 0.9 * 0.8) - 1;
  std::printf("box, 128 cells: volume %+.2f %%\n", 100 * error);
  EXPECT_GT(error, -0.01);
  EXPECT_LT(error, 0.04);
  const Bounds bounds = bounds_of(hull);
  EXPECT_LT((bounds.low.cast<double>() - low).norm(), 0.04);
  EXPECT_LT((bounds.high.cast<double>() - high).norm(), 0.04);
}

TEST(VisualHull, IsRefusedWhenSilhouettesSayNothingOrContradict) {
  PhotoSet set = silhouettes_from_all_sides(ball({0, 0, 0}, 0.5), 12, {0, 0, 0});
  PhotoSet bare = set;
  for (PosedPhoto& photo : bare.photos) photo.mask = {};
  EXPECT_TRUE(test::contains(test::input_error_of([&] { static_cast<void>(visual_hull(bare, {})); }), "--mask-below"));
  std::fill(set.photos[3].mask.data.begin(), set.photos[3].mask.data.end(), std::uint8_t{0});
  EXPECT_TRUE(
      test::contains(test::input_error_of([&] { static_cast<void>(visual_hull(set, {})); }), "in all silhouettes"));
}

TEST(VisualHull, OfDarkBackgroundsComesFromThePictures) {
  PhotoSet set = silhouettes_from_all_sides(ball({0, 0, 0}, 0.8), 30, {0, 0, 0});
  const PhotoSet masked = set;
  for (PosedPhoto& photo : set.photos) {
    auto& picture = std::get<ImageU8>(photo.picture);
    for (std::size_t i = 0; i < picture.data.size(); ++i)
      picture.data[i] = photo.mask.data[i / 3] != 0 ? static_cast<std::uint8_t>(i % 3 == 1 ? 90 : 5) : 20;
    photo.mask = {};
  }
  mask_dark_background(set, 30);
  for (std::size_t i = 0; i < set.photos.size(); ++i) EXPECT_EQ(set.photos[i].mask.data, masked.photos[i].mask.data);
}

// The cameras of a real turntable rig, and a shape with ears, hollows and open edges. The hull must have its
// silhouettes.
TEST(VisualHull, OfTheStagesMeshHasItsSilhouettes) {
  const std::filesystem::path folder = std::filesystem::path(MF_SHARED_DATA) / "stage";
  if (!std::filesystem::exists(folder / "truth.json")) GTEST_SKIP() << "no " << folder;
  const nlohmann::json truth = read_json_file(folder / "truth.json");
  const Proxy shape = MeshProxy(read_mesh(folder / "object.obj"));
  const Shape meets = [&](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
    return std::get<MeshProxy>(shape).scene.intersect(o.cast<float>(), d.cast<float>()).has_value();
  };
  PhotoSet set;
  set.source = folder.string();
  const double scale = 0.5;  // 256²: the test stays quick
  for (std::size_t i = 0; i < truth.at("views").size(); i += 2) {
    View view;
    view.camera = test::pinhole(256, 45);
    view.camera.parameters = {
        truth["K"][0][0].get<double>() * scale, truth["K"][1][1].get<double>() * scale, 128, 128, 0, 0, 0, 0, 0};
    view.cam_from_world = rigid3_from_json(truth["views"][i]["cam_from_world"], "cam_from_world", "truth.json");
    set.photos.push_back(silhouette_of(meets, view, std::to_string(i)));
  }
  const Proxy hull = MeshProxy(visual_hull(set, {160, {}}));
  const TriangleMesh& mesh = std::get<MeshProxy>(hull).mesh;
  EXPECT_TRUE(is_watertight(mesh));
  double common = 0;
  double either = 0;
  for (const PosedPhoto& photo : set.photos) {
    const PosedPhoto again = silhouette_of(
        [&](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
          return std::get<MeshProxy>(hull).scene.intersect(o.cast<float>(), d.cast<float>()).has_value();
        },
        {photo.camera, photo.cam_from_world}, photo.name);
    for (std::size_t p = 0; p < photo.mask.data.size(); ++p) {
      const bool a = photo.mask.data[p] != 0;
      const bool b = again.mask.data[p] != 0;
      common += a && b ? 1 : 0;
      either += a || b ? 1 : 0;
    }
  }
  std::printf("stage: silhouettes agree in %.2f %% of their pixels; %zu triangles\n", 100 * common / either,
              mesh.triangles.size());
  EXPECT_GT(common / either, 0.97);
}

}  // namespace
}  // namespace mf
