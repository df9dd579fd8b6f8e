// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/read_photos.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "host/io/exr.h"
#include "host/io/image_file.h"
#include "host/lumigraph/camera_path.h"
#include "host/lumigraph/proxy.h"
#include "tests/support/expect_input_error.h"
#include "tests/support/temporary_folder.h"

namespace mf {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::contains;
using test::input_error_of;

void write_text(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  std::ofstream(file) << text;
}

class ColmapFolder : public testing::Test {
 protected:
  ColmapFolder() {
    fs::create_directories(folder_ / "images");
    write_png(folder_ / "images" / "a.png", ImageU8(40, 30, 3, 10));
    write_png(folder_ / "images" / "b c.png", ImageU8(40, 30, 3, 20));
    cameras("1 OPENCV 80 60 100 101 41 29 0.1 0.2 0.3 0.4\n2 SIMPLE_RADIAL 40 30 50 20 15 0.01\n");
    images("1 1 0 0 0 0 0 2 1 a.png\n\n2 0.7071068 0.7071068 0 0 1 2 3 2 b c.png\n3 4 -1\n");
  }
  void cameras(const std::string& text) { write_text(folder_ / "sparse" / "0" / "cameras.txt", "# made\n" + text); }
  void images(const std::string& text) { write_text(folder_ / "sparse" / "0" / "images.txt", text); }
  std::string error() {
    return input_error_of([&] { (void)read_colmap(folder_.path()); });
  }
  test::TemporaryFolder folder_;
};

TEST_F(ColmapFolder, IsReadWithItsCamerasScaled) {
  write_text(folder_ / "sparse" / "0" / "points3D.txt", "1 0.5 0.25 4 0 0 0 0.1\n");
  const PhotoSet set = read_colmap(folder_.path());
  ASSERT_EQ(set.photos.size(), 2U);
  const CameraModel& a = set.photos[0].camera;
  EXPECT_EQ(a.parameters, (CameraModel::Parameters{50, 50.5, 20.5, 14.5, 0.1, 0.2, 0.3, 0.4, 0}));
  EXPECT_EQ(set.photos[1].name, "b c.png");
  EXPECT_EQ(set.photos[1].camera.parameters, (CameraModel::Parameters{50, 50, 20, 15, 0.01, 0, 0, 0, 0}));
  // A quarter turn about x: the camera looks along world −y... its centre is −Rᵀ t.
  EXPECT_TRUE(centre_of(set.photos[1]).isApprox(Eigen::Vector3d(-1, -3, 2), 1e-6));
  ASSERT_EQ(set.points.size(), 1U);
  EXPECT_EQ(set.points[0], Eigen::Vector3f(0.5F, 0.25F, 4));
}

TEST_F(ColmapFolder, APictureThatWasCutHasItsPrincipalPointCentred) {
  cameras("1 SIMPLE_PINHOLE 80 64 100 41 29\n2 PINHOLE 40 30 50 51 20 15\n");
  const CameraModel camera = read_colmap(folder_.path()).photos[0].camera;
  EXPECT_EQ(camera.parameters, (CameraModel::Parameters{50, 50, 20, 15, 0, 0, 0, 0, 0}));
}

TEST_F(ColmapFolder, FaultsAreNamed) {
  cameras("1 FISHEYE 80 60 100 40 30\n");
  EXPECT_TRUE(contains(error(), "cameras.txt: line 2: FISHEYE is a camera model that is not read"));
  cameras("1 PINHOLE 80 60 100 100 40\n");
  EXPECT_TRUE(contains(error(), "line 2: has too few parameters for PINHOLE"));
  cameras("1 PINHOLE 80 60 100 100 40 30\n");
  EXPECT_TRUE(contains(error(), "images.txt: line 3: names camera 2"));
  images("1 1 0 0 0.5 0 0 2 1 a.png\n");
  EXPECT_TRUE(contains(error(), "line 1: has a quaternion that is not of unit length"));
  images("1 0 0 0 0 0 0 2 1 a.png\n");
  EXPECT_TRUE(contains(error(), "line 1: has a quaternion that is not of unit length: export the model again"));
  images("1 1 0 0 0 0 nan 2 1 a.png\n");
  EXPECT_TRUE(contains(error(), "images.txt: line 1: "));
  images("1 1 0 0 0 0 0 2 1 gone.png\n\n");
  EXPECT_TRUE(contains(error(), "gone.png"));
  images("");
  EXPECT_TRUE(contains(error(), "images.txt: lists no photo"));
  fs::remove_all(folder_ / "sparse");
  EXPECT_TRUE(contains(error(), "cameras.txt: is missing"));
}

TEST_F(ColmapFolder, NumbersThatAreNoPictureAreFound) {
  ImageF linear(40, 30, 3, 0.5F);
  write_exr(folder_ / "images" / "a.png", linear);
  EXPECT_TRUE(contains(error(), "are of two kinds"));
}

json transforms_of(const fs::path& folder) {
  write_png(folder / "one.png", ImageU8(40, 20, 3, 10));
  write_png(folder / "two.png", ImageU8(40, 20, 3, 20));
  const json ahead{{1, 0, 0, 1}, {0, 1, 0, 2}, {0, 0, 1, 3}, {0, 0, 0, 1}};
  return {{"camera_angle_x", 1.5707963267948966},
          {"frames",
           {{{"file_path", "one"}, {"transform_matrix", ahead}, {"time", 0.5}},
            {{"file_path", "two.png"}, {"transform_matrix", ahead}, {"fl_x", 30}, {"cx", 19}, {"k1", 0.1}}}}};
}

TEST(Transforms, AreReadInTheirConvention) {
  const test::TemporaryFolder folder;
  write_text(folder / "transforms.json", transforms_of(folder.path()).dump());
  const PhotoSet set = read_transforms(folder / "transforms.json");
  ASSERT_EQ(set.photos.size(), 2U);
  EXPECT_NEAR(set.photos[0].camera.fx(), 20, 1e-9);  // half the width / tan 45°
  EXPECT_EQ(set.photos[0].camera.cx(), 20);
  EXPECT_EQ(set.photos[0].time_s, 0.5);
  EXPECT_EQ(set.photos[1].camera.fx(), 30);
  EXPECT_EQ(set.photos[1].camera.cx(), 19);
  EXPECT_EQ(set.photos[1].camera.parameters[4], 0.1);
  // OpenGL's camera looks along −z with y up: a world point below and ahead of it is at +y, +z of ours.
  const Eigen::Vector3d x = set.photos[0].cam_from_world * Eigen::Vector3d(1.5, 1, -1);
  EXPECT_TRUE(x.isApprox(Eigen::Vector3d(0.5, 1, 4), 1e-12));
}

TEST(Transforms, FaultsAreNamed) {
  const test::TemporaryFolder folder;
  const fs::path file = folder / "transforms.json";
  const json good = transforms_of(folder.path());
  const auto error = [&](const json& bad) {
    write_text(file, bad.dump());
    return input_error_of([&] { (void)read_transforms(file); });
  };
  json bad = good;
  bad["frames"][1]["transform_matrix"][0][0] = -1;
  EXPECT_TRUE(contains(error(bad), "frames[1].transform_matrix"));
  bad = good;
  bad.erase("camera_angle_x");
  EXPECT_TRUE(contains(error(bad), "fl_x: is missing, and camera_angle_x too"));
  bad = good;
  bad["frames"][0]["file_path"] = "three";
  EXPECT_TRUE(contains(error(bad), "three"));
  bad = good;
  bad["frames"][0]["file_path"] = "two.png";
  EXPECT_TRUE(contains(error(bad), "is listed twice"));
  bad = good;
  bad["camera_model"] = "OPENCV_FISHEYE";
  EXPECT_TRUE(contains(error(bad), "OPENCV_FISHEYE is not read"));
  bad.erase("frames");
  EXPECT_TRUE(contains(error(bad), "frames: is missing"));
}

PhotoSet two_photos(double converge) {
  PhotoSet set;
  set.source = "made";
  CameraModel camera;
  camera.width = camera.height = 16;
  camera.parameters = {16, 16, 8, 8, 0, 0, 0, 0, 0};
  for (const double side : {-1.0, 1.0}) {
    const Rigid3 world_from_cam{Eigen::Quaterniond(Eigen::AngleAxisd(-side * converge, Eigen::Vector3d::UnitY())),
                                Eigen::Vector3d(side, 0, 0)};
    set.photos.push_back({std::to_string(side), camera, world_from_cam.inverse(), ImageU8(16, 16, 3), {}, {}});
  }
  return set;
}

TEST(Proxies, APlaneFacesTheSceneAtItsDepth) {
  PhotoSet set = two_photos(std::atan2(1.0, 4.0));
  auto plane = std::get<PlaneProxy>(make_proxy("plane", set, ""));
  EXPECT_NEAR(plane.offset, 4, 1e-5);  // where the axes meet
  EXPECT_TRUE(plane.normal.isApprox(Eigen::Vector3f::UnitZ(), 1e-6F));
  set = two_photos(0);
  set.points = {{0, 0, 4}, {0.1F, 0, 12}};  // mean 1/z = 1/6
  plane = std::get<PlaneProxy>(make_proxy("plane", set, ""));
  EXPECT_NEAR(plane.offset, 6, 1e-4);
  EXPECT_NEAR(std::get<PlaneProxy>(make_proxy("plane:2.5", set, "")).offset, 2.5, 1e-6);
}

TEST(Proxies, FaultsAreNamed) {
  const PhotoSet parallel = two_photos(0);
  const auto error = [&](const std::string& name) {
    return input_error_of([&] { (void)make_proxy(name, parallel, ""); });
  };
  EXPECT_TRUE(contains(error("plane"), "give plane:D"));
  EXPECT_TRUE(contains(error("plane:-1"), "plane:-1"));
  EXPECT_TRUE(contains(error("plane:x"), "something else than numbers"));
  EXPECT_TRUE(contains(error("sphere:0.5"), "taken from outside of the sphere"));
  EXPECT_TRUE(contains(error("box"), "needs the scene's points"));
  EXPECT_TRUE(contains(error("box:0,0,0,1,1,-1"), "not the lower one"));
  EXPECT_TRUE(contains(error("gone.obj"), "is no proxy and no file"));
  PhotoSet around = parallel;
  around.photos[0].cam_from_world.rotation = Eigen::Quaterniond(0, 0, 1, 0);
  EXPECT_TRUE(contains(input_error_of([&] { (void)make_proxy("plane:2", around, ""); }), "look all around"));
}

TEST(CameraPath, GoesThroughItsKeyFrames) {
  const test::TemporaryFolder folder;
  const auto key = [](double x, double focal) {
    return json{{"camera_from_world", {{1, 0, 0, -x}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}},
                {"K", {{focal, 0, 8}, {0, focal, 6}, {0, 0, 1}}},
                {"size", {16, 12}}};
  };
  write_text(folder / "path.json", json{{"frames", 5}, {"views", {key(0, 10), key(2, 20), key(3, 20)}}}.dump());
  const std::vector<View> views = read_camera_path(folder / "path.json");
  ASSERT_EQ(views.size(), 5U);
  const auto x_of = [&](std::size_t i) { return views[i].cam_from_world.inverse().translation.x(); };
  EXPECT_NEAR(x_of(0), 0, 1e-12);
  EXPECT_NEAR(x_of(2), 2, 1e-12);
  EXPECT_NEAR(x_of(4), 3, 1e-12);
  EXPECT_NEAR(x_of(1), 0.9375, 1e-12);  // Catmull–Rom: (−p₀ + 9 p₁ + 9 p₂ − p₃)/16 with p₀ = p₁
  EXPECT_NEAR(views[1].camera.fx(), 15, 1e-12);
  EXPECT_EQ(views[3].camera.width, 16);
  write_text(folder / "path.json", json{{"frames", 1}, {"views", {key(0, 10), key(2, 20)}}}.dump());
  EXPECT_TRUE(contains(input_error_of([&] { (void)read_camera_path(folder / "path.json"); }), "frames"));
  write_text(folder / "path.json", json::array({key(0, 10), json::object()}).dump());
  EXPECT_TRUE(contains(input_error_of([&] { (void)read_camera_path(folder / "path.json"); }), "[1].K"));
}

}  // namespace
}  // namespace mf
