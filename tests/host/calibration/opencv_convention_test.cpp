// SPDX-License-Identifier: Apache-2.0
//
// OpenCV puts the first pixel's centre at (0, 0), we at (0.5, 0.5). Everything that crosses between the two shifts by
// half a pixel, and the two calibrations must then agree.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include "common/tag_detector.h"
#include "common/tag_pattern.h"
#include "host/calibration/calibrate.h"
#include "host/io/image_file.h"
#include "tests/host/calibration/synthetic_views.h"

#if MF_HAVE_OPENCV
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#endif

namespace mf {
namespace {

#if MF_HAVE_OPENCV

struct OpenCvResult {
  double rms = 0;
  cv::Mat k, distortion;
};

OpenCvResult opencv_calibration(const std::vector<TargetView>& views, const cv::Size& size, int flags) {
  std::vector<std::vector<cv::Point3f>> objects;
  std::vector<std::vector<cv::Point2f>> pixels;
  for (const TargetView& view : views) {
    objects.emplace_back();
    pixels.emplace_back();
    for (const TagSighting& tag : view.tags)
      for (std::size_t k = 0; k < 4; ++k) {
        const Eigen::Vector3f x = tag.corners_in_target[k].cast<float>();
        objects.back().emplace_back(x.x(), x.y(), x.z());
        const Eigen::Vector2f p = (tag.corners_px[k].array() - 0.5).cast<float>();
        pixels.back().emplace_back(p.x(), p.y());
      }
  }
  OpenCvResult result;
  std::vector<cv::Mat> rotations, translations;
  result.rms = cv::calibrateCamera(objects, pixels, size, result.k, result.distortion, rotations, translations, flags);
  return result;
}

TEST(OpenCvConvention, TheirPrincipalPointIsOursLessHalfAPixel) {
  CameraModel camera = testing::ordinary_camera();
  camera.parameters[4] = -0.15;
  camera.parameters[5] = 0.05;
  const testing::SyntheticCapture capture = testing::synthetic_capture(camera, 20, 0.05, 8);
  const OpenCvResult theirs = opencv_calibration(capture.input.mirror, {camera.width, camera.height}, cv::CALIB_FIX_K3);
  CalibrationOptions options;
  options.distortion = DistortionChoice::brown;
  CalibrationInput input = capture.input;
  input.world.tags.clear();  // the same data for both
  const Calibration ours = calibrate(input, options, {}).calibration;
  EXPECT_NEAR(ours.camera.cx(), theirs.k.at<double>(0, 2) + 0.5, 0.05);
  EXPECT_NEAR(ours.camera.cy(), theirs.k.at<double>(1, 2) + 0.5, 0.05);
  EXPECT_NEAR(ours.camera.fx(), theirs.k.at<double>(0, 0), 0.05);
  EXPECT_NEAR(ours.camera.fy(), theirs.k.at<double>(1, 1), 0.05);
  EXPECT_NEAR(ours.rms_px, theirs.rms, 1e-3);
}

// A black square from column 20 to 59: its left edge is x = 20 for us (and AprilTag), 19.5 for OpenCV.
TEST(OpenCvConvention, TagCornersLieOnPixelEdges) {
  const TagPattern pattern = tag_pattern("tag36h11", 0);
  ImageF picture(80, 80, 1, 1.0F);
  for (int y = 15; y < 65; ++y)
    for (int x = 15; x < 65; ++x)
      picture.at(x, y) = pattern.at((x - 15) / 5, (y - 15) / 5) == TagPattern::Cell::white ? 1.0F : 0.0F;
  const std::vector<TagDetection> found = TagDetector({}).detect(picture);
  ASSERT_EQ(found.size(), 1U);
  const std::array<Eigen::Vector2d, 4> expected{Eigen::Vector2d(20, 60), Eigen::Vector2d(60, 60),
                                                Eigen::Vector2d(60, 20), Eigen::Vector2d(20, 20)};
  for (std::size_t k = 0; k < 4; ++k) EXPECT_LT((found[0].corners_px[k] - expected[k]).cwiseAbs().maxCoeff(), 0.2) << k;
}

// The 9 × 6 board of Bouguet's pictures, as blocks of four neighbouring corners.
TEST(Bouguet, AgreesWithOpenCvOnRealPictures) {
  const std::filesystem::path data = std::filesystem::path(MF_SHARED_DATA) / "bouguet";
  if (!std::filesystem::exists(data)) GTEST_SKIP() << data << " is absent";
  const std::filesystem::path pngs =
      std::filesystem::temp_directory_path() / ("mf_bouguet_" + std::to_string(::getpid()));
  std::filesystem::create_directories(pngs);
  const std::string convert = "/usr/bin/python3 -c \"import cv2,glob,os,sys\nfor f in sorted(glob.glob('" +
                              data.string() + "/left*.jpg')): cv2.imwrite('" + pngs.string() +
                              "/'+os.path.basename(f)[:-4]+'.png',cv2.imread(f,0))\"";
  if (std::system(convert.c_str()) != 0) GTEST_SKIP() << "python3-opencv is absent: nothing reads JPEG";
  CalibrationInput input;
  input.source = "bouguet";
  for (const auto& entry : std::filesystem::directory_iterator(pngs)) {
    const auto picture = std::get<ImageU16>(read_image(entry.path()));
    input.width = picture.width;
    input.height = picture.height;
    cv::Mat grey(picture.height, picture.width, CV_8U);
    for (int y = 0; y < picture.height; ++y)
      for (int x = 0; x < picture.width; ++x) grey.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(picture.at(x, y));
    std::vector<cv::Point2f> corners;
    if (!cv::findChessboardCorners(grey, {9, 6}, corners)) continue;
    cv::cornerSubPix(grey, corners, {5, 5}, {-1, -1}, {cv::TermCriteria::EPS + cv::TermCriteria::COUNT, 30, 0.01});
    TargetView view;
    view.name = entry.path().filename();
    for (int row = 0; row < 6; row += 2)
      for (int column = 0; column < 8; column += 2) {
        TagSighting block{row * 9 + column, {}, {}, isotropic_information(0.2), true};
        for (std::size_t k = 0; k < 4; ++k) {
          const int c = column + (k == 1 || k == 2 ? 1 : 0), r = row + (k >= 2 ? 1 : 0);
          const cv::Point2f& p = corners[static_cast<std::size_t>(r * 9 + c)];
          block.corners_in_target[k] = {0.025 * c, -0.025 * r, 0};  // faces the camera: y up, rows go down
          block.corners_px[k] = {static_cast<double>(p.x) + 0.5, static_cast<double>(p.y) + 0.5};
        }
        view.tags.push_back(block);
      }
    input.mirror.push_back(view);
  }
  std::filesystem::remove_all(pngs);
  ASSERT_GE(input.mirror.size(), 11U);
  const OpenCvResult theirs = opencv_calibration(input.mirror, {input.width, input.height}, cv::CALIB_FIX_K3);
  CalibrationOptions options;
  options.distortion = DistortionChoice::brown;
  options.max_rotation_sigma_deg = 1;  // a board of 20 cm, corners as good as they are
  options.max_position_sigma_m = 0.01;
  const CalibrationResult result = calibrate(input, options, {});
  const Calibration& ours = result.calibration;
  RecordProperty("rms_ours_px", std::to_string(ours.rms_px));
  RecordProperty("rms_opencv_px", std::to_string(theirs.rms));
  EXPECT_LT(ours.rms_px, 1.03 * theirs.rms);
  EXPECT_NEAR(ours.camera.fx(), theirs.k.at<double>(0, 0), 3 * ours.camera_sigma[0]);
  EXPECT_NEAR(ours.camera.fy(), theirs.k.at<double>(1, 1), 3 * ours.camera_sigma[1]);
  EXPECT_NEAR(ours.camera.cx(), theirs.k.at<double>(0, 2) + 0.5, 3 * ours.camera_sigma[2]);
  EXPECT_NEAR(ours.camera.cy(), theirs.k.at<double>(1, 2) + 0.5, 3 * ours.camera_sigma[3]);
  EXPECT_NEAR(ours.camera.parameters[4], theirs.distortion.at<double>(0), 3 * ours.camera_sigma[4]);
}

#else
TEST(OpenCvConvention, NeedsOpenCv) {
  GTEST_SKIP() << "OpenCV's calib3d is not installed";
}
#endif

}  // namespace
}  // namespace mf
