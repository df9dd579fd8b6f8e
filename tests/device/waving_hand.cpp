// SPDX-License-Identifier: Apache-2.0
#include "tests/device/waving_hand.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hw-sim/desk_rig.h"
#include "hw-sim/scene.h"

namespace mf::test {

namespace {

using Eigen::Vector3d;

constexpr double degree = std::numbers::pi / 180;
constexpr double hand_m_s = 0.5, hand_rad_s = 60 * degree;
constexpr double slow_m_s = 0.12, slow_rad_s = 20 * degree;  // "a little"
constexpr std::size_t lag_frames = 3;                        // a quarter of a second
constexpr int reduction = 8;
constexpr int look_each = 4;  // frames

double hit_globe(const Vector3d& at, const Vector3d& from, const Vector3d& centre, double radius) {
  const Vector3d to = centre - at;
  const double along = to.dot(from);
  return along > 0 && (to - along * from).norm() < radius ? along : -1;
}

}  // namespace

Surroundings lamp_in_a_dark_room() {
  return [](const Vector3d& at, const Vector3d& from) {
    if (hit_globe(at, from, {0.35, 0.45, 0.8}, 0.045) > 0) return 300.0;
    return 0.1 + 0.1 * from.z();
  };
}

Surroundings windows_and_sky() {
  return [](const Vector3d& at, const Vector3d& from) {
    constexpr double wall_y = 2;
    const double t = from.y() > 0 ? (wall_y - at.y()) / from.y() : -1;
    const Vector3d on_wall = at + t * from;
    const bool window = t > 0 && std::abs(std::abs(on_wall.x()) - 0.75) < 0.45 && std::abs(on_wall.z() - 1.2) < 0.55;
    if (window) return on_wall.z() > 1.1 ? 25.0 : 8.0;  // sky over a garden
    return 0.4 + 0.2 * from.z();
  };
}

Surroundings uniform_light() {
  return [](const Vector3d&, const Vector3d&) { return 1.0; };
}

MirrorReach desk_reach() {
  return {sim::desk_camera(1024), sim::desk_cam_from_world(0), sim::desk_mirror()};
}

CoverageOptions desk_coverage() {
  CoverageOptions options;
  options.plane = {{0, 0}, {0.34, 0.34}};
  return options;
}

ImageF mirrored(const MirrorReach& reach, const Rigid3& world_from_mirror, const Surroundings& light, int times) {
  const CameraModel& camera = reach.camera();
  ImageF out(camera.width / times, camera.height / times, 1);
  const Rigid3 cam_from_mirror = reach.cam_from_world() * world_from_mirror;
  const Vector3d centre = virtual_centre(reach.camera_in_world(), world_from_mirror);
  const Vector3d normal = cam_from_mirror.rotation * Vector3d::UnitZ();
  const Rigid3 mirror_from_cam = cam_from_mirror.inverse();
  Eigen::Vector2d low(1e9, 1e9), high(-1e9, -1e9);  // of the opening, in pixels of the small picture
  for (const double x : {-0.5, 0.5})
    for (const double y : {-0.5, 0.5}) {
      const Vector3d corner = cam_from_mirror * Vector3d(x * reach.opening_m().x(), y * reach.opening_m().y(), 0);
      const Eigen::Vector2d pixel = camera.project(corner) / times;
      low = low.cwiseMin(pixel), high = high.cwiseMax(pixel);
    }
  const auto from = [](double v) { return std::max(0, static_cast<int>(v)); };
  for (int y = from(low.y()); y < std::min<double>(out.height, high.y()); ++y)
    for (int x = from(low.x()); x < std::min<double>(out.width, high.x()); ++x) {
      const Vector3d ray((times * (x + 0.5) - camera.cx()) / camera.fx(),
                         (times * (y + 0.5) - camera.cy()) / camera.fy(), 1);
      const double t = normal.dot(cam_from_mirror.translation) / normal.dot(ray);
      const Vector3d in_mirror = mirror_from_cam * Vector3d(t * ray);
      if (!(t > 0) || (in_mirror.head<2>().cwiseAbs().array() > 0.5 * reach.opening_m().array()).any()) continue;
      const Vector3d at = world_from_mirror * in_mirror;
      out.at(x, y) = static_cast<float>(light(at, (at - centre).normalized()));
    }
  return out;
}

Hand::Hand(const MirrorReach& reach, unsigned seed) : reach_(&reach), random_(seed) {
  world_from_mirror_ = anywhere({{0, 0}, {0.1, 0.1}});
  last_seen_ = world_from_mirror_;
}

Rigid3 Hand::anywhere(const LightPlane& plane) {
  std::uniform_real_distribution<double> unit(0, 1);
  while (true) {
    const double z = unit(random_), turn = 2 * std::numbers::pi * unit(random_), r = std::sqrt(1 - z * z);
    const Eigen::Vector2d p =
        plane.centre_in_world + Eigen::Vector2d(unit(random_) - 0.5, unit(random_) - 0.5).cwiseProduct(plane.size_m);
    const Vector3d direction(r * std::cos(turn), r * std::sin(turn), z);
    if (const auto place = reach_->showing({p.x(), p.y(), 0}, direction, reach_->picture_right())) return *place;
  }
}

void Hand::approach(const Rigid3& place, double seconds) {
  const Vector3d way = place.translation - world_from_mirror_.translation;
  const double turn = rotation_angle_between(place, world_from_mirror_);
  const double needed_s = std::max(way.norm() / hand_m_s, turn / hand_rad_s);
  const double share = needed_s > seconds ? seconds / needed_s : 1;
  world_from_mirror_.translation += share * way;
  world_from_mirror_.rotation = world_from_mirror_.rotation.slerp(share, place.rotation);
}

void Hand::wander(const LightPlane& plane, double seconds) {
  if (goal_ && (goal_->translation - world_from_mirror_.translation).norm() < 1e-6 &&
      rotation_angle_between(*goal_, world_from_mirror_) < 1e-6)
    goal_.reset();
  if (!goal_) goal_ = anywhere(plane);
  approach(*goal_, seconds);
}

void Hand::obey(const HandMotion& told, double seconds) {
  heard_.push_back(told);
  if (heard_.size() <= lag_frames) return;
  const HandMotion now = heard_.front();
  heard_.pop_front();
  if (!seen(world_from_mirror_)) {
    heard_.clear();
    return approach(last_seen_, seconds);
  }
  last_seen_ = world_from_mirror_;
  doing_s_ += seconds;
  if (now != doing_ || doing_s_ > 1) {  // a new sentence is understood anew, and an old one after a while
    doing_ = now;
    doing_s_ = 0;
    listens_ = std::uniform_real_distribution<double>(0, 1)(random_) > 0.1;
    swerve_ = 0.2 * Vector3d(normal(), normal(), normal());
    twist_ = 0.2 * Vector3d(normal(), normal(), normal());
    pace_ = std::clamp(1 + 0.25 * normal(), 0.4, 1.0);
  }
  if (!listens_) return;
  Vector3d move = now.move.cast<double>(), turn(-now.tilt.y(), now.tilt.x(), 0);
  if (!now.move.isZero())
    move = (move.normalized() + swerve_).normalized() * pace_ * (now.move_a_little ? slow_m_s : hand_m_s);
  if (!now.tilt.isZero())
    turn = (turn.normalized() + twist_).normalized() * pace_ * (now.tilt_a_little ? slow_rad_s : hand_rad_s);
  const Eigen::Quaterniond world_from_cam = reach_->cam_from_world().rotation.conjugate();
  world_from_mirror_.translation += seconds * (world_from_cam * move);
  const double angle = seconds * turn.norm();
  if (angle > 0)
    world_from_mirror_.rotation =
        (Eigen::Quaterniond(Eigen::AngleAxisd(angle, world_from_cam * turn.normalized())) * world_from_mirror_.rotation)
            .normalized();
  const double above = reach_->above_plane_m(world_from_mirror_);
  if (above < 0.005) world_from_mirror_.translation.z() += 0.005 - above;  // the table is in the way
}

Rigid3 Hand::held() {
  Rigid3 out = world_from_mirror_;
  out.translation += 0.002 * Vector3d(normal(), normal(), normal());
  const Vector3d turn = 0.5 * degree * Vector3d(normal(), normal(), normal());
  out.rotation = (Eigen::Quaterniond(Eigen::AngleAxisd(turn.norm(), turn.normalized())) * out.rotation).normalized();
  return out;
}

namespace {

class Counting {
 public:
  Counting(const Surroundings& light, const std::function<void(int, const CoverageStatus&)>& look)
      : light_(light), look_(look) {}

