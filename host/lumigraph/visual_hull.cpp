// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/visual_hull.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/check.h"
#include "common/dense.h"
#include "common/error.h"
#include "host/lumigraph/marching_tetrahedra.h"

namespace mf {

namespace {

constexpr float far_away = 1e10F;  // its square is a float too
constexpr std::uint8_t outline = 128;

// Squared distance to the nearest pixel with value 0 along a line of squared distances: the lower envelope of parabolas
// (Felzenszwalb, Huttenlocher 2012).
void relax_line(std::span<float> line, std::vector<int>& at, std::vector<float>& from, std::vector<float>& out) {
  const auto n = static_cast<int>(line.size());
  const auto value = [&](int i) { return line[static_cast<std::size_t>(i)]; };
  int k = 0;
  at[0] = 0;
  from[0] = -std::numeric_limits<float>::infinity();
  const auto crossing = [&](int p, int q) {
    return ((value(q) + static_cast<float>(q * q)) - (value(p) + static_cast<float>(p * p))) /
           static_cast<float>(2 * (q - p));
  };
  for (int q = 1; q < n; ++q) {
    float s = crossing(at[static_cast<std::size_t>(k)], q);
    while (k > 0 && s <= from[static_cast<std::size_t>(k)]) s = crossing(at[static_cast<std::size_t>(--k)], q);
    ++k;
    at[static_cast<std::size_t>(k)] = q;
    from[static_cast<std::size_t>(k)] = s;
  }
  const int last = k;
  k = 0;
  for (int q = 0; q < n; ++q) {
    while (k < last && from[static_cast<std::size_t>(k + 1)] < static_cast<float>(q)) ++k;
    const int p = at[static_cast<std::size_t>(k)];
    out[static_cast<std::size_t>(q)] = static_cast<float>((q - p) * (q - p)) + value(p);
  }
  std::copy_n(out.begin(), line.size(), line.begin());
}

// Distance of each pixel's centre to the nearest centre on the other side; far away when there is none.
ImageF distance_to(const ImageU8& mask, bool inside) {
  ImageF d(mask.width, mask.height, 1);
  for (std::size_t i = 0; i < d.data.size(); ++i) d.data[i] = (mask.data[i] >= outline) == inside ? 0 : far_away;
  const auto longest = static_cast<std::size_t>(std::max(mask.width, mask.height));
  std::vector<int> at(longest);
  std::vector<float> from(longest), out(longest), column(static_cast<std::size_t>(mask.height));
  for (int y = 0; y < d.height; ++y) relax_line(d.row(y), at, from, out);
  for (int x = 0; x < d.width; ++x) {
    for (int y = 0; y < d.height; ++y) column[static_cast<std::size_t>(y)] = d.at(x, y);
    relax_line(column, at, from, out);
    for (int y = 0; y < d.height; ++y) d.at(x, y) = std::sqrt(column[static_cast<std::size_t>(y)]);
  }
  return d;
}

struct Silhouette {
  const PosedPhoto* photo = nullptr;
  ImageF distance;  // pixels

