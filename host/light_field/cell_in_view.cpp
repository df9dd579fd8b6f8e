// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/cell_in_view.h"

#include <cmath>
#include <cstdint>

#include "common/check.h"
#include "host/blending/vectorized.h"

namespace mf {

namespace {

constexpr std::size_t most = CellInView::most_parts;

// Loops with branches and roundings are beyond the compiler's own vectorizing: eight lanes, spelled out. Two
// neighbouring texels are eight, too.
constexpr std::size_t wide = 8;
using Floats8 = float __attribute__((vector_size(32)));
using Ints8 = std::int32_t __attribute__((vector_size(32)));
using Bits8 = std::uint32_t __attribute__((vector_size(32)));
using Halves8 = std::uint16_t __attribute__((vector_size(16)));

// Where the parts lie in a level: the first of four texels, and how the four share.
struct alignas(32) LookUps {
  std::array<float, most> right, above, below;  // the two rows' weights include the part's share
  std::array<std::int32_t, most> first;
};

struct Parts {
  const float *x, *y, *z, *share;
  std::size_t count;
};

[[gnu::always_inline]] inline void find_texels(const PremultipliedImage& image, float scale, const float* base,
                                               const Parts& parts, LookUps& out) {
  const float end_x = static_cast<float>(image.width() + 1), end_y = static_cast<float>(image.height() + 1);
  const std::int32_t stride = image.width() + 2;
  for (std::size_t i = 0; i < parts.count; i += wide) {
    Floats8 dx, dy, dz, share;
    __builtin_memcpy(&dx, parts.x + i, sizeof dx);
    __builtin_memcpy(&dy, parts.y + i, sizeof dy);
    __builtin_memcpy(&dz, parts.z + i, sizeof dz);
    __builtin_memcpy(&share, parts.share + i, sizeof share);
    const Floats8 z = base[2] + dz, inverse = scale / z;
    const Floats8 u = (base[0] + dx) * inverse + 0.5F, v = (base[1] + dy) * inverse + 0.5F;  // with rim
    const Ints8 shown = (z > 0) & (u >= 0) & (v >= 0) & (u < end_x) & (v < end_y);
    const Floats8 nothing{};
    const Floats8 x = shown ? u : nothing, y = shown ? v : nothing;
    const Ints8 x0 = __builtin_convertvector(x, Ints8), y0 = __builtin_convertvector(y, Ints8);
    const Floats8 right = x - __builtin_convertvector(x0, Floats8), down = y - __builtin_convertvector(y0, Floats8);
    const Floats8 weight = shown ? share * half_unshift : nothing, below = weight * down, above = weight - below;
    const Ints8 first = y0 * stride + x0;
    __builtin_memcpy(&out.right[i], &right, sizeof right);
    __builtin_memcpy(&out.above[i], &above, sizeof above);
    __builtin_memcpy(&out.below[i], &below, sizeof below);
    __builtin_memcpy(&out.first[i], &first, sizeof first);
  }
}

[[gnu::always_inline]] inline void load_pair(const PremultipliedImage::Texel* texels, Floats8& out) {
  Halves8 halves;
  __builtin_memcpy(&halves, texels, sizeof halves);
  const Bits8 bits = __builtin_convertvector(halves, Bits8) << 13U;
  __builtin_memcpy(&out, &bits, sizeof out);
}

[[gnu::always_inline]] inline void add_up(const PremultipliedImage& image, const LookUps& at, std::size_t count,
                                          float* out) {
  const Floats8 left{1, 1, 1, 1, 0, 0, 0, 0}, to_right{-1, -1, -1, -1, 1, 1, 1, 1};
  const PremultipliedImage::Texel* texels = image.texels().data();
  const std::ptrdiff_t stride = image.width() + 2;
  Floats8 sum{};
  for (std::size_t i = 0; i < count; ++i) {
    Floats8 top, bottom;
    load_pair(texels + at.first[i], top);
    load_pair(texels + at.first[i] + stride, bottom);
    sum += (left + to_right * at.right[i]) * (top * at.above[i] + bottom * at.below[i]);
  }
  const float unit = image.unit();
  for (int c = 0; c < 3; ++c) out[c] = (sum[c] + sum[c + 4]) * unit;
  out[3] = sum[3] + sum[7];
}

[[gnu::always_inline]] inline void see(const FieldView& view, const Parts& parts, float part_angle_rad, const float* x,
                                       float* out) {
  const float* m = view.pixel_from_world.data();  // by columns
  float base[3], squared_ray = 0;
  for (int i = 0; i < 3; ++i) {
    base[i] = m[i] * x[0] + m[3 + i] * x[1] + m[6 + i] * x[2] + m[9 + i] * x[3];
    const float ray = x[i] - x[3] * view.centre_in_world[i];
    squared_ray += ray * ray;
  }
  const int level = level_of_pixels(view, part_angle_rad / std::sqrt(squared_ray) * view.focal_px);
  const PremultipliedImage& image = view.levels[static_cast<std::size_t>(level)];
  LookUps at;
  find_texels(image, 1.0F / static_cast<float>(1 << level), base, parts, at);
  add_up(image, at, parts.count, out);
}

MF_VECTORIZED void see_one(const FieldView& view, const Parts& parts, float part_angle_rad, const float* x,
                           float* out) {
  see(view, parts, part_angle_rad, x, out);
}

MF_VECTORIZED void see_block(const FieldView& view, const Parts& parts, float part_angle_rad, const Lanes4& points,
                             const Lanes& needed, Lanes3& colour, Lanes& weight) {
  for (std::size_t i = 0; i < block_lanes; ++i) {
    if (needed.v[i] == 0) continue;
    float out[4];
    const float x[4] = {points.x.v[i], points.y.v[i], points.z.v[i], points.w.v[i]};
    see(view, parts, part_angle_rad, x, out);
    colour.x.v[i] = out[0];
    colour.y.v[i] = out[1];
    colour.z.v[i] = out[2];
    weight.v[i] = out[3];
  }
}

}  // namespace

CellInView::CellInView(const FieldView& view, const Eigen::Vector3f& direction, std::span<const CellSample> parts)
    : parts_(parts.size()) {
  check(parts.size() <= most_parts, "a cell is seen in at most 16 parts");
  const Eigen::Matrix3f turn = view.pixel_from_world.leftCols<3>();
  float solid_angle = 0;
  for (const CellSample& part : parts) solid_angle += part.solid_angle_sr;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const Eigen::Vector3f offset = turn * (parts[i].direction - direction);
    x_.v[i] = offset.x();
    y_.v[i] = offset.y();
    z_.v[i] = offset.z();
    share_.v[i] = parts[i].solid_angle_sr / solid_angle;
  }
  part_angle_rad_ = std::sqrt(solid_angle / static_cast<float>(parts.size()));
}

Eigen::Vector4f CellInView::seen(const FieldView& view, const ProxyPoint& x) const {
  Eigen::Vector4f out;
  see_one(view, {x_.v.data(), y_.v.data(), z_.v.data(), share_.v.data(), parts_}, part_angle_rad_, x.data(),
          out.data());
  return out;
}

void CellInView::seen(const FieldView& view, const Lanes4& proxy_point, const Lanes& needed, Lanes3& colour,
                      Lanes& weight) const {
  see_block(view, {x_.v.data(), y_.v.data(), z_.v.data(), share_.v.data(), parts_}, part_angle_rad_, proxy_point,
            needed, colour, weight);
}

}  // namespace mf
