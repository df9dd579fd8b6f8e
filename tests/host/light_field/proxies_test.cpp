// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "common/error.h"
#include "host/io/mesh.h"
#include "host/light_field/proxy_choice.h"
#include "host/light_field/resample.h"
#include "host/light_field/room_search.h"
#include "host/tracing/ray_scene.h"
#include "tests/host/light_field/synthetic_views.h"
#include "tests/support/temporary_folder.h"

namespace mf {
namespace {

const PlaneRectangle square{{}, {-0.2, -0.2}, {0.2, 0.2}};
const RoomBox room{{-1.2F, -0.9F}, {1.6F, 2.2F}, 1.9F};

// A room whose sides carry a fine pattern.
Eigen::Vector3f patterned_room(const Eigen::Vector3f& o, const Eigen::Vector3f& d) {
  const Eigen::Vector3f x = o + d / room.inverse_distance_along(o, d);
  return Eigen::Vector3f::Constant(
      1.3F + 0.6F * (std::sin(11 * x.x() + 2) * std::cos(9 * x.y()) + std::sin(10 * x.z() + 3 * x.x())));
}

// The room as triangles, without a floor.
TriangleMesh room_mesh() {
  TriangleMesh mesh;
  for (const float z : {-1.0F, room.ceiling})
    for (int i = 0; i < 4; ++i)
      mesh.positions.emplace_back(i == 0 || i == 3 ? room.low.x() : room.high.x(), i < 2 ? room.low.y() : room.high.y(),
                                  z);
  for (std::uint32_t i = 0; i < 4; ++i) {
    const std::uint32_t j = (i + 1) % 4;
    mesh.triangles.push_back({i, j, j + 4});
    mesh.triangles.push_back({i, j + 4, i + 4});
  }
  mesh.triangles.push_back({4, 5, 6});
  mesh.triangles.push_back({4, 6, 7});
  return mesh;
}

TEST(RoomBox, TheNearestSideIsMet) {
  const Eigen::Vector3f p(0.1F, 0.2F, 0);
  EXPECT_NEAR(1 / room.inverse_distance_along(p, {1, 0, 0}), 1.5, 1e-5);
  EXPECT_NEAR(1 / room.inverse_distance_along(p, {0, -1, 0}), 1.1, 1e-5);
  EXPECT_NEAR(1 / room.inverse_distance_along(p, {0, 0, 1}), 1.9, 1e-5);
  const Eigen::Vector3f d = Eigen::Vector3f(1, 0.2F, 1.1F).normalized();
  EXPECT_NEAR((p + d / room.inverse_distance_along(p, d)).x(), 1.6, 1e-5);
}

TEST(RoomBox, ASideAtInfinityIsNoWall) {
  RoomBox open = room;
  open.high.x() = RoomBox::none;
  EXPECT_EQ(open.inverse_distance_along({0, 0, 0}, {1, 0, 0}), 0);
  EXPECT_TRUE(open.holds({50, 0, 0}));
  EXPECT_FALSE(open.holds({-1.3F, 0, 0}));
}

TEST(RoomBox, NamesComeBack) {
  const auto back = parse_box("box:-1.2,-0.9,1.6,inf,1.9");
  ASSERT_TRUE(back.has_value());
  EXPECT_EQ(box_name(*back), "box:-1.2,-0.9,1.6,inf,1.9");
  EXPECT_TRUE(std::isinf(back->high.y()));
  for (const char* bad : {"box", "box:", "box:1,2,3,4", "box:1,2,0,4,5", "box:1,2,3,4,5,6", "box:a,2,3,4,5",
                          "box:0,0,nan,1,1", "box:0 0 1 1 1", "sphere:2"})
    EXPECT_FALSE(parse_box(bad)) << bad;
}

TEST(Proxies, NamesAreChecked) {
  for (const char* good : {"auto", "plane", "sphere", "sphere:2", "sphere:inf", "box", "box:-1,-1,1,1,2", "mesh:a.obj"})
    EXPECT_FALSE(proxy_fault(good)) << good;
  for (const char* bad : {"", "mesh", "mesh:", "box:", "box:1,1,0,0,2", "sphere:-1", "cube"})
    EXPECT_TRUE(proxy_fault(bad)) << bad;
}

TEST(Proxies, PhotoConsistencyFindsTheRoom) {
  const auto views = testing::analytic_views(250, 0.25F, 64, patterned_room);
  const RoomBox found = fit_room(sweep_surroundings(views, square));
  EXPECT_NEAR(found.low.x(), room.low.x(), 0.12);
  EXPECT_NEAR(found.low.y(), room.low.y(), 0.12);
  EXPECT_NEAR(found.high.x(), room.high.x(), 0.16);
  EXPECT_NEAR(found.high.y(), room.high.y(), 0.25);
  EXPECT_NEAR(found.ceiling, room.ceiling, 0.2);
}

TEST(Proxies, ARoomOfTrianglesIsTheRoom) {
  const Surroundings box = box_surroundings({0, 0, 0}, room);
  const Surroundings mesh = mesh_surroundings({0, 0, 0}, std::make_shared<const RayScene>(room_mesh()), "room.obj");
  EXPECT_EQ(surroundings_name(mesh), "mesh:room.obj");
  Surroundings map = box;  // as who reads a mesh's file sees it
  map.box.reset();
  for (const Eigen::Vector3f& d : geodesic_hemisphere(200).directions)
    for (const Eigen::Vector3f& p : {Eigen::Vector3f(0, 0, 0), Eigen::Vector3f(0.15F, -0.1F, 0)}) {
      const float inverse = box.inverse_distance_along(p, d);
      EXPECT_NEAR(mesh.inverse_distance_along(p, d), inverse, 1e-4F * inverse);
      EXPECT_NEAR(map.inverse_distance_along(p, d), inverse, 0.03F * inverse);
    }
}

// What stands before a wall is met first, and only there; what the mesh does not have is distant.
TEST(Proxies, AMeshIsMetAtItsFirstTriangle) {
  TriangleMesh mesh;
  mesh.positions = {{-0.1F, -0.1F, 0.5F}, {0.1F, -0.1F, 0.5F}, {0, 0.1F, 0.5F}, {-1, -1, 1}, {1, -1, 1}, {0, 1, 1}};
  mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
  const Surroundings s = mesh_surroundings({0, 0, 0}, std::make_shared<const RayScene>(mesh), "two.obj");
  const Eigen::Vector3f up(0, 0, 1);
  EXPECT_NEAR(s.inverse_distance_along({0, 0, 0}, up), 2, 1e-4);
  EXPECT_NEAR(s.inverse_distance_along({0.3F, 0, 0}, up), 1, 1e-4);
  EXPECT_EQ(s.inverse_distance_along({2, 0, 0}, up), 0);
}

TEST(Proxies, TheRightRoomIsSharperThanTheWrongOne) {
  const auto views = testing::analytic_views(300, 0.25F, 64, patterned_room);
  const auto error_with = [&](const std::string& proxy) {
    ResampleOptions options;
    options.directions = 500;
    options.size = 32;
    options.proxy = proxy;
    const ResampleResult r = resample(views, square, options, {});
    constexpr std::size_t texel = 8 * 32 + 8;
    const Eigen::Vector3f p(-0.09375F, 0.09375F, 0);
    double sum = 0, count = 0;
    for (std::size_t i = 0; i < r.field.directions.size(); ++i) {
      const Eigen::Vector3f d = r.field.directions.directions[i];
      if (d.z() < 0.3F || r.field.tile(i)[texel].w() < 0.9F) continue;
      sum += std::abs(static_cast<double>(r.field.tile(i)[texel].x() - patterned_room(p, d).x()));
      count += 1;
    }
    return sum / count;
  };
  const double right = error_with("box:-1.2,-0.9,1.6,2.2,1.9"), found = error_with("box"),
               far = error_with("sphere:inf");
  EXPECT_LT(right, 0.6 * far);
  EXPECT_LT(found, 0.7 * far);
}

TEST(Proxies, BadShapesAreNamed) {
  const auto views = testing::analytic_views(5, 0.25F, 16, patterned_room);
  const test::TemporaryFolder folder;
  const std::string below = folder / "below.obj";
  std::ofstream(below) << "v -1 -1 -1\nv 1 -1 -1\nv 0 1 -1\nf 1 2 3\n";
  EXPECT_THROW((void)choose_proxy(views, square, "mesh:" + below, 6, {}, Team()), InputError);
  EXPECT_THROW((void)choose_proxy(views, square, "mesh:missing.obj", 6, {}, Team()), InputError);
  EXPECT_THROW((void)choose_proxy(views, square, "box:-0.1,-1,1,1,2", 6, {}, Team()), InputError);
  EXPECT_THROW((void)choose_proxy(views, square, "box:-1,-1,1,1,-0.5", 6, {}, Team()), InputError);
}

TEST(Proxies, FilesKeepTheShape) {
  const test::TemporaryFolder folder;
  LightField field;
  field.plane = square;
  field.directions = geodesic_hemisphere(40);
  field.resolution = 2;
  field.rgbc.assign(field.directions.size() * 4, {1, 1, 1, 1});
  field.surroundings = box_surroundings({0, 0, 0}, room);
  write_light_field(folder / "box.lf.exr", field);
  const Surroundings box = read_light_field(folder / "box.lf.exr").surroundings;
  ASSERT_TRUE(box.box.has_value());
  EXPECT_EQ(box.box->low, room.low);
  EXPECT_EQ(box.box->high, room.high);
  EXPECT_EQ(box.box->ceiling, room.ceiling);
  EXPECT_EQ(surroundings_name(box), surroundings_name(field.surroundings));

  field.surroundings = mesh_surroundings({0, 0, 0}, std::make_shared<const RayScene>(room_mesh()), "room.obj");
  write_light_field(folder / "mesh.lf.exr", field);
  const Surroundings mesh = read_light_field(folder / "mesh.lf.exr").surroundings;
  EXPECT_EQ(surroundings_name(mesh), "mesh:room.obj");
  EXPECT_EQ(mesh.inverse_distance.data, field.surroundings.inverse_distance.data);
  const Eigen::Vector3f d = Eigen::Vector3f(0.3F, 0.2F, 0.9F).normalized();
  EXPECT_NEAR(mesh.inverse_distance_along({0.1F, 0, 0}, d), room.inverse_distance_along({0.1F, 0, 0}, d), 0.01);
}

}  // namespace
}  // namespace mf
