// SPDX-License-Identifier: Apache-2.0
#include "device/guidance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "common/plane_pose.h"

namespace mf {

namespace {

using Eigen::Vector3d;

constexpr double degree = std::numbers::pi / 180;

// The signs of the components that matter: those of some size beside the longest, at most two of them. What was said
// last stays a little longer.
template <int N>
Eigen::Matrix<int, N, 1> main_axes(const Eigen::Matrix<double, N, 1>& v, double least,
                                   const Eigen::Matrix<int, N, 1>& last) {
  Eigen::Matrix<int, N, 1> out = Eigen::Matrix<int, N, 1>::Zero();
  const double longest = v.cwiseAbs().maxCoeff();
  if (!(longest > least)) return out;
  constexpr double matters = 0.5, still_matters = 0.3;  // of the longest
  for (int i = 0; i < N; ++i) {
    const int sign = v[i] < 0 ? -1 : 1;
    if (std::abs(v[i]) >= (sign == last[i] ? still_matters : matters) * longest) out[i] = sign;
  }
  Eigen::Index shortest = 0;
  v.cwiseAbs().minCoeff(&shortest);
  if (out.cwiseAbs().sum() > 2) out[shortest] = 0;
  return out;
}

std::string words_of_move(const Eigen::Vector3i& m) {
  std::string way;
  const auto add = [&](const char* word) { way += (way.empty() ? "" : " and ") + std::string(word); };
  if (m.y() != 0) add(m.y() < 0 ? "up" : "down");
  if (m.x() != 0) add(m.x() < 0 ? "left" : "right");
  if (m.z() != 0) add(m.z() < 0 ? "nearer to the camera" : "away from the camera");
  return "move it " + way;
}

std::string words_of_tilt(const Eigen::Vector2i& t) {
  const std::string row = t.y() < 0 ? "top" : "bottom", column = t.x() < 0 ? "left" : "right";
  const std::string part =
      t.y() == 0 ? column + " edge" : (t.x() == 0 ? row + " edge" : row + " " + column + " corner");
  return "tilt the " + part + " towards the camera";
}

// The turn, as axis times angle, that takes the mirror's normal to the wanted one the short way.
Vector3d turn_between(const Rigid3& from, const Rigid3& to) {
  const Vector3d a = from.rotation * Vector3d::UnitZ(), b = to.rotation * Vector3d::UnitZ();
  const Vector3d axis = a.cross(b);
  const double sine = axis.norm();
  return sine > 1e-9 ? Vector3d(std::atan2(sine, a.dot(b)) / sine * axis) : Vector3d::Zero();
}

}  // namespace

namespace {

// The mirror on its way, the last being `to`.
std::array<Rigid3, 5> way(const Rigid3& from, const Rigid3& to) {
  std::array<Rigid3, 5> out;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const double share = static_cast<double>(i + 1) / static_cast<double>(out.size());
    out[i] = {from.rotation.slerp(share, to.rotation), (1 - share) * from.translation + share * to.translation};
  }
  return out;
}

}  // namespace

std::string sentence(const HandMotion& m) {
  const auto with_amount = [](const std::string& words, bool little) { return words + (little ? " a little" : ""); };
  const bool moves = !m.move.isZero(), tilts = !m.tilt.isZero();
  if (!moves && !tilts) return "good: go on around here";
  std::string text = moves ? with_amount(words_of_move(m.move), m.move_a_little) : "";
  if (tilts) text += (moves ? ", " : "") + with_amount(words_of_tilt(m.tilt), m.tilt_a_little);
  return text;
}

Guidance::Guidance(const GuidanceOptions& options) : options_(options) {}

double Guidance::travel_s(const Rigid3& from, const Rigid3& to) const {
  const double move_s = (from.translation - to.translation).norm() / options_.hand_m_s;
  return options_.react_s + std::max(move_s, turn_between(from, to).norm() / options_.hand_rad_s);
}

// A rough look at every patch through its most wanted cell, and a close one at the most promising of these.
std::optional<Guidance::Place> Guidance::best_place(Coverage& coverage, const Rigid3& here, double seconds) const {
  struct Rough {
    int patch, cell;
    double rate;
  };
  std::vector<Rough> roughs;
  const DirectionGrid& grid = coverage.directions();
  const Vector3d centre = virtual_centre(coverage.reach().camera_in_world(), here);
  const Vector3d shown = (here.translation - centre).normalized();
  for (int patch = 0; patch < grid.patches(); ++patch) {
    const auto given_up = given_up_.find(patch);
    if (given_up != given_up_.end() && seconds - given_up->second < options_.not_again_s) continue;
    const double turn_s =
        0.5 * std::acos(std::clamp(shown.dot(grid.patch_centre(patch)), -1.0, 1.0)) / options_.hand_rad_s;
    Rough best{patch, 0, 0};
    for (int cell = 0; cell < coverage.cell_count(); ++cell) {
      const double rate = coverage.wanted(patch, cell) / (options_.react_s + turn_s);
      if (rate > best.rate) best = {patch, cell, rate};
    }
    if (best.rate > 0) roughs.push_back(best);
  }
  constexpr std::size_t close_looks = 80;
  const std::size_t looks = std::min(close_looks, roughs.size());
  std::partial_sort(roughs.begin(), roughs.begin() + static_cast<std::ptrdiff_t>(looks), roughs.end(),
                    [](const Rough& a, const Rough& b) { return a.rate > b.rate; });
  const Vector3d right = here.rotation * Vector3d::UnitX();
  std::optional<Place> best;
  double best_rate = 0;
  for (std::size_t i = 0; i < looks; ++i) {
    const Rough& rough = roughs[i];
    const std::optional<Rigid3> pose =
        coverage.reach().showing(coverage.cell_centre(rough.cell), grid.patch_centre(rough.patch), right);
    if (!pose) continue;
    const double rate = coverage.gain(way(here, *pose)) / travel_s(here, *pose);
    if (!(rate > best_rate)) continue;
    best_rate = rate;
    best = Place{rough.patch, rough.cell, *pose, coverage.gain({&*pose, 1}), seconds};
  }
  return best;
}

