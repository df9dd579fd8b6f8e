// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/view_bounds.h"

#include <algorithm>
#include <cmath>

#include "common/check.h"
#include "host/blending/vectorized.h"
#include "host/lumigraph/vector_math.h"

// Loops are written for the vectorizer, see ray_answers.cpp.

namespace mf {

namespace {

constexpr float infinite = std::numeric_limits<float>::infinity();
constexpr float log_slip = 1e-4F;  // octaves: above the approximation of the logarithm

// A minimum in each lane: minima of a whole loop would be taken one by one.
struct LaneBox {
  alignas(64) std::array<float, ray_lanes> low_x, low_y, low_z, high_x, high_y, high_z;
  alignas(64) std::array<float, ray_lanes> low_nx, low_ny, low_nz, high_nx, high_ny, high_nz;
  alignas(64) std::array<float, ray_lanes> least_x, least_y, least_depth, largest_x, largest_y, largest_depth;
  alignas(64) std::array<float, ray_lanes> cosine, area, area_of_proxy;
};

MF_VECTORIZED void add_rays(const RayBundle& rays, const Eigen::Matrix3f& world_from_cam, LaneBox& box) {
  const auto [dx, dy, dz, depth, nx, ny, nz] = first_of(rays);
  const float focal2 = rays.focal2;
  const float* axis_x = world_from_cam.data();
  const float* axis_y = world_from_cam.data() + 3;
  for (std::size_t first = 0; first < rays.dx.size(); first += ray_lanes)
    for (std::size_t lane = 0; lane < ray_lanes; ++lane) {
      const std::size_t i = first + lane;
      const float x = depth[i] * dx[i];
      const float y = depth[i] * dy[i];
      const float z = depth[i] * dz[i];
      const float length = std::sqrt(dx[i] * dx[i] + dy[i] * dy[i] + dz[i] * dz[i]);
      const float along = dx[i] * nx[i] + dy[i] * ny[i] + dz[i] * nz[i];
      const float side = along > 0 ? -1.0F : 1.0F;  // the eye's
      const float cosine = larger(std::abs(along) / length, edge_on_cosine);
      const float area = focal2 * length / (depth[i] * depth[i]);
      box.low_x[lane] = smaller(box.low_x[lane], x);
      box.low_y[lane] = smaller(box.low_y[lane], y);
      box.low_z[lane] = smaller(box.low_z[lane], z);
      box.high_x[lane] = larger(box.high_x[lane], x);
      box.high_y[lane] = larger(box.high_y[lane], y);
      box.high_z[lane] = larger(box.high_z[lane], z);
      box.low_nx[lane] = smaller(box.low_nx[lane], side * nx[i]);
      box.low_ny[lane] = smaller(box.low_ny[lane], side * ny[i]);
      box.low_nz[lane] = smaller(box.low_nz[lane], side * nz[i]);
      box.high_nx[lane] = larger(box.high_nx[lane], side * nx[i]);
      box.high_ny[lane] = larger(box.high_ny[lane], side * ny[i]);
      box.high_nz[lane] = larger(box.high_nz[lane], side * nz[i]);
      const float in_cam_x = dx[i] * axis_x[0] + dy[i] * axis_x[1] + dz[i] * axis_x[2];
      const float in_cam_y = dx[i] * axis_y[0] + dy[i] * axis_y[1] + dz[i] * axis_y[2];
      box.least_x[lane] = smaller(box.least_x[lane], in_cam_x);
      box.least_y[lane] = smaller(box.least_y[lane], in_cam_y);
      box.least_depth[lane] = smaller(box.least_depth[lane], depth[i]);
      box.largest_x[lane] = larger(box.largest_x[lane], in_cam_x);
      box.largest_y[lane] = larger(box.largest_y[lane], in_cam_y);
      box.largest_depth[lane] = larger(box.largest_depth[lane], depth[i]);
      box.cosine[lane] = smaller(box.cosine[lane], cosine);
      box.area[lane] = smaller(box.area[lane], area);
      box.area_of_proxy[lane] = smaller(box.area_of_proxy[lane], cosine * area);
    }
}

// What of a box is the same for all photos.
struct Ball {
  float x, y, z, radius;
  float to_eye, nearest_eye;
  float ux, uy, uz;          // from E to the centre, unit length
  float nx, ny, nz, spread;  // of the normals
  float per_cosine, area, area_of_proxy;
};

Ball ball_of(const RaysBox& box) {
  const Eigen::Vector3f centre = box.centre();
  const float to_eye = centre.norm();
  const Eigen::Vector3f u = to_eye > 0 ? Eigen::Vector3f(centre / to_eye) : Eigen::Vector3f::Zero();
  const Eigen::Vector3f normal = (box.low_normal + box.high_normal) / 2;
  const float spread = (box.high_normal - box.low_normal).matrix().norm() / 2;
  return {centre.x(),     centre.y(),
          centre.z(),     box.radius(),
          to_eye,         to_eye - box.radius(),
          u.x(),          u.y(),
          u.z(),          normal.x(),
          normal.y(),     normal.z(),
          spread,         1 / box.least_cosine,
          box.least_area, box.least_area_of_proxy};
}

MF_VECTORIZED void bound_all(const ViewTable& views, const Ball& ball, const PenaltyOptions& o, float* least) {
  const auto plane = [&](ViewTable::Plane p) {
    return std::array{views.plane(p, 0), views.plane(p, 1), views.plane(p, 2), views.plane(p, 3)};
  };
  const auto right = plane(ViewTable::right);
  const auto left = plane(ViewTable::left);
  const auto bottom = plane(ViewTable::bottom);
  const auto top = plane(ViewTable::top);
  const auto depth = plane(ViewTable::depth);
  const float* eye_x = views.eye_from_centre(0);
  const float* eye_y = views.eye_from_centre(1);
  const float* eye_z = views.eye_from_centre(2);
  const float* focal2 = views.focal2();
  const float* time_penalty = views.time_penalty();
  const Ball b = ball;
  const float r = b.radius;
  const float alpha = o.angle;
  const float beta = o.resolution;
  const std::size_t count = views.size();
#pragma GCC ivdep  // the columns don't overlap
  for (std::size_t i = 0; i < count; ++i) {
    const float beyond_right = right[0][i] * b.x + right[1][i] * b.y + right[2][i] * b.z + right[3][i];
    const float beyond_left = left[0][i] * b.x + left[1][i] * b.y + left[2][i] * b.z + left[3][i];
    const float beyond_bottom = bottom[0][i] * b.x + bottom[1][i] * b.y + bottom[2][i] * b.z + bottom[3][i];
    const float beyond_top = top[0][i] * b.x + top[1][i] * b.y + top[2][i] * b.z + top[3][i];
    const float z = depth[0][i] * b.x + depth[1][i] * b.y + depth[2][i] * b.z + depth[3][i];
    const float beyond = larger(larger(beyond_right, beyond_left), larger(beyond_bottom, beyond_top));

    const float wx = b.x + eye_x[i];
    const float wy = b.y + eye_y[i];
    const float wz = b.z + eye_z[i];
    const float to_view = std::sqrt(wx * wx + wy * wy + wz * wz);
    const float nearest_view = to_view - r;
    const bool far = (nearest_view > 0) & (b.nearest_eye > 0);
    const float per_view = 1 / (far ? to_view : 1.0F);
    const float ax = wx * per_view - b.ux;
    const float ay = wy * per_view - b.uy;
    const float az = wz * per_view - b.uz;
    const float chord = std::sqrt(ax * ax + ay * ay + az * az);
    const float nearer = far ? smaller(nearest_view, b.nearest_eye) : 1.0F;
    const float farther = far ? larger(nearest_view, b.nearest_eye) : 1.0F;
    const float largest_chord = smaller(2.0F, chord + 2 * r / nearer);
    const float rate =
        (std::abs(to_view - b.to_eye) + r * largest_chord) / (nearer * farther) + largest_chord / farther;
    const float least_chord = far ? larger(0.0F, chord - r * rate) : 0.0F;

    const float nearest_z = z - r;
    const bool before = far & (nearest_z > 0);
    const float cosines = 1 + (chord + r * rate) * b.per_cosine;
    const float at_centre = std::abs(wx * b.nx + wy * b.ny + wz * b.nz) * per_view;
    const float cosine = larger(at_centre + b.spread + r / (far ? nearest_view : 1.0F), edge_on_cosine);
    const float area = larger(b.area / cosines, b.area_of_proxy / cosine);
    const float area_ratio = area * nearest_z * nearest_z * nearest_z / (focal2[i] * (to_view + r));
    const float octaves = 0.5F * approximate_log2(before ? larger(area_ratio, 1e-30F) : 1.0F) - log_slip;

    const float bound = alpha * least_chord + beta * larger(octaves, 0.0F) + time_penalty[i];
    least[i] = ((beyond > r) | (z < -r)) ? infinite : bound;
  }
}

// A rectangle of normalized coordinates or pixels of a photo, and the least depth in it.
struct Rectangle {
  float left, top, right, bottom;
  float nearest_z;
};

MF_VECTORIZED Rectangle project(const AnsweringView& view, const RaysCorners& corners) {
  const auto r = view.cam_from_world;
  const auto eye = view.eye_in_cam;
  alignas(32) std::array<float, 8> x;
  alignas(32) std::array<float, 8> y;
  alignas(32) std::array<float, 8> z;
  for (std::size_t i = 0; i < 8; ++i) {
    z[i] = r[6] * corners.x[i] + r[7] * corners.y[i] + r[8] * corners.z[i] + eye[2];
    const float inverse = 1 / (z[i] > 0 ? z[i] : 1.0F);
    x[i] = inverse * (r[0] * corners.x[i] + r[1] * corners.y[i] + r[2] * corners.z[i] + eye[0]);
    y[i] = inverse * (r[3] * corners.x[i] + r[4] * corners.y[i] + r[5] * corners.z[i] + eye[1]);
  }
  Rectangle all{x[0], y[0], x[0], y[0], z[0]};
  for (std::size_t i = 1; i < 8; ++i) {
    all.left = smaller(all.left, x[i]);
    all.right = larger(all.right, x[i]);
    all.top = smaller(all.top, y[i]);
    all.bottom = larger(all.bottom, y[i]);
    all.nearest_z = smaller(all.nearest_z, z[i]);
  }
  return all;
}

// From normalized coordinates to pixels. A distorted picture of the rectangle lies as far from that of its middle as
// its corners do at most, times what distortion stretches.
Rectangle in_pixels(const AnsweringCamera& c, Rectangle r) {
  if (c.distorted) {
    const Distorted middle = distorted(c, (r.left + r.right) / 2, (r.top + r.bottom) / 2);
    const float half = c.stretch * std::hypot(r.right - r.left, r.bottom - r.top) / 2;
    r = {middle.x - half, middle.y - half, middle.x + half, middle.y + half, r.nearest_z};
  }
  constexpr float rounding = 0.01F;  // of single precision in pictures of thousands of pixels, several times
  return {c.fx * r.left + c.cx - rounding, c.fy * r.top + c.cy - rounding, c.fx * r.right + c.cx + rounding,
          c.fy * r.bottom + c.cy + rounding, r.nearest_z};
}

float sight_at_most(const SourceSight& sight, const Rectangle& px, float tolerance) {
  const auto texel = [&](float at, int texels) {
    return smaller(larger(at * sight.texels_per_px - 0.5F, 0.0F), static_cast<float>(texels - 1));
  };
  const SourceSight::Bounds bounds = sight.bounds(texel(px.left, sight.width), texel(px.top, sight.height),
                                                  texel(px.right, sight.width), texel(px.bottom, sight.height));
  if (!(bounds.largest_trust > 0)) return 0;
  const float behind = bounds.least_inverse_depth * px.nearest_z - 1;
  return larger(least_sight, smooth(bounds.largest_trust) * (1 - smooth(behind / tolerance - 1)));
}

}  // namespace

void RaysBox::extend(const RaysBox& other) {
  low = low.min(other.low);
  high = high.max(other.high);
  low_normal = low_normal.min(other.low_normal);
  high_normal = high_normal.max(other.high_normal);
  least_cosine = std::min(least_cosine, other.least_cosine);
  least_area = std::min(least_area, other.least_area);
  least_area_of_proxy = std::min(least_area_of_proxy, other.least_area_of_proxy);
  least_in_cam = least_in_cam.min(other.least_in_cam);
  largest_in_cam = largest_in_cam.max(other.largest_in_cam);
}

RaysBox box_of(const RayBundle& rays, const Eigen::Matrix3f& world_from_cam) {
  check(rays.dx.size() % ray_lanes == 0, "rays fill their lanes");
  LaneBox lanes;
  for (auto* low : {&lanes.low_x, &lanes.low_y, &lanes.low_z, &lanes.low_nx, &lanes.low_ny, &lanes.low_nz,
                    &lanes.least_x, &lanes.least_y, &lanes.least_depth, &lanes.area, &lanes.area_of_proxy})
    low->fill(infinite);
  for (auto* high : {&lanes.high_x, &lanes.high_y, &lanes.high_z, &lanes.high_nx, &lanes.high_ny, &lanes.high_nz,
                     &lanes.largest_x, &lanes.largest_y, &lanes.largest_depth})
    high->fill(-infinite);
  lanes.cosine.fill(1);
  add_rays(rays, world_from_cam, lanes);
  const auto least = [](const auto& lane) { return *std::min_element(lane.begin(), lane.end()); };
  const auto most = [](const auto& lane) { return *std::max_element(lane.begin(), lane.end()); };
  return {{least(lanes.low_x), least(lanes.low_y), least(lanes.low_z)},
          {most(lanes.high_x), most(lanes.high_y), most(lanes.high_z)},
          {least(lanes.low_nx), least(lanes.low_ny), least(lanes.low_nz)},
          {most(lanes.high_nx), most(lanes.high_ny), most(lanes.high_nz)},
          least(lanes.cosine),
          least(lanes.area),
          least(lanes.area_of_proxy),
          {least(lanes.least_x), least(lanes.least_y), least(lanes.least_depth)},
          {most(lanes.largest_x), most(lanes.largest_y), most(lanes.largest_depth)}};
}

void ViewTable::clear() {
  number_.clear();
  for (auto& column : column_) column.clear();
}

void ViewTable::add(std::uint32_t number, const AnsweringView& view) {
  using RowMajor = Eigen::Matrix<float, 3, 3, Eigen::RowMajor>;
  const Eigen::Map<const RowMajor> cam_from_world(view.cam_from_world.data());
  const Eigen::Map<const Eigen::Vector3f> eye(view.eye_in_cam.data());
  const AnsweringCamera& c = view.camera;
  const std::array<Eigen::Vector3f, planes> normals_in_cam{
      Eigen::Vector3f(1, 0, -c.right).normalized(), Eigen::Vector3f(-1, 0, c.left).normalized(),
      Eigen::Vector3f(0, 1, -c.bottom).normalized(), Eigen::Vector3f(0, -1, c.top).normalized(),
      Eigen::Vector3f::UnitZ()};
  std::size_t column = 0;
  const auto append = [&](float value) { column_[column++].push_back(value); };
  for (const Eigen::Vector3f& n : normals_in_cam) {
    const Eigen::Vector3f in_world = cam_from_world.transpose() * n;
    for (int i = 0; i < 3; ++i) append(in_world[i]);
    append(n.dot(eye));
  }
  for (const float value : view.eye_from_centre) append(value);
  append(c.fx * c.fy);
  append(view.time_penalty);
  number_.push_back(number);
}

void ViewTable::add(const ViewTable& from, std::size_t row) {
  for (std::size_t c = 0; c < column_.size(); ++c) column_[c].push_back(from.column_[c][row]);
  number_.push_back(from.number_[row]);
}

void least_penalties(const ViewTable& views, const RaysBox& box, const PenaltyOptions& options,
                     std::span<float> least) {
  check(least.size() == views.size(), "a bound for each photo");
  bound_all(views, ball_of(box), options, least.data());
}

RaysCorners corners_of(const RaysBox& box, const Eigen::Matrix3f& world_from_cam) {
  RaysCorners corners;
  for (std::size_t i = 0; i < 8; ++i) {
    const auto side = [&](int axis) {
      return ((i >> axis) & 1U) != 0 ? box.largest_in_cam[axis] : box.least_in_cam[axis];
    };
    const Eigen::Vector3f x = side(2) * (world_from_cam * Eigen::Vector3f(side(0), side(1), 1));
    corners.x[i] = x.x();
    corners.y[i] = x.y();
    corners.z[i] = x.z();
  }
  return corners;
}

float largest_weight(const AnsweringView& view, const RaysCorners& corners, float depth_tolerance) {
  const AnsweringCamera& c = view.camera;
  const Rectangle normalized = project(view, corners);
  if (!(normalized.nearest_z > 0)) return 1;
  // Where the middle lies beyond what the distortion's model holds for, nothing is said.
  const float x = (normalized.left + normalized.right) / 2;
  const float y = (normalized.top + normalized.bottom) / 2;
  if (!(x * x + y * y < c.largest_r2)) return 1;
  const Rectangle px = in_pixels(c, normalized);
  const float to_side = smaller(smaller(px.right, c.width - px.left), c.width / 2);
  const float to_top = smaller(smaller(px.bottom, c.height - px.top), c.height / 2);
  const float border = smooth(to_side * view.per_border_px) * smooth(to_top * view.per_border_px);
  if (view.sight == nullptr || !(border > 0)) return border * border;
  return border * border * sight_at_most(*view.sight, px, depth_tolerance);
}

}  // namespace mf
