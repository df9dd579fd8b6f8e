// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/session_photos.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "host/lumigraph/leave_one_out.h"
#include "host/lumigraph/lumigraph.h"
#include "tests/host/calibration/synthetic_views.h"
#include "tests/host/lumigraph/made_photos.h"
#include "tests/support/expect_input_error.h"
#include "tests/support/temporary_folder.h"

namespace mf {
namespace {

constexpr double reflectance = 0.8;
constexpr float frame_value = 0.016F;  // of everything that is no mirror: radiance 1, the room has less
constexpr double room_m = 3;           // radius of a round room about the world's origin

// A capture of a painted room in a mirror, its frames by reflecting each pixel's ray at the mirror's plane. Nothing of
// the code under test is used.
class MirrorCapture : public ::testing::Test {
 protected:
  MirrorCapture() {
    calibration_.camera = testing_camera();
    calibration_.cam_from_world = testing::facing_pose(1.2, 0.6, 0.4, {0.03, 0.05});
    SessionHeader header;
    header.format = {PixelLayout::rgb, 8, true};
    header.width = calibration_.camera.width;
    header.height = calibration_.camera.height;
    header.target = testing::framed_mirror();
    header.mirror_reflectance = reflectance;
    opening_ = header.target.opening_m;
    SessionWriter writer(folder_ / "S", header, {SessionWriter::Durability::batches});
    for (int i = 0; i < 30; ++i) {
      const double turn = 2.4 * i;
      const Rigid3 mirror = testing::facing_pose(1 + 0.05 * std::sin(turn), 0.25 + 0.2 * (i % 5) / 5, turn,
                                                 {0.08 * std::sin(1.7 * i), 0.06 * std::cos(2.3 * i)});
      const std::string name = "mirror" + std::to_string(i) + ".tif";
      Frame frame;
      frame.info.name = name;
      frame.info.exposure_s = 0.02;
      frame.info.time_s = 0.5 * i;
      frame.pixels = frame_of(mirror);
      writer.append(frame);
      calibration_.frames.push_back({name, mirror, 0.1, 100, 0, i != 4, i == 4 ? "blurred" : "", 0, 0});
    }
    writer.finish();
  }

  static CameraModel testing_camera() {
    CameraModel camera = testing::ordinary_camera();
    camera.width /= 2;
    camera.height /= 2;
    camera.parameters = {500, 502, 190, 166, -0.1, 0.02, 1e-3, -2e-3, 0};
    return camera;
  }

  [[nodiscard]] Eigen::Vector3f radiance_at(const Eigen::Vector3d& x_in_world) const {
    return paint_(x_in_world.cast<float>());
  }

  [[nodiscard]] ImageF frame_of(const Rigid3& cam_from_mirror) const {
    const CameraModel& camera = calibration_.camera;
    ImageF frame(camera.width, camera.height, 3, frame_value);
    const Rigid3 world_from_cam = calibration_.cam_from_world->inverse();
    const Eigen::Vector3d normal = cam_from_mirror.rotation * Eigen::Vector3d::UnitZ();
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x) {
        const Eigen::Vector3d d = camera.unproject({x + 0.5, y + 0.5}).value().normalized();
        const double t = normal.dot(cam_from_mirror.translation) / normal.dot(d);
        const Eigen::Vector3d on_mirror = cam_from_mirror.inverse() * Eigen::Vector3d(t * d);
        if (!(t > 0) || std::abs(on_mirror.x()) > opening_.x() / 2 || std::abs(on_mirror.y()) > opening_.y() / 2)
          continue;
        const Eigen::Vector3d away = world_from_cam.rotation * (d - 2 * normal.dot(d) * normal);
        const Eigen::Vector3d from = world_from_cam * Eigen::Vector3d(t * d);
        const double b = from.dot(away);
        const Eigen::Vector3d wall = from + (-b + std::sqrt(b * b + room_m * room_m - from.squaredNorm())) * away;
        const Eigen::Vector3f radiance = radiance_at(wall);
        for (int c = 0; c < 3; ++c) frame.at(x, y, c) = radiance[c] * static_cast<float>(reflectance * 0.02);
      }
    return frame;
  }

