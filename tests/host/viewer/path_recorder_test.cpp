// SPDX-License-Identifier: Apache-2.0
#include "host/viewer/path_recorder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "common/file_bytes.h"
#include "host/io/image_file.h"
#include "host/lumigraph/camera_path.h"
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

std::vector<View> path_in(const fs::path& folder) {
  return read_camera_path(folder / "path.json");
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
  const std::vector<View> path = path_in(folder / "out");  // what lumigraph --camera-path renders
  ASSERT_EQ(path.size(), 31U);
  EXPECT_LT(centre(path.front()).norm(), 1e-9);
  EXPECT_NEAR(centre(path.back()).x(), 1, 1e-9);
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

TEST(PathRecorder, KeysHaveOneSize) {
  PathRecorder recorder("nowhere");
  recorder.add_key(view_at({0, 0, 0}, 0));
  View tall = view_at({1, 0, 0}, 0);  // twice as large a picture, cut to be as high as wide
  tall.camera.width = tall.camera.height = 128;
  tall.camera.parameters = {160, 160, 64, 64, 0, 0, 0, 0, 0};
  recorder.add_key(tall);
  const CameraModel& camera = recorder.keys()[1].camera;
  EXPECT_EQ(camera.width, 64);
  EXPECT_EQ(camera.height, 48);
  EXPECT_EQ(camera.parameters, recorder.keys()[0].camera.parameters);
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
