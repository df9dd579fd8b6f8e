// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "common/rigid3.h"
#include "device/coverage.h"
#include "device/rig_status.h"

namespace mf {

// What the operator is asked to do, in the camera's picture as the phone shows it: x right, y down, z away.
struct HandMotion {
  Eigen::Vector3i move = Eigen::Vector3i::Zero();  // of the whole mirror: −1, 0 or 1 along each axis, not all three
  Eigen::Vector2i tilt = Eigen::Vector2i::Zero();  // which edge or corner comes towards the camera: (−1, −1) top left
  bool move_a_little = false;
  bool tilt_a_little = false;

  [[nodiscard]] bool operator==(const HandMotion&) const = default;
};
// One short line: "move it left, tilt the top right corner towards the camera a little".
[[nodiscard]] std::string sentence(const HandMotion&);

struct GuidanceOptions {
  double hand_m_s = 0.5;     // > 0; how fast a hand moves and turns a mirror,
  double hand_rad_s = 1.05;  // > 0; to tell what is near
  double react_s = 1;        // > 0; that any new place costs besides
  double lead_s = 0.3;       // ≥ 0; what is said is right for where the mirror will be when it is obeyed
  double patience_s = 5;     // > 0; a place not reached in this time is given up for another,
  double not_again_s = 30;   // ≥ 0; and its patch is left alone for so long
  double better = 1.8;       // > 1; another place must promise so many times more per second to be preferred
  double hold_s = 0.15;      // ≥ 0; a sentence stays at least so long
  double near_m = 0.035;     // ≥ 0; no move is asked for less
  double near_rad = 0.06;    // ≥ 0; no tilt
  double little_m = 0.07;    // less than this is "a little"
  double little_rad = 0.15;
};

// Which way next. It chooses the place of the mirror that adds most to the coverage per second that the hand needs to
// get there, sticks to it until what it promised is seen, and says how to get there from where the mirror is.
class Guidance {
 public:
  explicit Guidance(const GuidanceOptions& = {});

  // The advice after a frame at `seconds` (rising), whose mirror's pose is known. Nothing when all is covered.
  // Some 1 ms, and less between changes of the place.
  [[nodiscard]] std::optional<CaptureAdvice> advise(Coverage&, const Rigid3& cam_from_mirror, double seconds);

  // Where the mirror is wanted (world_from_mirror).
  [[nodiscard]] std::optional<Rigid3> wanted() const {
    return place_ ? std::optional(place_->world_from_mirror) : std::nullopt;
  }
  // What the last advice's text was made from.
  [[nodiscard]] const HandMotion& motion() const { return motion_; }

 private:
  struct Place {
    int patch = 0, cell = 0;
    Rigid3 world_from_mirror;
    double promised = 0;  // of the coverage, when it was chosen
    double since_s = 0;
  };
  [[nodiscard]] double travel_s(const Rigid3& from, const Rigid3& to) const;
  [[nodiscard]] std::optional<Place> best_place(Coverage&, const Rigid3& world_from_mirror, double seconds) const;
  void choose(Coverage&, const Rigid3& world_from_mirror, double seconds);
  [[nodiscard]] Rigid3 soon(const Rigid3& cam_from_mirror, double seconds);
  [[nodiscard]] HandMotion towards(const Rigid3& from_in_cam, const Rigid3& to_in_cam) const;
  [[nodiscard]] HandMotion kept_in_sight(HandMotion, const MirrorReach&, const Rigid3& cam_from_mirror) const;

  GuidanceOptions options_;
  std::optional<Place> place_;
  std::map<int, double> given_up_;               // patch → when, seconds
  std::deque<std::pair<double, Rigid3>> track_;  // of the last moments: seconds, cam_from_mirror
  double last_search_s_ = -1e9;
  HandMotion motion_;
  double motion_since_s_ = -1e9;
};

}  // namespace mf