  [[nodiscard]] PhotoSet photos(double scale = 1) const {
    SessionPhotoOptions options;
    options.scale = scale;
    return photos_of_session(SessionReader(folder_ / "S"), linear_response(8, 0, 1, 3), calibration_, options, {});
  }

  test::TemporaryFolder folder_;
  Calibration calibration_;
  Eigen::Vector2d opening_;
  test::Paint paint_ = test::blotches(0.9F);
};

// A photo's pixel must show the room's radiance where the photo's own camera says that it looks.
TEST_F(MirrorCapture, PhotosAreOfTheRoomWithTheCamerasBehindTheMirror) {
  const PhotoSet set = photos();
  ASSERT_EQ(set.photos.size(), 29U);  // without the one that calibration does not use
  for (const PosedPhoto& photo : set.photos) {
    const auto& picture = std::get<ImageF>(photo.picture);
    EXPECT_LT(picture.width, calibration_.camera.width) << "cut to the opening";
    const Rigid3 world_from_cam = photo.cam_from_world.inverse();
    int shown = 0;
    for (int y = 0; y < picture.height; y += 5)
      for (int x = 0; x < picture.width; x += 5) {
        if (photo.mask.at(x, y) == 0) continue;
        ++shown;
        const Eigen::Vector3d d =
            (world_from_cam.rotation * photo.camera.unproject({x + 0.5, y + 0.5}).value()).normalized();
        const Eigen::Vector3d& from = world_from_cam.translation;
        const double b = from.dot(d);
        const Eigen::Vector3d wall = from + (-b + std::sqrt(b * b + room_m * room_m - from.squaredNorm())) * d;
        const Eigen::Vector3f radiance = radiance_at(wall);
        for (int c = 0; c < 3; ++c)
          ASSERT_NEAR(picture.at(x, y, c), radiance[c], 0.01F) << photo.name << x << ", " << y;
      }
    EXPECT_GT(shown, 200) << photo.name;
  }
  EXPECT_EQ(set.photos[2].time_s, 1.0);
}

TEST_F(MirrorCapture, ForetellItsFramesThroughTheRoom) {
  const PhotoSet set = photos(0.5);
  const Lumigraph lumigraph(set, SphereProxy{Eigen::Vector3f::Zero(), static_cast<float>(room_m)});
  double sum = 0;
  int counted = 0;
  const LeaveOneOut result = leave_one_out(lumigraph, set, {}, [&](const LeftOutView& view, const LeftOutPictures& p) {
    // Over the mirror alone: what lies about it in the cut picture is its tag frame.
    const auto photo = std::find_if(set.photos.begin(), set.photos.end(),
                                    [&](const PosedPhoto& candidate) { return candidate.name == view.name; });
    ImageU8 where = p.foretold.covered;
    for (std::size_t pixel = 0; pixel < where.data.size(); ++pixel)
      if (photo->mask.data[pixel] < 128) where.data[pixel] = Covered::nothing;
    if (std::count(where.data.begin(), where.data.end(), std::uint8_t{Covered::seen}) < 500) return;
    sum += psnr_db(p.foretold.picture, p.photo, where);
    ++counted;
  });
  EXPECT_EQ(result.views.size(), 29U);
  ASSERT_GT(counted, 10);
  std::printf("mirror frames foretold: %.1f dB over %d views\n", sum / counted, counted);
  EXPECT_GT(sum / counted, 35);
}

TEST_F(MirrorCapture, IsRefusedWithoutUsedFrames) {
  for (MirrorPose& pose : calibration_.frames) pose.used = false;
  EXPECT_TRUE(test::contains(test::input_error_of([&] { static_cast<void>(photos()); }), "calibration.json"));
}

}  // namespace
}  // namespace mf