void Guidance::choose(Coverage& coverage, const Rigid3& here, double seconds) {
  constexpr double choose_each_s = 0.25;  // it is the dearer part
  if (seconds - last_search_s_ < choose_each_s) return;
  last_search_s_ = seconds;
  const double still = place_ ? coverage.gain({&place_->world_from_mirror, 1}) : 0;
  constexpr double seen_share = 0.5;  // of the promise that is left when the place is as good as seen
  const bool spent = !place_ || still < seen_share * place_->promised;
  const bool late = place_ && seconds - place_->since_s > options_.patience_s;
  if (late) given_up_[place_->patch] = seconds;
  const std::optional<Place> found = best_place(coverage, here, seconds);
  if (!found) {
    if (!spent && !late) return;
    place_.reset();
    given_up_.clear();  // nothing else is left: try them again
    return;
  }
  const auto rate_to = [&](const Rigid3& there) { return coverage.gain(way(here, there)) / travel_s(here, there); };
  if (spent || late || rate_to(found->world_from_mirror) > options_.better * rate_to(place_->world_from_mirror))
    place_ = found;
}

HandMotion Guidance::towards(const Rigid3& from, const Rigid3& to) const {
  const Vector3d move = to.translation - from.translation;
  const Vector3d turn = turn_between(from, to);
  // A turn about x (right) takes y (down) away from the camera, so the top comes near; one about y brings the right.
  // One in the picture's plane shows nothing new.
  const Eigen::Vector2d nearer(turn.y(), -turn.x());
  HandMotion motion;
  motion.move = main_axes<3>(move, options_.near_m, motion_.move);
  motion.tilt = main_axes<2>(nearer, options_.near_rad, motion_.tilt);
  motion.move_a_little = move.norm() < options_.little_m * (motion_.move_a_little ? 1.2 : 1);
  motion.tilt_a_little = turn.norm() < options_.little_rad * (motion_.tilt_a_little ? 1.2 : 1);
  return motion;
}

// Without what would take the mirror out of sight within a moment: the move or the tilt, whichever keeps it, or both.
HandMotion Guidance::kept_in_sight(HandMotion motion, const MirrorReach& reach, const Rigid3& cam_from_mirror) const {
  constexpr double moment_s = 0.2;
  const auto seen_after = [&](const HandMotion& m) {
    Eigen::Matrix<double, 6, 1> step;
    const double turn = moment_s * options_.hand_rad_s * (m.tilt_a_little ? 0.3 : 1);
    const double shift = moment_s * options_.hand_m_s * (m.move_a_little ? 0.3 : 1);
    step << -turn * m.tilt.y(), turn * m.tilt.x(), 0, shift * m.move.cast<double>();
    return reach.sees(reach.cam_from_world().inverse() * moved(cam_from_mirror, step));
  };
  if (seen_after(motion)) return motion;
  HandMotion only_move = motion, only_tilt = motion;
  only_move.tilt.setZero();
  only_tilt.move.setZero();
  if (!motion.tilt.isZero() && seen_after(only_tilt)) return only_tilt;
  if (!motion.move.isZero() && seen_after(only_move)) return only_move;
  return motion;
}

// Where the mirror will be if it goes on as in the last moments.
Rigid3 Guidance::soon(const Rigid3& cam_from_mirror, double seconds) {
  constexpr double moments_s = 0.3;
  track_.emplace_back(seconds, cam_from_mirror);
  while (seconds - track_.front().first > moments_s) track_.pop_front();
  const auto& [then_s, then] = track_.front();
  if (!(seconds - then_s > 0.5 * moments_s)) return cam_from_mirror;
  const double share = options_.lead_s / (seconds - then_s);
  Eigen::AngleAxisd turn(cam_from_mirror.rotation * then.rotation.conjugate());
  if (turn.angle() > std::numbers::pi) turn.angle() -= 2 * std::numbers::pi;
  return {(Eigen::Quaterniond(Eigen::AngleAxisd(share * turn.angle(), turn.axis())) * cam_from_mirror.rotation)
              .normalized(),
          cam_from_mirror.translation + share * (cam_from_mirror.translation - then.translation)};
}

std::optional<CaptureAdvice> Guidance::advise(Coverage& coverage, const Rigid3& cam_from_mirror, double seconds) {
  const Rigid3 ahead = soon(cam_from_mirror, seconds);
  const Rigid3 world_from_mirror = coverage.reach().cam_from_world().inverse() * ahead;
  choose(coverage, world_from_mirror, seconds);
  if (!place_) return std::nullopt;
  const HandMotion wanted = kept_in_sight(towards(ahead, coverage.reach().cam_from_world() * place_->world_from_mirror),
                                          coverage.reach(), ahead);
  if (wanted != motion_ && seconds - motion_since_s_ >= options_.hold_s) {
    motion_ = wanted;
    motion_since_s_ = seconds;
  }
  const Vector3d& direction = coverage.directions().patch_centre(place_->patch);
  return CaptureAdvice{std::atan2(direction.y(), direction.x()) / degree, std::asin(direction.z()) / degree,
                       sentence(motion_)};
}

}  // namespace mf