  // Signed distance of the point to the silhouette's cone, about metres; nothing outside of the picture.
  [[nodiscard]] std::optional<float> at(const Eigen::Vector3d& x_in_world) const {
    const Eigen::Vector3d x = photo->cam_from_world * x_in_world;
    if (!(x.z() > 0)) return std::nullopt;
    const Eigen::Vector2d pixel = photo->camera.project(x);
    if (!(pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() <= distance.width && pixel.y() <= distance.height))
      return std::nullopt;
    const double u = std::clamp(pixel.x() - 0.5, 0.0, distance.width - 1.0);
    const double v = std::clamp(pixel.y() - 0.5, 0.0, distance.height - 1.0);
    const int x0 = std::min(static_cast<int>(u), distance.width - 2);
    const int y0 = std::min(static_cast<int>(v), distance.height - 2);
    const auto a = static_cast<float>(u - x0);
    const auto b = static_cast<float>(v - y0);
    const float top = distance.at(x0, y0) * (1 - a) + distance.at(x0 + 1, y0) * a;
    const float bottom = distance.at(x0, y0 + 1) * (1 - a) + distance.at(x0 + 1, y0 + 1) * a;
    return (top * (1 - b) + bottom * b) * static_cast<float>(x.z() / photo->camera.fx());
  }
};

constexpr int least_photos = 2;  // one silhouette alone bounds nothing in depth

// The hull's field at a point; stops below `enough`: whoever asks knows then that the point is outside.
float field_at(const std::vector<Silhouette>& silhouettes, const Eigen::Vector3d& x, float enough) {
  float least = far_away;
  int seen = 0;
  for (const Silhouette& silhouette : silhouettes) {
    const auto distance = silhouette.at(x);
    if (!distance) continue;
    ++seen;
    least = std::min(least, *distance);
    if (least < enough) return least;
  }
  return seen >= least_photos ? least : -far_away;
}

struct Box {
  Eigen::Vector3d low;
  Eigen::Vector3d high;
};

ScalarGrid grid_over(const Box& box, int resolution) {
  ScalarGrid grid;
  const Eigen::Vector3d size = box.high - box.low;
  grid.spacing = size.maxCoeff() / resolution;
  // A border of two cells lies about the box: the field is negative there by decree, and the box's own faces stay
  // whole.
  grid.origin = box.low - 2 * Eigen::Vector3d::Constant(grid.spacing);
  for (Eigen::Index i = 0; i < 3; ++i)
    grid.corners[static_cast<std::size_t>(i)] = static_cast<int>(std::ceil(size[i] / grid.spacing - 1e-9)) + 5;
  grid.values.assign(grid.index(0, 0, grid.corners[2]), -static_cast<float>(grid.spacing));
  return grid;
}

// Blocks of cells whose middle lies far from the surface are decided at once: the field changes no faster than the
// place does, but for the perspective within the block.
void carve(const std::vector<Silhouette>& silhouettes, ScalarGrid& grid) {
  constexpr int block = 8;  // corners
  const auto blocks = [&](std::size_t axis) { return (grid.corners[axis] + block - 1) / block; };
  const int columns = blocks(0);
  const int rows = blocks(1);
  const auto reach = static_cast<float>(1.2 * std::sqrt(3.0) * grid.spacing * block / 2);  // 1.2: perspective
  const auto nothing = -2 * static_cast<float>(grid.spacing);
  tbb::parallel_for(0, columns * rows * blocks(2), [&](int i) {
    const std::array<int, 3> first{i % columns * block, i / columns % rows * block, i / (columns * rows) * block};
    const double half = 0.5 * (block - 1);
    const Eigen::Vector3d middle =
        grid.origin + grid.spacing * Eigen::Vector3d(first[0] + half, first[1] + half, first[2] + half);
    const float at_middle = field_at(silhouettes, middle, -reach);
    const bool outside = at_middle < -reach && at_middle > -far_away;  // of a silhouette, not merely unseen
    for (int z = first[2]; z < std::min(first[2] + block, grid.corners[2] - 1); ++z)
      for (int y = first[1]; y < std::min(first[1] + block, grid.corners[1] - 1); ++y)
        for (int x = first[0]; x < std::min(first[0] + block, grid.corners[0] - 1); ++x) {
          if (x == 0 || y == 0 || z == 0) continue;
          grid.values[grid.index(x, y, z)] =
              outside ? nothing : std::max(nothing, field_at(silhouettes, grid.position(x, y, z), nothing));
        }
  });
}

// Of the corners where the field is above `least`; nothing when there is none.
std::optional<Box> box_above(const ScalarGrid& grid, float least) {
  Box box{Eigen::Vector3d::Constant(far_away), Eigen::Vector3d::Constant(-far_away)};
  bool found = false;
  for (int z = 0; z < grid.corners[2]; ++z)
    for (int y = 0; y < grid.corners[1]; ++y)
      for (int x = 0; x < grid.corners[0]; ++x) {
        if (!(grid.values[grid.index(x, y, z)] > least)) continue;
        found = true;
        box.low = box.low.cwiseMin(grid.position(x, y, z));
        box.high = box.high.cwiseMax(grid.position(x, y, z));
      }
  return found ? std::optional(box) : std::nullopt;
}

// The point nearest to all lines of sight towards the silhouettes' middles.
Eigen::Vector3d common_point(const std::vector<Silhouette>& silhouettes, const std::string& source) {
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const Silhouette& silhouette : silhouettes) {
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
    double count = 0;
    for (int y = 0; y < silhouette.distance.height; ++y)
      for (int x = 0; x < silhouette.distance.width; ++x)
        if (silhouette.distance.at(x, y) > 0) {
          middle += Eigen::Vector2d(x + 0.5, y + 0.5);
          ++count;
        }
    if (count == 0) continue;
    const auto ray = silhouette.photo->camera.unproject(middle / count);
    if (!ray) continue;
    const Eigen::Vector3d d = (silhouette.photo->cam_from_world.rotation.conjugate() * *ray).normalized();
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - d * d.transpose();
    a += across;
    b += across * centre_of(*silhouette.photo);
  }
  const auto solution = solve_symmetric(a, b);
  if (!solution)
    throw InputError(source, "--proxy hull",
                     "has silhouettes seen from one direction only: give hull:N,x0,y0,z0,x1,y1,z1");
  return *solution;
}

// A box about the hull: the cube about the common point that reaches to the nearest photo, narrowed twice.
Box found_box(const std::vector<Silhouette>& silhouettes, const std::string& source) {
  constexpr int coarse = 48;
  const Eigen::Vector3d middle = common_point(silhouettes, source);
  double reach = std::numeric_limits<double>::infinity();
  for (const Silhouette& silhouette : silhouettes)
    reach = std::min(reach, (centre_of(*silhouette.photo) - middle).norm());
  Box box{middle.array() - reach, middle.array() + reach};
  for (int round = 0; round < 2; ++round) {
    ScalarGrid grid = grid_over(box, coarse);
    carve(silhouettes, grid);
    // Thin parts pass between the corners of a coarse grid: whatever comes within a cell counts.
    const auto narrowed = box_above(grid, -static_cast<float>(grid.spacing));
    if (!narrowed)
      throw InputError(source, "--proxy hull",
                       "has no point that lies in all silhouettes: are masks white on the shape, and the poses right?");
    if (round == 0 &&
        ((narrowed->low - box.low).minCoeff() < grid.spacing || (box.high - narrowed->high).minCoeff() < grid.spacing))
      throw InputError(
          source, "--proxy hull",
          "is not closed by its silhouettes: photograph the shape from more sides, or give hull:N,x0,y0,z0,x1,y1,z1");
    box = {narrowed->low.array() - grid.spacing, narrowed->high.array() + grid.spacing};
  }
  return box;
}

}  // namespace