  // True when it is done.
  bool frame(const MirrorReach& reach, Coverage& coverage, const Rigid3& held) {
    if (reach.allows(held))
      coverage.add(reach.cam_from_world() * held, mirrored(reach, held, light_, reduction), reduction);
    if (out.frames++ % look_each != 0) return false;
    const CoverageStatus status = coverage.status();
    out.covered.push_back(status.covered);
    if (look_) look_(out.frames, status);
    out.reached = status.done;
    return status.done;
  }
  Waved out;

 private:
  const Surroundings& light_;
  const std::function<void(int, const CoverageStatus&)>& look_;
};

}  // namespace

Waved wave(Waving how, const Surroundings& light, const CoverageOptions& options, unsigned seed, int most_frames,
           const std::function<void(int, const CoverageStatus&)>& look) {
  const MirrorReach reach = desk_reach();
  Coverage coverage(options, reach);
  Guidance guidance;
  Hand hand(reach, seed);
  Counting counting(light, look);
  HandMotion told;
  for (int i = 0; i < most_frames; ++i) {
    const Rigid3 held = hand.held();
    if (counting.frame(reach, coverage, held)) break;
    if (how == Waving::random) {
      hand.wander(options.plane, 1 / frame_rate_hz);
      continue;
    }
    if (hand.seen(held))
      told = guidance.advise(coverage, reach.cam_from_world() * held, i / frame_rate_hz) ? guidance.motion()
                                                                                         : HandMotion{};
    hand.obey(told, 1 / frame_rate_hz);
  }
  return counting.out;
}

Waved wave(const std::vector<Rigid3>& world_from_mirror, const Surroundings& light,
           const std::function<void(int, const CoverageStatus&)>& look) {
  const MirrorReach reach = desk_reach();
  Coverage coverage(desk_coverage(), reach);
  Counting counting(light, look);
  for (const Rigid3& held : world_from_mirror)
    if (counting.frame(reach, coverage, held)) break;
  return counting.out;
}

}  // namespace mf::test
