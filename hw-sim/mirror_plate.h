// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "common/mirror_target.h"
#include "common/rigid3.h"
#include "hw-sim/printed_tags.h"
#include "hw-sim/scene.h"

namespace mf::sim {

struct Ray {
  Eigen::Vector3f origin;
  Eigen::Vector3f direction;  // unit length
};

// The hand-held mirror: a thin plate, the mirror's opening surrounded by paper with the target's tags. In its own
// frame it lies in z = 0 and reflects on the side +z; its back is grey.
class MirrorPlate {
 public:
  // Where the plate is held, ready for many rays.
  struct Placement {
    explicit Placement(const Rigid3& world_from_mirror);
    Eigen::Matrix3d mirror_from_world_rotation;
    Eigen::Vector3d mirror_from_world_translation;

    // Towards the side that was hit, in the world.
    [[nodiscard]] Eigen::Vector3f normal(bool front) const {
      return (front ? 1.F : -1.F) * mirror_from_world_rotation.row(2).transpose().cast<float>();
    }
  };

  MirrorPlate(const MirrorTarget&, double reflectance);

  struct Hit {
    float distance;
    bool front;         // the side +z
    Eigen::Vector2f p;  // in the mirror's frame
  };
  // Nearest hit with distance in (nearest, farthest).
  [[nodiscard]] std::optional<Hit> intersect(const Placement&, const Ray&, float nearest, float farthest) const;

  [[nodiscard]] bool is_mirror(const Hit&) const;  // the reflecting side, inside the opening
  [[nodiscard]] Rgb albedo(const Hit&) const;      // of the frame or the back
  [[nodiscard]] float reflectance() const { return reflectance_; }
  [[nodiscard]] const MirrorTarget& target() const { return target_; }
  [[nodiscard]] Eigen::Vector2d half_size_m() const { return half_size_; }  // of the plate, frame included

 private:
  MirrorTarget target_;
  PrintedTags tags_;
  Eigen::Vector2d half_size_;
  float reflectance_;
};

// The direction of a mirrored ray: d − 2 (d·n) n.
[[nodiscard]] inline Eigen::Vector3f reflect(const Eigen::Vector3f& direction, const Eigen::Vector3f& normal) {
  return direction - 2 * direction.dot(normal) * normal;
}

}  // namespace mf::sim
