// SPDX-License-Identifier: Apache-2.0
#include "device/online_pose.h"

#include <gtest/gtest.h>

#include <chrono>
#include <numbers>

#include "device/quick_camera.h"
#include "hw-sim/desk_rig.h"
#include "hw-sim/motion.h"
#include "hw-sim/scene.h"
#include "tests/device/seen_tags.h"

namespace mf {
namespace {

using test::median_of;
using test::TagCamera;

constexpr double degree = std::numbers::pi / 180;

struct Waved {
  CameraModel camera = sim::desk_camera(1024);
  MirrorTarget mirror = sim::desk_mirror();
  Rigid3 cam_from_world = sim::desk_cam_from_world(0);
  std::vector<Rigid3> cam_from_mirror;

  explicit Waved(int frames, unsigned seed = 1) {
    const sim::MotionInput input{cam_from_world.inverse().translation, {0.4, 0.5, 0.8}, {0.235, 0.195}};
    for (const Rigid3& world_from_mirror : sim::wave_mirror(input, frames, seed))
      cam_from_mirror.push_back(cam_from_world * world_from_mirror);
  }
};

CameraModel bent(CameraModel camera) {
  camera.parameters[4] = -0.12;  // some 20 pixels in the corners
  camera.parameters[5] = 0.03;
  camera.parameters[6] = 8e-4;
  camera.parameters[7] = -5e-4;
  return camera;
}

struct PoseErrors {
  std::vector<double> position_m, rotation_rad;
  int posed = 0;
};

template <typename MakeTags>
PoseErrors errors_over(const Waved& waved, const CameraModel& camera, const MakeTags& make_tags) {
  PoseErrors out;
  for (const Rigid3& truth : waved.cam_from_mirror) {
    const std::optional<OnlinePose> found = online_mirror_pose(make_tags(truth), waved.mirror, camera);
    if (!found) continue;
    ++out.posed;
    out.position_m.push_back((found->cam_from_target.translation - truth.translation).norm());
    out.rotation_rad.push_back(rotation_angle_between(found->cam_from_target, truth));
  }
  return out;
}

TEST(OnlinePose, RecoversPosesThroughALensThatBends) {
  Waved waved(150);
  waved.camera = bent(waved.camera);
  TagCamera eye(waved.camera, 0.1, 5);
  const PoseErrors errors =
      errors_over(waved, waved.camera, [&](const Rigid3& truth) { return eye.see(waved.mirror, truth); });
  EXPECT_GE(errors.posed, 145);
  EXPECT_LT(median_of(errors.position_m), 5e-4);
  EXPECT_LT(*std::max_element(errors.position_m.begin(), errors.position_m.end()), 5e-3);
  EXPECT_LT(*std::max_element(errors.rotation_rad.begin(), errors.rotation_rad.end()), 0.7 * degree);
}

TEST(OnlinePose, ExactTagsGiveTheExactPose) {
  Waved waved(40);
  waved.camera = bent(waved.camera);
  TagCamera eye(waved.camera, 0, 5);
  const PoseErrors errors =
      errors_over(waved, waved.camera, [&](const Rigid3& truth) { return eye.see(waved.mirror, truth); });
  EXPECT_LT(*std::max_element(errors.position_m.begin(), errors.position_m.end()), 1e-6);
  EXPECT_LT(*std::max_element(errors.rotation_rad.begin(), errors.rotation_rad.end()), 1e-6);
}

// A tag seen in the mirror is mirror-written: its corners run the other way. Some get misread and lie anywhere.
TEST(OnlinePose, GhostsDontCount) {
  const Waved waved(100);
  TagCamera eye(waved.camera, 0.1, 6);
  std::uniform_real_distribution<double> place(200, 800);
  const auto with_ghosts = [&](const Rigid3& truth) {
    std::vector<TagDetection> tags = eye.see(waved.mirror, truth);
    const std::size_t real = tags.size();
    for (std::size_t i = 0; i < real / 4; ++i) {
      TagDetection ghost = tags[i];
      if (i % 2 == 0) std::reverse(ghost.corners_px.begin(), ghost.corners_px.end());
      const Eigen::Vector2d shift(place(eye.random()) - 500, place(eye.random()) - 500);
      for (Eigen::Vector2d& corner : ghost.corners_px) corner += shift;
      tags.insert(tags.begin(), ghost);  // the same id twice
    }
    // The world's tags are no business of the mirror's pose.
    for (TagDetection tag : eye.see(sim::desk_scene(1).world, waved.cam_from_world)) tags.push_back(tag);
    return tags;
  };
  const PoseErrors errors = errors_over(waved, waved.camera, with_ghosts);
  EXPECT_GE(errors.posed, 95);
  EXPECT_LT(*std::max_element(errors.position_m.begin(), errors.position_m.end()), 5e-3);
  // Nothing but ghosts is nothing.
  std::vector<TagDetection> ghosts = eye.see(waved.mirror, waved.cam_from_mirror[3]);
  ASSERT_GT(ghosts.size(), 10U);
  for (TagDetection& ghost : ghosts) std::reverse(ghost.corners_px.begin(), ghost.corners_px.end());
  EXPECT_FALSE(online_mirror_pose(ghosts, waved.mirror, waved.camera));
}

// Far, small and few: the tilt is open then. What is told must be right, and often nothing may be told.
TEST(OnlinePose, AmbiguousPosesAreNotTold) {
  Waved waved(300);
  TagCamera eye(waved.camera, 0.3, 7);
  int told = 0, silent = 0, wrong = 0;
  for (Rigid3 truth : waved.cam_from_mirror) {
    truth.translation *= 2.5;
    std::vector<TagDetection> tags = eye.see(waved.mirror, truth);
    if (tags.size() < 2) continue;
    tags.resize(2);
    const std::optional<OnlinePose> found = online_mirror_pose(tags, waved.mirror, waved.camera);
    if (!found) {
      ++silent;
      continue;
    }
    ++told;
    wrong += rotation_angle_between(found->cam_from_target, truth) > 6 * degree ? 1 : 0;
  }
  EXPECT_GT(silent, 50);
  EXPECT_LE(wrong, told / 50);
}

TEST(OnlinePose, WorldPoseGathersWhatTheHandHides) {
  const Waved waved(4);
  const WorldTarget world = sim::desk_scene(1).world;
  TagCamera eye(waved.camera, 0.3, 8);
  WorldPoseEstimate estimate(world);
  EXPECT_FALSE(estimate.pose());
  for (int frame = 0; frame < 100; ++frame) {
    std::vector<TagDetection> tags = eye.see(world, waved.cam_from_world);
    ASSERT_EQ(tags.size(), 4U);
    tags = {tags[static_cast<std::size_t>(frame / 7) % 4]};  // never two at once
    if (frame % 5 == 0)                                      // and one in five misread
      for (Eigen::Vector2d& corner : tags[0].corners_px) corner.x() += 30;
    estimate.add(tags, waved.camera);
  }
  ASSERT_TRUE(estimate.pose());
  EXPECT_EQ(estimate.times_moved(), 0);
  const Rigid3& found = estimate.pose()->cam_from_target;
  EXPECT_LT((found.inverse().translation - waved.cam_from_world.inverse().translation).norm(), 0.003);
  EXPECT_LT(rotation_angle_between(found, waved.cam_from_world), 0.15 * degree);
}

TEST(OnlinePose, AKnockedCameraIsNoticed) {
  const Waved waved(4);
  const WorldTarget world = sim::desk_scene(1).world;
  TagCamera eye(waved.camera, 0.1, 9);
  WorldPoseEstimate estimate(world);
  for (int frame = 0; frame < 40; ++frame) estimate.add(eye.see(world, waved.cam_from_world), waved.camera);
  const Rigid3 turn{Eigen::Quaterniond(Eigen::AngleAxisd(0.02, Eigen::Vector3d::UnitY())), Eigen::Vector3d::Zero()};
  const Rigid3 knocked = turn * waved.cam_from_world;
  for (int frame = 0; frame < 40; ++frame) estimate.add(eye.see(world, knocked), waved.camera);
  EXPECT_EQ(estimate.times_moved(), 1);
  ASSERT_TRUE(estimate.pose());
  EXPECT_LT(rotation_angle_between(estimate.pose()->cam_from_target, knocked), 0.1 * degree);
}

TEST(OnlinePose, TakesFarLessThanAFrame) {
  const Waved waved(60);
  TagCamera eye(waved.camera, 0.1, 10);
  std::vector<std::vector<TagDetection>> frames;
  for (const Rigid3& truth : waved.cam_from_mirror) frames.push_back(eye.see(waved.mirror, truth));
  std::vector<double> milliseconds;
  for (const std::vector<TagDetection>& tags : frames) {
    const auto start = std::chrono::steady_clock::now();
    (void)online_mirror_pose(tags, waved.mirror, waved.camera);
    milliseconds.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
  }
  RecordProperty("median_ms", std::to_string(median_of(milliseconds)));
  EXPECT_LT(median_of(milliseconds), 10);  // measured 0.6; this machine may be busy
}

class QuickCameraTest : public testing::Test {
 protected:
  // Feeds the tags frame by frame; returns how many frames it took, or nothing.
  std::optional<int> run(const CameraModel& truth, double sigma_px, unsigned seed, int frames = 400) {
    Waved waved(frames, seed);
    TagCamera eye(truth, sigma_px, seed);
    quick_.emplace(waved.mirror, truth.width, truth.height);
    std::mt19937 random(seed);
    std::shuffle(waved.cam_from_mirror.begin(), waved.cam_from_mirror.end(), random);
    for (int i = 0; i < frames; ++i) {
      quick_->add(eye.see(waved.mirror, waved.cam_from_mirror[static_cast<std::size_t>(i)]));
      if (quick_->camera()) return i + 1;
    }
    return std::nullopt;
  }
  std::optional<QuickCamera> quick_;
};

TEST_F(QuickCameraTest, FindsTheFocalLengthInAFewSeconds) {
  std::vector<double> errors;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    CameraModel truth = sim::desk_camera(1024);
    truth.parameters[2] += 9;
    truth.parameters[3] -= 14;
    const std::optional<int> frames = run(truth, 0.1, seed);
    ASSERT_TRUE(frames) << seed;
    EXPECT_LE(*frames, 120) << seed;
    errors.push_back(std::abs(quick_->camera()->fx() / truth.fx() - 1));
    EXPECT_LT(errors.back(), 0.02) << seed;
    EXPECT_EQ(quick_->camera()->fx(), quick_->camera()->fy());
  }
  EXPECT_LT(median_of(errors), 0.006);
}

TEST_F(QuickCameraTest, SaysNothingOfOneView) {
  const Waved waved(10);
  TagCamera eye(waved.camera, 0.1, 3);
  QuickCamera quick(waved.mirror, waved.camera.width, waved.camera.height);
  for (int i = 0; i < 300; ++i) quick.add(eye.see(waved.mirror, waved.cam_from_mirror[4]));
  EXPECT_FALSE(quick.camera());
  EXPECT_LE(quick.views(), 2);
}

TEST_F(QuickCameraTest, SaysNothingOfPoorTags) {
  EXPECT_FALSE(run(sim::desk_camera(1024), 6, 4, 200));
}

}  // namespace
}  // namespace mf
