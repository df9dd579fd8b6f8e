// SPDX-License-Identifier: Apache-2.0
#include "host/composite/composite.h"

#include <algorithm>
#include <cmath>

#include "common/check.h"

namespace mf {

namespace {

// Mean of the plate over a plane texel, from 4×4 points of it; w: the share of points that the plate holds.
Eigen::Vector4f texel_of_plate(const ImageF& plate, const View& view, const Rigid3& cam_from_plane,
                               const GroundRadiance& ground, int column, int row) {
  constexpr int points = 4;  // a texel spans a few pixels of a usual plate
  const Eigen::Vector2f texel =
      (ground.max_m - ground.min_m).cwiseQuotient(Eigen::Vector2f(ground.width, ground.height));
  Eigen::Vector4f sum = Eigen::Vector4f::Zero();
  for (int i = 0; i < points * points; ++i) {
    const int across = i % points, down = i / points;
    const Eigen::Vector2f offset((static_cast<float>(across) + 0.5F) / points - 0.5F,
                                 (static_cast<float>(down) + 0.5F) / points - 0.5F);
    const Eigen::Vector2f p = ground.position(column, row) + texel.cwiseProduct(offset);
    const Eigen::Vector3d in_cam = cam_from_plane * Eigen::Vector3d(p.x(), p.y(), 0);
    if (in_cam.z() <= 0) continue;
    const Eigen::Vector2d pixel = view.camera.project(in_cam);
    if (!(pixel.x() >= 0 && pixel.x() < plate.width && pixel.y() >= 0 && pixel.y() < plate.height)) continue;
    const float* rgb = &plate.data[plate.index(static_cast<int>(pixel.x()), static_cast<int>(pixel.y()))];
    sum += Eigen::Vector4f(rgb[0], rgb[1], rgb[2], 1);
  }
  return sum.w() > 0
             ? Eigen::Vector4f(sum.x() / sum.w(), sum.y() / sum.w(), sum.z() / sum.w(), sum.w() / (points * points))
             : Eigen::Vector4f(Eigen::Vector4f::Zero());
}

// A square picture of colours with weights (w, 0 to 1).
struct Weighted {
  int size = 0;
  std::vector<Eigen::Vector4f> texels;

  [[nodiscard]] const Eigen::Vector4f& at(int x, int y) const {
    return texels[static_cast<std::size_t>(std::clamp(y, 0, size - 1) * size + std::clamp(x, 0, size - 1))];
  }
};

Weighted pull(const Weighted& fine) {
  Weighted coarse{(fine.size + 1) / 2, {}};
  for (int y = 0; y < coarse.size; ++y)
    for (int x = 0; x < coarse.size; ++x) {
      Eigen::Vector3f colour = Eigen::Vector3f::Zero();
      float weight = 0;
      for (int k = 0; k < 4; ++k) {
        const Eigen::Vector4f& t = fine.at(2 * x + k % 2, 2 * y + k / 2);
        colour += t.w() * t.head<3>();
        weight += t.w();
      }
      if (weight > 0) colour /= weight;
      coarse.texels.emplace_back(colour.x(), colour.y(), colour.z(), std::min(1.F, weight));
    }
  return coarse;
}

// Texels that are not wholly known take the rest from the coarser picture.
void push(Weighted& fine, const Weighted& coarse) {
  for (int y = 0; y < fine.size; ++y)
    for (int x = 0; x < fine.size; ++x) {
      Eigen::Vector4f& t = fine.texels[static_cast<std::size_t>(y * fine.size + x)];
      if (t.w() >= 1) continue;
      // The coarse texel's three quarters and its neighbours' quarter: bilinear at the fine texel's centre.
      const int x0 = x / 2, y0 = y / 2;
      const int x1 = x0 + (x % 2 == 0 ? -1 : 1), y1 = y0 + (y % 2 == 0 ? -1 : 1);
      const Eigen::Vector4f rest = 0.5625F * coarse.at(x0, y0) + 0.1875F * coarse.at(x1, y0) +
                                   0.1875F * coarse.at(x0, y1) + 0.0625F * coarse.at(x1, y1);
      t.head<3>() = t.w() * t.head<3>() + (1 - t.w()) * rest.head<3>();
      t.w() = 1;
    }
}

void fill_unseen(Weighted& picture) {
  if (picture.size <= 1) return;
  Weighted coarse = pull(picture);
  fill_unseen(coarse);
  push(picture, coarse);
}

bool changes(float with, float without) {
  return std::abs(with - without) > 0.01F * without;
}

}  // namespace

GroundRadiance plate_on_ground(const ImageF& plate, const View& view, const PlaneRectangle& plane,
                               const Bounds& object_in_plane) {
  constexpr int texels_a_side = 256;  // 4 % of the object's radius each
  GroundRadiance ground = ground_around(object_in_plane, texels_a_side);
  const Rigid3 cam_from_plane = view.cam_from_world * plane.world_from_plane;
  Weighted picture{texels_a_side, {}};
  for (int y = 0; y < texels_a_side; ++y)
    for (int x = 0; x < texels_a_side; ++x)
      picture.texels.push_back(texel_of_plate(plate, view, cam_from_plane, ground, x, y));
  fill_unseen(picture);
  ground.texels = std::move(picture.texels);
  return ground;
}

CompositeResult composite(const IncidentLight& light, const TriangleMesh& mesh_in_world, const ImageF& plate,
                          const View& view, const CompositeOptions& options, const Progress& progress) {
  check(!options.validate(), "valid composite options");
  check(plate.channels == 3 && plate.width == view.camera.width && plate.height == view.camera.height,
        "a plate of three channels and the view's size");
  const TriangleMesh mesh = transformed(light.plane.world_from_plane.inverse(), mesh_in_world);
  CompositeResult result;
  result.layers = render({light, mesh_in_world, view, plate_on_ground(plate, view, light.plane, bounds_of(mesh))},
                         options.render, progress);
  const RenderResult& layers = result.layers;
  result.picture = ImageF(plate.width, plate.height, 3);
  const std::size_t pixels = plate.data.size() / 3;
  std::size_t changed = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    const float coverage = layers.object.data[4 * i + 3];
    bool differs = coverage > 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const float without = layers.ground_without.data[3 * i + c];
      const float with = layers.ground_with.data[3 * i + c];
      const float ratio = without > 0 ? with / without : 1;
      differs = differs || changes(with, without);
      result.picture.data[3 * i + c] = layers.object.data[4 * i + c] + (1 - coverage) * plate.data[3 * i + c] * ratio;
    }
    changed += differs ? 1 : 0;
  }
  result.changed = static_cast<double>(changed) / static_cast<double>(pixels);
  return result;
}

}  // namespace mf
