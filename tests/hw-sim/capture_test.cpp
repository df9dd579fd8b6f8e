// SPDX-License-Identifier: Apache-2.0
#include "hw-sim/capture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>

#include "common/demosaic.h"
#include "common/error.h"
#include "common/json_file.h"
#include "common/tag_detector.h"
#include "hw-sim/desk_rig.h"
#include "hw-sim/mirror_plate.h"
#include "hw-sim/motion.h"
#include "hw-sim/sensor.h"
#include "hw-sim/tracer.h"

namespace mf::sim {
namespace {

namespace fs = std::filesystem;

fs::path fresh_folder(const std::string& name) {
  fs::path folder = fs::temp_directory_path() / ("mirrorfield_sim_test_" + name);
  fs::remove_all(folder);
  return folder;
}

std::string bytes_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::map<std::string, std::string> all_files(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) files[fs::relative(entry.path(), folder).string()] = bytes_of(entry.path());
  return files;
}

// The mirror shows p what comes from its direction: camera → mirror centre → reflected ray meets the light.
TEST(MirrorMotion, ReflectsTheCameraIntoTheDirection) {
  const Eigen::Vector3d eye(0.05, -0.85, 0.75);
  const MotionInput input{eye, {0.42, 0.52, 0.74}, {0.22, 0.18}};
  const Eigen::Vector3d p(0.05, -0.02, 0);
  const Eigen::Vector3d direction = Eigen::Vector3d(0.3, 0.4, 0.8).normalized();
  const Rigid3 pose = mirror_pose(input, p, direction, 0.2);
  const Eigen::Vector3d incoming = (pose.translation - eye).normalized();
  const Eigen::Vector3d normal = pose.rotation * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3f outgoing = reflect(incoming.cast<float>(), normal.cast<float>());
  EXPECT_LT((outgoing.cast<double>() - direction).norm(), 1e-3);
  // Angle of incidence is angle of reflection, and both lie in a plane with the normal.
  EXPECT_NEAR(-incoming.dot(normal), outgoing.cast<double>().dot(normal), 1e-6);
  EXPECT_NEAR(incoming.cross(outgoing.cast<double>()).dot(normal), 0, 1e-6);
}

TEST(MirrorMotion, ClearsTheTableInEveryFrame) {
  const MotionInput input{{0.05, -0.85, 0.75}, {0.42, 0.52, 0.74}, {0.22, 0.18}};
  for (const Rigid3& pose : wave_mirror(input, 140, 3))
    for (const double x : {-0.22, 0.22})
      for (const double y : {-0.18, 0.18}) EXPECT_GT((pose * Eigen::Vector3d(x, y, 0)).z(), 0.01);
}

// The lamp seen directly and in the mirror differ by the mirror's reflectance.
TEST(Tracer, MirrorDimsTheLampByItsReflectance) {
  const Scene scene = desk_scene(1);
  const MirrorPlate plate(desk_mirror(), 0.92);
  const Tracer tracer(scene, &plate);
  Sampler sampler(1);
  const Eigen::Vector3f above = scene.lamp.centre_in_world + Eigen::Vector3f(0, 0, 0.3F);
  const Rgb direct = tracer.radiance({above, -Eigen::Vector3f::UnitZ()}, std::nullopt, sampler);
  EXPECT_TRUE(direct.isApprox(scene.lamp.radiance));
  // A level mirror above the lamp, facing down.
  const Rigid3 world_from_mirror{Eigen::Quaterniond(Eigen::AngleAxisd(std::acos(-1.0), Eigen::Vector3d::UnitX())),
                                 (above + Eigen::Vector3f(0.05F, 0, 0.3F)).cast<double>()};
  const Eigen::Vector3f eye = scene.lamp.centre_in_world + Eigen::Vector3f(0.1F, 0, 0.2F);
  const Eigen::Vector3f virtual_lamp = scene.lamp.centre_in_world + Eigen::Vector3f(0, 0, 1.2F);
  const Rgb mirrored =
      tracer.radiance({eye, (virtual_lamp - eye).normalized()}, MirrorPlate::Placement(world_from_mirror), sampler);
  EXPECT_TRUE(mirrored.isApprox(0.92F * scene.lamp.radiance, 1e-5F)) << mirrored.transpose();
}

// Unoccluded irradiance of a sphere light (Ihrke's lamp is one): E = π L (r/d)² cos θ at the surface.
TEST(Tracer, LampLightFollowsTheClosedForm) {
  Scene scene;
  scene.lamp = {{0, 0, 1}, 0.05F, Rgb::Constant(200)};
  scene.surfaces.push_back({{{{-2, -2, 0}, {2, -2, 0}, {0, 3, 0}}, {{0, 1, 2}}}, PlainPaint{Rgb::Constant(0.5F)}});
  const Tracer tracer(scene, nullptr);
  const Eigen::Vector3f at(0.3F, 0.2F, 0);
  const auto mean_radiance = [&] {
    Rgb sum = Rgb::Zero();
    Sampler sampler(7);
    constexpr int samples = 4000;
    for (int i = 0; i < samples; ++i) {
      sampler.start_sample(i);
      sum += tracer.radiance({at + Eigen::Vector3f(0, 0, 0.1F), -Eigen::Vector3f::UnitZ()}, std::nullopt, sampler);
    }
    return (sum / samples).eval();
  };
  const float d2 = at.squaredNorm() + 1;
  const float lamp = 0.5F * 200 * 0.05F * 0.05F / d2 / std::sqrt(d2);  // albedo/π · π L (r/d)² cos θ
  const Rgb measured = mean_radiance();
  scene.lamp.radiance = Rgb::Zero();
  const Rgb without_lamp = mean_radiance();
  EXPECT_NEAR((measured - without_lamp).mean(), lamp, 0.01F * lamp);
}

TEST(Sensor, RoundTripsRadianceThroughTheResponse) {
  const Sensor sensor = desk_sensor();
  ImageF radiance(64, 64, 3, 0);
  for (std::size_t i = 0; i < radiance.data.size(); ++i) {
    const std::size_t cell = i / 3 % 64 / 2;  // a Bayer cell is lit evenly; from 0.01 to 400
    radiance.data[i] = 0.01F * std::pow(40000.F, static_cast<float>(cell) / 31);
  }
  const ImageU16 codes = sensor.expose(radiance, 0.01, {0, 0, 64, 64}, 5);
  Frame frame;
  frame.info.exposure_s = 0.01;
  frame.pixels = codes;
  const ImageF back = linearize(frame, sensor.format, sensor.response);
  for (int x = 0; x < 64; x += 2) {
    double sum = 0;
    for (int y = 0; y < 64; ++y) sum += static_cast<double>(back.at(x, y)) + static_cast<double>(back.at(x + 1, y));
    const double truth = static_cast<double>(radiance.at(x, 0));
    EXPECT_NEAR(sum / 128, truth, 0.01 * truth + 0.002) << x;
  }
}

TEST(Capture, SameSeedSameBytes) {
  const CaptureOptions options{10, 128, 4, 1, 1, 1};
  const fs::path a = fresh_folder("a");
  const fs::path b = fresh_folder("b");
  write_capture(a, options, {});
  write_capture(b, options, {});
  const auto files = all_files(a);
  EXPECT_GT(files.size(), 10U + 12U + 10U);
  EXPECT_EQ(files, all_files(b));
  CaptureOptions other = options;
  other.seed = 5;
  const fs::path c = fresh_folder("c");
  write_capture(c, other, {});
  EXPECT_NE(files.at("frames/00003.png"), bytes_of(c / "frames/00003.png"));
  EXPECT_THROW(write_capture(a, options, {}), InputError);
  for (const fs::path& folder : {a, b, c}) fs::remove_all(folder);
}

// AprilTag reads the rendered tags where truth projects them: the orientation, the size and the pixel convention.
TEST(Capture, TagsAreWhereTruthSaysTheyAre) {
  const Scene scene = desk_scene(1);
  const MirrorPlate plate(desk_mirror(), 0.92);
  const Tracer tracer(scene, &plate);
  const CameraModel camera = desk_camera(512);
  const Rigid3 cam_from_world = desk_cam_from_world(0);
  const MotionInput input{cam_from_world.inverse().translation, scene.lamp.centre_in_world.cast<double>(),
                          plate.half_size_m()};
  const Rigid3 pose = mirror_pose(input, {0, 0, 0}, Eigen::Vector3d(-0.2, 0.3, 1).normalized(), 0.05);
  const ImageF rgb = render(tracer, {camera, cam_from_world, pose, {0, 0, 512, 512}, 8, 1, {}});
  ImageF green(512, 512, 1);
  for (std::size_t i = 0; i < green.data.size(); ++i) green.data[i] = rgb.data[3 * i + 1];

  std::vector<double> errors;
  int mirror_tags = 0;
  int world_tags = 0;
  for (const TagDetection& tag : TagDetector({}).detect(green)) {
    const PlanarTag* on_mirror = plate.target().find(tag.id);
    const WorldTag* on_table = scene.world.find(tag.id);
    ASSERT_TRUE(on_mirror != nullptr || on_table != nullptr) << tag.id;
    mirror_tags += on_mirror != nullptr ? 1 : 0;
    world_tags += on_table != nullptr ? 1 : 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const Eigen::Vector3d x_in_world = on_mirror != nullptr
                                             ? pose * (Eigen::Vector3d() << on_mirror->corners_m()[k], 0).finished()
                                             : on_table->corners_in_world()[k];
      errors.push_back((camera.project(cam_from_world * x_in_world) - tag.corners_px[k]).norm());
    }
  }
  EXPECT_GE(mirror_tags, 18);
  EXPECT_GE(world_tags, 1);
  std::nth_element(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2), errors.end());
  EXPECT_LT(errors[errors.size() / 2], 0.3);
  RecordProperty("median_corner_error_px", std::to_string(errors[errors.size() / 2]));
}

}  // namespace
}  // namespace mf::sim
