// SPDX-License-Identifier: Apache-2.0
#include "host/viewer/camera_path.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "common/file_bytes.h"
#include "host/io/image_file.h"
#include "host/viewer/path_recorder.h"
#include "tests/support/expect_input_error.h"
#include "tests/support/temporary_folder.h"

namespace mf {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;

// Looks along world +y, turned about Z by `angle`.
View view_at(const Vector3d& centre, double angle, double focal = 80) {
  Eigen::Matrix3d axes;
  axes << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(angle, Vector3d::UnitZ()));
  View view;
  view.camera.width = 64;
  view.camera.height = 48;
  view.camera.parameters = {focal, focal, 32, 24, 0, 0, 0, 0, 0};
  view.cam_from_world = Rigid3{turn * Eigen::Quaterniond(axes), centre}.inverse();
  return view;
}

Vector3d centre(const View& view) {
  return view.cam_from_world.inverse().translation;
}

TEST(CameraPath, PassesEveryKey) {
  const std::array keys{view_at({0, 0, 0}, 0), view_at({1, 0.5, 0}, 0.4, 100), view_at({2, 0, 0.3}, 1),
                        view_at({2, -1, 0}, 3.5)};
  const std::vector<View> path = smooth_path(keys, 10);
  ASSERT_EQ(path.size(), 31U);
  for (std::size_t i = 0; i < keys.size(); ++i) {
    EXPECT_TRUE(path[10 * i].cam_from_world.matrix().isApprox(keys[i].cam_from_world.matrix(), 1e-9)) << i;
    EXPECT_NEAR(path[10 * i].camera.fx(), keys[i].camera.fx(), 1e-9);
  }
}

TEST(CameraPath, GoesStraightAndEvenlyBetweenEvenKeys) {
  const std::array keys{view_at({0, 0, 0}, 0), view_at({1, 0, 0}, 0), view_at({2, 0, 0}, 0), view_at({3, 0, 0}, 0)};
  const std::vector<View> path = smooth_path(keys, 4);
  for (std::size_t i = 4; i <= 8; ++i)  // the inner span has neighbours on both sides
    EXPECT_TRUE(centre(path[i]).isApprox(Vector3d(static_cast<double>(i) / 4, 0, 0), 1e-9));
}

// Position and orientation change by much less from one step to the next than they do in a step.
TEST(CameraPath, TurnsWithoutAKink) {
  const std::array keys{view_at({0, 0, 0}, 0), view_at({1, 0, 0}, 0.2), view_at({1, 1, 0}, 1.4), view_at({0, 1, 0}, 2)};
  const std::vector<View> path = smooth_path(keys, 100);
  for (std::size_t i = 2; i < path.size(); ++i) {
    const Vector3d before = centre(path[i - 1]) - centre(path[i - 2]), after = centre(path[i]) - centre(path[i - 1]);
    EXPECT_LT((after - before).norm(), 0.05 * (after.norm() + before.norm()) + 1e-4) << i;
    EXPECT_LT(rotation_angle_between(path[i].cam_from_world, path[i - 1].cam_from_world), 0.03) << i;
  }
}

TEST(CameraPath, ChoosesTheShortWayRound) {
  View key = view_at({0, 0, 0}, 0.2);
  key.cam_from_world.rotation.coeffs() *= -1;  // the same orientation
  const std::array keys{view_at({0, 0, 0}, 0), key};
  for (const View& view : smooth_path(keys, 8))
    EXPECT_LT(rotation_angle_between(view.cam_from_world, keys[0].cam_from_world), 0.2 + 1e-6);
}

TEST(CameraPath, IsReadBackAsViews) {
  const test::TemporaryFolder folder;
  const std::array keys{view_at({0.1, 0.2, 0.3}, 0.5), view_at({1, 0, 0}, 1)};
  write_views(folder / "path.json", keys);
  const View back = read_view(folder / "path.json", 1);
  EXPECT_TRUE(back.cam_from_world.matrix().isApprox(keys[1].cam_from_world.matrix(), 1e-12));
  EXPECT_EQ(back.camera.parameters, keys[1].camera.parameters);
  EXPECT_EQ(back.camera.width, 64);
  EXPECT_EQ(back.camera.height, 48);
}

// The programs that PATH holds during a test.
class OnlyPrograms {
 public:
  explicit OnlyPrograms(const fs::path& folder) : before_(std::getenv("PATH")) { ::setenv("PATH", folder.c_str(), 1); }
  ~OnlyPrograms() { ::setenv("PATH", before_.c_str(), 1); }

 private:
  std::string before_;
};

ImageU8 picture_of(const View& view) {
  const double x = centre(view).x();
  return ImageU8(view.camera.width, view.camera.height, 3, static_cast<std::uint8_t>(std::lround(100 * x)));
}

void finish(PathRecorder& recorder) {
  while (recorder.is_working()) recorder.work(picture_of);
}

TEST(PathRecorder, WritesViewsAndFramesAndNamesTheCommandForAFilm) {
  const test::TemporaryFolder folder;
  const OnlyPrograms none(folder.path());
  PathRecorder recorder(folder / "out");
  recorder.add_key(view_at({0, 0, 0}, 0));
  recorder.add_key(view_at({9, 9, 9}, 0));
  recorder.drop_last_key();
  recorder.add_key(view_at({1, 0, 0}, 0));
  recorder.start();
  finish(recorder);
  const FramePixels last = read_image(folder / "out/frames/0031.png");
  EXPECT_EQ(std::get<ImageU16>(last).at(0, 0), 100);
  EXPECT_FALSE(fs::exists(folder / "out/frames/0032.png"));
  EXPECT_NEAR(centre(read_view(folder / "out/path.json", 30)).x(), 1, 1e-9);
  EXPECT_TRUE(test::contains(recorder.status(), "ffmpeg -y -framerate 30")) << recorder.status();
}

// ffmpeg's place is taken by a program that writes down what it was asked.
TEST(PathRecorder, LetsFfmpegMakeTheFilm) {
  const test::TemporaryFolder folder;
  fs::create_directory(folder / "bin");
  std::ofstream(folder / "bin/ffmpeg") << "#!/bin/sh\nfor last; do :; done\necho \"$@\" > \"$last\"\n";
  fs::permissions(folder / "bin/ffmpeg", fs::perms::owner_all);
  const OnlyPrograms ffmpeg(folder / "bin");
  PathRecorder recorder(folder / "out");
  recorder.add_key(view_at({0, 0, 0}, 0));
  recorder.add_key(view_at({1, 0, 0}, 0));
  recorder.start();
  finish(recorder);
  EXPECT_TRUE(test::contains(recorder.status(), "path.mp4"));
  EXPECT_TRUE(test::contains(read_file_bytes(folder / "out/path.mp4"), "frames/%04d.png"));
}

TEST(PathRecorder, NamesAFolderThatCannotBe) {
  const test::TemporaryFolder folder;
  std::ofstream(folder / "file") << "in the way";
  PathRecorder recorder(folder / "file/out");
  recorder.add_key(view_at({0, 0, 0}, 0));
  recorder.add_key(view_at({1, 0, 0}, 0));
  EXPECT_TRUE(test::contains(test::input_error_of([&] { recorder.start(); }), "file/out"));
  EXPECT_FALSE(recorder.is_working());
}

}  // namespace
}  // namespace mf
