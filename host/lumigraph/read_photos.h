// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "host/lumigraph/posed_photo.h"

namespace mf {

// COLMAP's text model: cameras.txt, images.txt and, where it exists, points3D.txt, in `folder` or in its sparse/0 or
// sparse; pictures in images/ beside them (or in `folder` itself), masks as masks/NAME.png. Camera models:
// SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV.
// A picture whose size is not its camera's was made from the camera's by resizing: focal lengths scale with the width.
// When the aspect is the camera's (within half a pixel) the principal point scales too; else something was cut off, and
// the principal point is taken to be the picture's centre.
[[nodiscard]] PhotoSet read_colmap(const std::filesystem::path& folder);

// transforms.json of nerfstudio and instant-ngp: frames with file_path and transform_matrix (world_from_camera, x
// right, y up, looking along −z); fl_x, fl_y, cx, cy, w, h or camera_angle_x, and k1 k2 k3 p1 p2, of all frames or of
// each; mask_path and time of a frame where given. A file_path without an extension names a .png, .jpg or .exr.
[[nodiscard]] PhotoSet read_transforms(const std::filesystem::path& file);

// One of the two, the other path being empty: photos to see from between, so at least two.
[[nodiscard]] PhotoSet read_posed_photos(const std::filesystem::path& colmap_folder,
                                         const std::filesystem::path& transforms_file);

// All throw InputError naming the file, the line or field, and what to do.

}  // namespace mf