std::optional<std::string> HullOptions::validate() const {
  if (resolution < 8 || resolution > 512) return "resolution: must be between 8 and 512 cells";
  if (box && !((*box)[1] - (*box)[0]).allFinite()) return "box: must be numbers";
  if (box && !(((*box)[1] - (*box)[0]).minCoeff() > 0)) return "box: must have its lower corner first";
  return std::nullopt;
}

ImageF signed_distance(const ImageU8& mask) {
  ImageF inside = distance_to(mask, false);
  const ImageF outside = distance_to(mask, true);
  // The outline runs half a pixel before the first centre on the other side.
  for (std::size_t i = 0; i < inside.data.size(); ++i)
    inside.data[i] = inside.data[i] > 0 ? inside.data[i] - 0.5F : 0.5F - outside.data[i];
  return inside;
}

void mask_dark_background(PhotoSet& set, float threshold) {
  for (PosedPhoto& photo : set.photos) {
    if (!photo.mask.empty()) continue;
    photo.mask = ImageU8(photo.camera.width, photo.camera.height, 1);
    std::visit(
        [&](const auto& image) {
          for (std::size_t i = 0; i < photo.mask.data.size(); ++i) {
            const auto* pixel = image.data.data() + 3 * i;
            photo.mask.data[i] = static_cast<float>(*std::max_element(pixel, pixel + 3)) > threshold ? 255 : 0;
          }
        },
        photo.picture);
  }
}

TriangleMesh visual_hull(const PhotoSet& set, const HullOptions& options) {
  check(!options.validate(), "the hull's options are valid");
  std::vector<Silhouette> silhouettes;
  for (const PosedPhoto& photo : set.photos)
    if (!photo.mask.empty()) silhouettes.push_back({&photo, {}});
  if (silhouettes.size() < static_cast<std::size_t>(least_photos))
    throw InputError(set.source, "--proxy hull",
                     "needs two photos with silhouettes at least: masks (COLMAP's masks/NAME.png, mask_path), pictures "
                     "with alpha, or --mask-below");
  tbb::parallel_for(std::size_t{0}, silhouettes.size(),
                    [&](std::size_t i) { silhouettes[i].distance = signed_distance(silhouettes[i].photo->mask); });
  const Box box = options.box ? Box{(*options.box)[0], (*options.box)[1]} : found_box(silhouettes, set.source);
  ScalarGrid grid = grid_over(box, options.resolution);
  carve(silhouettes, grid);
  TriangleMesh mesh = zero_surface(grid);
  if (mesh.triangles.empty())
    throw InputError(set.source, "--proxy hull",
                     "has no point in all silhouettes: give a finer resolution, hull:N, or mend the masks");
  return mesh;
}

}  // namespace mf
