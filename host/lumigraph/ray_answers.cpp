// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/ray_answers.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "host/blending/vectorized.h"
#include "host/blending/view_weights.h"
#include "host/lumigraph/vector_math.h"

// The loops over rays are written for the compiler's vectorizer: no branch but selections, no call. (This file is
// compiled with -fno-math-errno, -fno-trapping-math and -fno-thread-jumps, without which they stay scalar.)

namespace mf {

namespace {

constexpr float infinite = std::numeric_limits<float>::infinity();
constexpr float nearest = 1e-3F;  // of the depth in the new view: points nearer to a photo's camera plane are not in it

// Octaves by which a bilinear fetch blurs more than a pixel of its texels' size does. Such a pixel is a box, of
// variance 1/12; a texel is one too, and interpolation adds 1/6 on average: log₂ √3.
constexpr float fetch_octaves = 0.7925F;

// Everything but visibility; the penalties before they are divided by the weights.
template <bool distorts>
inline __attribute__((always_inline)) void project_all(const AnsweringView& v, const RayBundle& rays,
                                                       const PenaltyOptions& o, const RayAnswers& out,
                                                       float* inverse_depth, float* plain) {
  const std::size_t count = rays.dx.size();
  const AnsweringCamera c = v.camera;
  const auto [dx, dy, dz, depth, nx, ny, nz] = first_of(rays);
  float* out_x = out.x.data();
  float* out_y = out.y.data();
  float* out_lod = out.lod.data();
  float* weight = out.weight.data();
  const auto r = v.cam_from_world;
  const float focal2 = c.fx * c.fy;
  const float focal2_ratio = rays.focal2 / focal2;
  const auto eye = v.eye_in_cam;
  const auto from_centre = v.eye_from_centre;
  const float of_time = v.time_penalty;
  const float per_border_px = v.per_border_px;
  const float alpha = o.angle;
  const float beta = o.resolution;
  const float too_fine = rays.beyond + fetch_octaves;
#pragma GCC ivdep  // the spans don't overlap
  for (std::size_t i = 0; i < count; ++i) {
    const float px = depth[i] * dx[i];
    const float py = depth[i] * dy[i];
    const float pz = depth[i] * dz[i];
    const float xc = r[0] * px + r[1] * py + r[2] * pz + eye[0];
    const float yc = r[3] * px + r[4] * py + r[5] * pz + eye[1];
    const float zc = r[6] * px + r[7] * py + r[8] * pz + eye[2];
    const bool before = zc > nearest * depth[i];
    const float inverse = 1 / (before ? zc : 1.0F);
    float x = xc * inverse;
    float y = yc * inverse;
    const float r2 = x * x + y * y;
    if constexpr (distorts) {
      const Distorted bent = distorted(c, x, y);
      x = bent.x;
      y = bent.y;
    }
    const float u = c.fx * x + c.cx;
    const float w = c.fy * y + c.cy;

    const float wx = px + from_centre[0];
    const float wy = py + from_centre[1];
    const float wz = pz + from_centre[2];
    const float per_view = 1 / std::sqrt(wx * wx + wy * wy + wz * wz);
    const float per_ray = 1 / std::sqrt(dx[i] * dx[i] + dy[i] * dy[i] + dz[i] * dz[i]);
    const float ax = wx * per_view - dx[i] * per_ray;
    const float ay = wy * per_view - dy[i] * per_ray;
    const float az = wz * per_view - dz[i] * per_ray;
    const float chord = std::sqrt(ax * ax + ay * ay + az * az);

    const float cos_view = larger(std::abs(nx[i] * wx + ny[i] * wy + nz[i] * wz) * per_view, edge_on_cosine);
    const float cos_ray = larger(std::abs(nx[i] * dx[i] + ny[i] * dy[i] + nz[i] * dz[i]) * per_ray, edge_on_cosine);
    // Areas: f² cos |X−C| / z³, and for the new view with |X−E| = depth · |d|, z = depth.
    const float area_ratio =
        focal2_ratio * (cos_ray * per_view * zc * zc * zc) / (per_ray * cos_view * depth[i] * depth[i]);
    const float octaves = 0.5F * approximate_log2(before ? area_ratio : 1.0F);

    const float to_side = smaller(u, c.width - u) * per_border_px;
    const float to_top = smaller(w, c.height - w) * per_border_px;
    const bool inside = before & (r2 < c.largest_r2);
    // Squared: where a photo that outweighs the others leaves them, it leaves gently even under a root (γ = 0.5).
    const float border = smooth(to_side) * smooth(to_top);

    out_x[i] = u;
    out_y[i] = w;
    out_lod[i] = larger(-octaves - too_fine, 0.0F);
    plain[i] = alpha * chord + beta * larger(octaves, 0.0F) + of_time;
    inverse_depth[i] = inverse;
    weight[i] = inside ? border * border : 0.0F;
  }
}

inline bool any_below(const float* a, const float* b, std::size_t count) {
  int below = 0;
  for (std::size_t i = 0; i < count; ++i) below |= a[i] < b[i] ? 1 : 0;
  return below != 0;
}

// Multiplies the weights by what the photo sees of points at these inverse depths: between four texels. Where none of
// ray_lanes neighbours has a plain penalty below its `worst`, dividing by weights helps none: theirs become 0.
MF_VECTORIZED void look(const SourceSight& sight, const RayAnswers& answers, const float* inverse_depth,
                        float tolerance, const float* plain, const float* worst, std::size_t count) {
  const float* x = answers.x.data();
  const float* y = answers.y.data();
  float* weight = answers.weight.data();
  const float per_px = sight.texels_per_px;
  const auto last_x = static_cast<float>(sight.width - 1);
  const auto last_y = static_cast<float>(sight.height - 1);
  const int width = sight.width;
  alignas(64) std::array<float, largest_bundle> a;
  alignas(64) std::array<float, largest_bundle> b;
  alignas(64) std::array<std::int32_t, largest_bundle> at;
  for (std::size_t i = 0; i < count; ++i) {
    const float u = smaller(larger(x[i] * per_px - 0.5F, 0.0F), last_x);
    const float v = smaller(larger(y[i] * per_px - 0.5F, 0.0F), last_y);
    const int x0 = static_cast<int>(u);
    const int y0 = static_cast<int>(v);
    a[i] = u - static_cast<float>(x0);
    b[i] = v - static_cast<float>(y0);
    at[i] = y0 * width + x0;
  }
  // Loads are a loop of their own, without arithmetic, so that the others are vectorized.
  using Neighbours = std::array<SourceSight::Texel, 2>;
  alignas(64) std::array<Neighbours, largest_bundle> top{};
  alignas(64) std::array<Neighbours, largest_bundle> bottom{};
  for (std::size_t first = 0; first < count; first += ray_lanes) {
    if (!any_below(plain + first, worst + first, ray_lanes)) continue;
    for (std::size_t i = first; i < first + ray_lanes; ++i) {
      const SourceSight::Texel* texel = sight.texels.data() + at[i];
      std::memcpy(&top[i], texel, sizeof(Neighbours));
      std::memcpy(&bottom[i], texel + width, sizeof(Neighbours));
    }
  }
  const float scale = sight.scale / 65535;
  const float per_tolerance = 1 / tolerance;
#pragma GCC ivdep  // the spans don't overlap
  for (std::size_t i = 0; i < count; ++i) {
    const float surface_top = depth_code(top[i][0]) + a[i] * (depth_code(top[i][1]) - depth_code(top[i][0]));
    const float surface_bottom =
        depth_code(bottom[i][0]) + a[i] * (depth_code(bottom[i][1]) - depth_code(bottom[i][0]));
    const float trust_top = trust_code(top[i][0]) + a[i] * (trust_code(top[i][1]) - trust_code(top[i][0]));
    const float trust_bottom = trust_code(bottom[i][0]) + a[i] * (trust_code(bottom[i][1]) - trust_code(bottom[i][0]));
    const float surface = scale * (surface_top + b[i] * (surface_bottom - surface_top));
    const float trust = (trust_top + b[i] * (trust_bottom - trust_top)) / 65535;
    const float behind = surface / inverse_depth[i] - 1;  // of the point's depth: 0 on the surface
    const float sees = smooth(trust) * (1 - smooth(behind * per_tolerance - 1));
    weight[i] *= trust > 0 ? larger(least_sight, sees) : 0.0F;
  }
}

MF_VECTORIZED void project_plain(const AnsweringView& v, const RayBundle& rays, const PenaltyOptions& o,
                                 const RayAnswers& out, float* inverse_depth, float* plain) {
  project_all<false>(v, rays, o, out, inverse_depth, plain);
}

MF_VECTORIZED void project_distorted(const AnsweringView& v, const RayBundle& rays, const PenaltyOptions& o,
                                     const RayAnswers& out, float* inverse_depth, float* plain) {
  project_all<true>(v, rays, o, out, inverse_depth, plain);
}

// plain / weight^γ for γ = ½, whose root is a machine instruction, and for any other.
MF_VECTORIZED void divide_by_root(const float* plain, const float* weight, float* penalty, std::size_t count) {
#pragma GCC ivdep  // the spans don't overlap
  for (std::size_t i = 0; i < count; ++i)
    penalty[i] = weight[i] > 0 ? plain[i] / std::sqrt(larger(weight[i], 1e-20F)) : infinite;
}

void divide(std::span<const float> plain, std::span<const float> weight, float gamma, std::span<float> penalty) {
  if (gamma == 0.5F) {
    divide_by_root(plain.data(), weight.data(), penalty.data(), plain.size());
    return;
  }
  for (std::size_t i = 0; i < plain.size(); ++i)
    penalty[i] = weight[i] > 0 ? plain[i] / std::pow(weight[i], gamma) : infinite;
}

// Whether the candidate is among any ray's best. `offered`: its penalties.
MF_VECTORIZED bool insert(float* penalty, std::int32_t* candidate, std::size_t row_length, std::size_t rays, int rows,
                          std::int32_t id, const float* offered) {
  if (!any_below(offered, penalty + static_cast<std::size_t>(rows - 1) * row_length, rays)) return false;
  alignas(64) std::array<float, largest_bundle> moving_penalty;
  alignas(64) std::array<std::int32_t, largest_bundle> moving;
  for (std::size_t i = 0; i < rays; ++i) moving_penalty[i] = offered[i];
  for (std::size_t i = 0; i < rays; ++i) moving[i] = id;
  for (int row = 0; row < rows; ++row) {
    float* row_penalty = penalty + static_cast<std::size_t>(row) * row_length;
    std::int32_t* row_candidate = candidate + static_cast<std::size_t>(row) * row_length;
#pragma GCC ivdep  // rows don't overlap
    for (std::size_t i = 0; i < rays; ++i) {
      const float held = row_penalty[i];
      const float moved = moving_penalty[i];
      const std::int32_t held_id = row_candidate[i];
      const std::int32_t moved_id = moving[i];
      const bool better = moved < held;
      row_penalty[i] = better ? moved : held;
      row_candidate[i] = better ? moved_id : held_id;
      moving_penalty[i] = better ? held : moved;
      moving[i] = better ? held_id : moved_id;
    }
  }
  return true;
}

// The largest singular value of the distortion's Jacobian, over a grid of the disc where it holds.
float largest_stretch(const AnsweringCamera& camera) {
  constexpr int steps = 32;         // from the middle to the rim
  constexpr float between = 1.05F;  // for what lies between them: polynomials of degree 7 are smooth there
  const float step = std::sqrt(camera.largest_r2) / steps;
  float largest = 0;
  for (int j = -steps; j <= steps; ++j)
    for (int i = -steps; i <= steps; ++i) {
      const auto x = static_cast<float>(i) * step;
      const auto y = static_cast<float>(j) * step;
      if (x * x + y * y > camera.largest_r2) continue;
      const float h = step / 2;
      const Distorted left = distorted(camera, x - h, y);
      const Distorted right = distorted(camera, x + h, y);
      const Distorted above = distorted(camera, x, y - h);
      const Distorted below = distorted(camera, x, y + h);
      Eigen::Matrix2f jacobian;
      jacobian << right.x - left.x, below.x - above.x, right.y - left.y, below.y - above.y;
      largest = std::max(largest, (jacobian / step).operatorNorm());
    }
  return between * largest;
}

// Sums to 1 down the rows, or is 0 in all. Precondition: `sum` is 0.
MF_VECTORIZED void weigh(const float* penalty, std::size_t rays, int k, float floor, float* weight, float* sum) {
  const float* threshold = penalty + static_cast<std::size_t>(k) * rays;
  for (int row = 0; row < k; ++row) {
    const float* row_penalty = penalty + static_cast<std::size_t>(row) * rays;
    float* row_weight = weight + static_cast<std::size_t>(row) * rays;
#pragma GCC ivdep  // the rows don't overlap
    for (std::size_t i = 0; i < rays; ++i) {
      const float w = row_penalty[i] < infinite ? ray_weight(row_penalty[i], threshold[i], floor) : 0;
      row_weight[i] = w;
      sum[i] += w;
    }
  }
  for (int row = 0; row < k; ++row) {
    float* row_weight = weight + static_cast<std::size_t>(row) * rays;
    for (std::size_t i = 0; i < rays; ++i) row_weight[i] /= sum[i] > 0 ? sum[i] : 1;
  }
}

}  // namespace

AnsweringCamera answering_camera(const CameraModel& model) {
  AnsweringCamera camera;
  camera.fx = static_cast<float>(model.fx());
  camera.fy = static_cast<float>(model.fy());
  camera.cx = static_cast<float>(model.cx());
  camera.cy = static_cast<float>(model.cy());
  for (std::size_t i = 0; i < 5; ++i) camera.distortion[i] = static_cast<float>(model.parameters[4 + i]);
  camera.distorted = model.has_distortion();
  camera.width = static_cast<float>(model.width);
  camera.height = static_cast<float>(model.height);
  Eigen::Vector2d low = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector2d high = -low;
  double largest_r2 = 0;
  constexpr int steps = 16;  // on each side of the border, which is smooth
  for (int i = 0; i <= steps; ++i)
    for (const double side : {0.0, 1.0})
      for (const bool upright : {false, true}) {
        const double t = static_cast<double>(i) / steps;
        const auto ray = model.unproject({(upright ? side : t) * model.width, (upright ? t : side) * model.height});
        if (!ray) continue;
        low = low.cwiseMin(ray->head<2>());
        high = high.cwiseMax(ray->head<2>());
        largest_r2 = std::max(largest_r2, ray->head<2>().squaredNorm());
      }
  const Eigen::Vector2d spare = (camera.distorted ? 0.01 : 1e-5) * (high - low);  // between the steps; or rounding
  camera.left = static_cast<float>(low.x() - spare.x());
  camera.top = static_cast<float>(low.y() - spare.y());
  camera.right = static_cast<float>(high.x() + spare.x());
  camera.bottom = static_cast<float>(high.y() + spare.y());
  camera.largest_r2 = camera.distorted ? static_cast<float>(1.02 * largest_r2) : infinite;
  if (camera.distorted) camera.stretch = largest_stretch(camera);
  return camera;
}

AnsweringView answering_view(const AnsweringCamera& camera, const Rigid3& cam_from_world, const SourceSight& sight,
                             const Eigen::Vector3d& eye, float border) {
  AnsweringView view;
  view.camera = camera;
  const Eigen::Matrix3d rotation = cam_from_world.rotation.toRotationMatrix();
  const Eigen::Vector3d eye_in_cam = cam_from_world * eye;
  const Eigen::Vector3d eye_from_centre = rotation.transpose() * eye_in_cam;
  for (std::size_t i = 0; i < 9; ++i)
    view.cam_from_world[i] = static_cast<float>(rotation(static_cast<int>(i / 3), static_cast<int>(i % 3)));
  for (std::size_t i = 0; i < 3; ++i) {
    view.eye_in_cam[i] = static_cast<float>(eye_in_cam[static_cast<int>(i)]);
    view.eye_from_centre[i] = static_cast<float>(eye_from_centre[static_cast<int>(i)]);
  }
  view.per_border_px = 1 / std::max(1.0F, border * std::min(camera.width, camera.height));
  view.sight = sight.empty() ? nullptr : &sight;
  return view;
}

void answer(const AnsweringView& view, const RayBundle& rays, const PenaltyOptions& options, float depth_tolerance,
            std::span<const float> worst, const RayAnswers& out) {
  const std::size_t count = rays.dx.size();
  alignas(64) std::array<float, largest_bundle> inverse_depth;
  alignas(64) std::array<float, largest_bundle> plain;
  if (view.camera.distorted)
    project_distorted(view, rays, options, out, inverse_depth.data(), plain.data());
  else
    project_plain(view, rays, options, out, inverse_depth.data(), plain.data());
  const auto of_bundle = std::span<const float>(plain).first(count);
  if (view.sight != nullptr)
    look(*view.sight, out, inverse_depth.data(), depth_tolerance, plain.data(), worst.data(), count);
  divide(of_bundle, out.weight, options.border, out.penalty);
}

void clear(const LeastPenalties& least) {
  std::fill(least.penalty.begin(), least.penalty.end(), infinite);
  std::fill(least.candidate.begin(), least.candidate.end(), -1);
}

bool add_candidate(const LeastPenalties& least, std::int32_t candidate, std::size_t first,
                   std::span<const float> penalty) {
  return insert(least.penalty.data() + first, least.candidate.data() + first, least.rays, penalty.size(), least.k + 1,
                candidate, penalty.data());
}

MF_VECTORIZED PenaltyRange range_of(std::span<const float> penalty) {
  // A minimum in each lane: that of a whole loop would be taken one by one.
  alignas(64) std::array<float, ray_lanes> least;
  least.fill(infinite);
  PenaltyRange range;
  for (std::size_t first = 0; first < penalty.size(); first += ray_lanes) {
    const float* values = penalty.data() + first;
    for (std::size_t lane = 0; lane < ray_lanes; ++lane) least[lane] = smaller(least[lane], values[lane]);
    const float a = larger(larger(values[0], values[1]), larger(values[2], values[3]));
    const float b = larger(larger(values[4], values[5]), larger(values[6], values[7]));
    range.of_lanes[first / ray_lanes] = larger(a, b);
    range.largest = larger(range.largest, larger(a, b));
  }
  range.least = *std::min_element(least.begin(), least.end());
  return range;
}

void ray_weights(const LeastPenalties& least, float floor, std::span<float> weight) {
  alignas(64) std::array<float, largest_bundle> sum{};
  weigh(least.penalty.data(), least.rays, least.k, floor, weight.data(), sum.data());
}

}  // namespace mf
