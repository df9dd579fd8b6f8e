// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/camera_model.h"
#include "common/image.h"
#include "common/rigid3.h"

namespace mf {

// Three channels, as they were stored: 8-bit sRGB codes, or linear floats. A lumigraph blends them as they are, and
// gives new views in the same kind.
using Picture = std::variant<ImageU8, ImageF>;

[[nodiscard]] inline int width_of(const Picture& picture) {
  return std::visit([](const auto& image) { return image.width; }, picture);
}
[[nodiscard]] inline int height_of(const Picture& picture) {
  return std::visit([](const auto& image) { return image.height; }, picture);
}

// A photo whose camera and place are known. Camera axes x right, y down, z forward; pixel centres at +0.5.
struct PosedPhoto {
  std::string name;    // unique in its set; the file name as a rule
  CameraModel camera;  // of the picture's size
  Rigid3 cam_from_world;
  Picture picture;
  ImageU8 mask;                  // one channel of the picture's size: 0 says nothing, 255 all; empty: 255 everywhere
  std::optional<double> time_s;  // when it was taken, for scenes that move
};

struct PhotoSet {
  std::string source;  // file or folder, for messages
  std::vector<PosedPhoto> photos;
  std::vector<Eigen::Vector3f> points;  // of the scene, world, where the source knows some; else empty
};

// Where the photo was taken from, world.
[[nodiscard]] inline Eigen::Vector3d centre_of(const PosedPhoto& photo) {
  return photo.cam_from_world.inverse().translation;
}

// What is wrong with a set that came from anywhere: no photo, pictures of two kinds, a picture, mask or camera of
// another size, a pixel that is no number, a name twice. Throws InputError naming the source and the photo.
void check_photos(const PhotoSet&);

// Every picture, mask and camera at `scale` (0 < scale ≤ 1) of its size, averaged over areas.
[[nodiscard]] PhotoSet scaled(PhotoSet, double scale);

}  // namespace mf
