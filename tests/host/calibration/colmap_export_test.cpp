// SPDX-License-Identifier: Apache-2.0
#include "host/calibration/colmap_export.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <sstream>

#include "common/mirror_picture.h"
#include "common/virtual_view.h"
#include "host/io/image_file.h"
#include "tests/host/calibration/synthetic_views.h"

namespace mf {
namespace {

using testing::facing_pose;
using testing::framed_mirror;
using testing::ordinary_camera;

CameraModel distorted_camera() {
  CameraModel camera = ordinary_camera();
  camera.parameters[4] = -0.2;
  camera.parameters[5] = 0.1;
  camera.parameters[6] = 2e-3;
  camera.parameters[7] = -3e-3;
  return camera;
}

TEST(FlippedCamera, SeesTheMirrorImageOfEveryPicture) {
  const CameraModel camera = distorted_camera();
  const CameraModel flipped = flipped_camera(camera);
  for (const Eigen::Vector3d& x : {Eigen::Vector3d(0.2, -0.1, 1), Eigen::Vector3d(-0.3, 0.25, 1.2)}) {
    const Eigen::Vector2d there = camera.project(x);
    const Eigen::Vector2d here = flipped.project({-x.x(), x.y(), x.z()});
    EXPECT_NEAR(here.x(), camera.width - there.x(), 1e-9);
    EXPECT_NEAR(here.y(), there.y(), 1e-9);
  }
}

// What a COLMAP reader makes of a written model: a world point in a flipped picture must lie where the mirror shows it.
TEST(ExportColmap, PutsWorldPointsWhereTheMirrorShowsThem) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("mf_colmap_" + std::to_string(::getpid()));
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  Calibration calibration;
  calibration.camera = distorted_camera();
  calibration.cam_from_world = facing_pose(1.3, 0.9, 0.1, {0.02, 0.05});
  const Rigid3 mirror = facing_pose(1.0, 0.35, 1.2, {0.05, -0.02});
  calibration.frames.push_back({"00007.png", mirror, 0.1, 100, 0, true, "", 0, 0});
  calibration.frames.push_back({"00008.png", {}, 0, 0, 0, false, "no tag found", 0, 0});

  SessionHeader header;
  header.format = {PixelLayout::mono, 8, false};
  header.width = calibration.camera.width;
  header.height = calibration.camera.height;
  header.target = framed_mirror();
  ImageU16 pixels(header.width, header.height, 1, 100);
  pixels.at(700, 20) = 200;
  SessionWriter writer(folder / "S", header, {SessionWriter::Durability::batches});
  const auto append = [&](const char* name, FrameRole role) {
    Frame frame;
    frame.info.name = name;
    frame.info.role = role;
    frame.info.exposure_s = 0.01;
    frame.pixels = pixels;
    writer.append(frame);
  };
  append("00007.png", FrameRole::mirror);
  append("00008.png", FrameRole::mirror);
  append("scene.png", FrameRole::scene);
  writer.finish();
  const ColmapSummary summary =
      export_colmap(folder / "colmap", calibration, SessionReader(folder / "S"), linear_response(8, 0, 1, 1), {});
  EXPECT_EQ(summary.images, 2);

  std::map<int, CameraModel> cameras;
  std::ifstream camera_file(folder / "colmap" / "cameras.txt");
  for (std::string line; std::getline(camera_file, line);) {
    if (line.starts_with("#")) continue;
    std::istringstream fields(line);
    int id = 0;
    std::string model;
    CameraModel camera;
    fields >> id >> model >> camera.width >> camera.height;
    EXPECT_EQ(model, "OPENCV");
    for (std::size_t i = 0; i < 8; ++i) fields >> camera.parameters[i];
    ASSERT_TRUE(fields);
    cameras[id] = camera;
  }
  std::ifstream image_file(folder / "colmap" / "images.txt");
  const std::optional<VirtualView> view = mirror_view(mirror, header.target, calibration.camera);
  ASSERT_TRUE(view);
  int mirror_views = 0;
  for (std::string line; std::getline(image_file, line);) {
    if (line.starts_with("#") || line.empty()) continue;
    std::istringstream fields(line);
    int id = 0, camera_id = 0;
    std::string name;
    Rigid3 pose;
    Eigen::Quaterniond& q = pose.rotation;
    Eigen::Vector3d& t = pose.translation;
    fields >> id >> q.w() >> q.x() >> q.y() >> q.z() >> t.x() >> t.y() >> t.z() >> camera_id >> name;
    ASSERT_TRUE(fields);
    const bool of_mirror = name == "mirror/00007.png";
    mirror_views += of_mirror ? 1 : 0;
    for (const Eigen::Vector3d& x : {Eigen::Vector3d(0.1, 0.2, 0.3), Eigen::Vector3d(-0.1, 0.3, 0.2)}) {
      const Eigen::Vector2d exported = cameras.at(camera_id).project(pose * x);
      const Eigen::Vector3d in_cam = *calibration.cam_from_world * x;
      Eigen::Vector2d shown = calibration.camera.project(of_mirror ? view->reflected(in_cam) : in_cam);
      if (of_mirror) shown.x() = header.width - shown.x();
      EXPECT_LT((exported - shown).norm(), 1e-6) << name;
    }
  }
  EXPECT_EQ(mirror_views, 1);
  // The picture is flipped, and its mask shows the opening on the flipped side.
  const auto flipped = std::get<ImageU16>(read_image(folder / "colmap" / "images" / "mirror" / "00007.png"));
  EXPECT_GT(flipped.at(header.width - 1 - 700, 20, 0), flipped.at(700, 20, 0));
  const auto mask = std::get<ImageU16>(read_image(folder / "colmap" / "masks" / "mirror" / "00007.png.png"));
  Eigen::Vector2d middle = calibration.camera.project(mirror.translation);
  EXPECT_EQ(mask.at(header.width - 1 - static_cast<int>(middle.x()), static_cast<int>(middle.y())), 255);
  EXPECT_EQ(mask.at(2, 2), 0);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace mf
