// SPDX-License-Identifier: Apache-2.0
#include "device/coverage.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "common/error.h"

namespace mf {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double degree = std::numbers::pi / 180;

const CoverageOptions& require_valid_coverage(const CoverageOptions& options) {
  if (const std::optional<std::string> problem = options.validate()) throw InputError("coverage", "", *problem);
  return options;
}

}  // namespace

LightPlane plane_between(const WorldTarget& world) {
  Vector2d low = Vector2d::Constant(1e9), high = Vector2d::Constant(-1e9), sum = Vector2d::Zero();
  double half_tag = 0;
  for (const WorldTag& tag : world.tags) {
    low = low.cwiseMin(tag.centre_in_world.head<2>());
    high = high.cwiseMax(tag.centre_in_world.head<2>());
    sum += tag.centre_in_world.head<2>();
    half_tag = std::max(half_tag, 0.5 * tag.size_m);
  }
  const Vector2d size = high - low - Vector2d::Constant(2 * half_tag);
  constexpr double least_m = 0.1;
  if (world.tags.empty()) return {};
  if (!(size.minCoeff() >= least_m)) return {sum / static_cast<double>(world.tags.size())};
  return {0.5 * (low + high), size};
}

std::optional<std::string> CoverageOptions::validate() const {
  if (!(plane.size_m.minCoeff() > 0)) return "plane.size_m must be two positive lengths";
  if (cells < 1 || cells > 16) return "cells must be 1 to 16";
  if (!(patch_deg >= 2 && patch_deg <= 30)) return "patch_deg must lie from 2 to 30";
  if (!(reach > 0)) return "reach must be positive";
  if (!(bright > 1)) return "bright must be above 1";
  if (!(done_at > 0 && done_at <= 1)) return "done_at must lie above 0, up to 1";
  if (!(least_step_m >= 0)) return "least_step_m must not be negative";
  return std::nullopt;
}

Coverage::Coverage(const CoverageOptions& options, const MirrorReach& reach)
    : options_(require_valid_coverage(options)), reach_(reach), grid_(options.patch_deg * degree), radiance_(grid_) {
  const auto cells = static_cast<std::size_t>(cell_count());
  const auto pairs = static_cast<std::size_t>(grid_.directions()) * cells;
  seen_.resize(pairs);
  stamp_.resize(pairs);
  places_.resize(pairs);
  weight_.resize(pairs);
  covered_ij_.resize(pairs);
  own_.resize(pairs);
  wide_.resize(pairs);
  widest_.resize(static_cast<std::size_t>(grid_.directions()));
  for (int a = 0; a < cell_count(); ++a)
    for (int b = 0; b < cell_count(); ++b) apart_m_.push_back((cell_in_plane(a) - cell_in_plane(b)).norm());
  for (int a = 0; a < cell_count(); ++a) {
    std::vector<int> order(cells);
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(),
                     [&](int b, int c) { return apart_m_[pair_of(a, b)] < apart_m_[pair_of(a, c)]; });
    neighbours_.push_back(std::move(order));
  }
  const Vector3d right = reach_.picture_right();
  for (int patch = 0; patch < grid_.patches(); ++patch)
    for (int cell = 0; cell < cell_count(); ++cell)
      reachable_.push_back(reach_.showing(cell_centre(cell), grid_.patch_centre(patch), right).has_value());
  wanted_.resize(reachable_.size());
}

Vector3d Coverage::cell_in_plane(int cell) const {
  const Vector2d at(cell % options_.cells + 0.5, cell / options_.cells + 0.5);
  const Vector2d p = (at / options_.cells - Vector2d::Constant(0.5)).cwiseProduct(options_.plane.size_m);
  return {p.x(), p.y(), 0};
}

Vector3d Coverage::cell_centre(int cell) const {
  const Vector2d& centre = options_.plane.centre_in_world;
  return cell_in_plane(cell) + Vector3d(centre.x(), centre.y(), 0);
}

void Coverage::cast(const Rigid3& world_from_mirror, int columns, int rows) {
  rays_.clear();
  const Vector3d centre = virtual_centre(reach_.camera_in_world(), world_from_mirror);
  const Eigen::Matrix3d rotation = world_from_mirror.rotation.toRotationMatrix();
  const Vector3d plane_centre(options_.plane.centre_in_world.x(), options_.plane.centre_in_world.y(), 0);
  const Vector2d cell_m = options_.plane.size_m / options_.cells;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      constexpr double inside = 0.96;  // of the opening: a pose that is a little off must not take the frame for light
      const Vector2d in_opening = inside * Vector2d((c + 0.5) / columns - 0.5, (r + 0.5) / rows - 0.5);
      const Vector2d m = in_opening.cwiseProduct(reach_.opening_m());
      RaySeen ray;
      ray.on_rim = r == 0 || c == 0 || r == rows - 1 || c == columns - 1;
      ray.on_mirror = world_from_mirror.translation + rotation.leftCols<2>() * m;
      ray.unit = (ray.on_mirror - centre).normalized();
      constexpr double horizon = 0.02;  // flatter rays cross the plane nowhere near
      if (!(ray.unit.z() > horizon)) continue;
      ray.on_plane = centre - centre.z() / ray.unit.z() * ray.unit - plane_centre;
      ray.direction = grid_.find(ray.unit);
      const Vector2d at = (ray.on_plane.head<2>() + 0.5 * options_.plane.size_m).cwiseQuotient(cell_m);
      if (at.minCoeff() >= 0 && at.maxCoeff() < options_.cells)
        ray.cell = static_cast<int>(at.y()) * options_.cells + static_cast<int>(at.x());
      rays_.push_back(ray);
    }
}

void Coverage::add(const Rigid3& cam_from_mirror, const ImageF& luminance, int reduction) {
  const Rigid3 world_from_mirror = reach_.cam_from_world().inverse() * cam_from_mirror;
  const Vector3d centre = virtual_centre(reach_.camera_in_world(), world_from_mirror);
  if (last_centre_ && (centre - *last_centre_).norm() < options_.least_step_m) return;
  last_centre_ = centre;
  ++views_;
  ++now_;
  stale_ = true;
  cast(world_from_mirror, 20, 15);
  for (const RaySeen& ray : rays_) {
    const Vector3d in_cam = reach_.cam_from_world() * ray.on_mirror;
    if (!(in_cam.z() > 0)) continue;
    const Vector2d pixel = reach_.camera().project(in_cam) / reduction;
    if (!(pixel.minCoeff() >= 0) || pixel.x() >= luminance.width || pixel.y() >= luminance.height) continue;
    const float value = luminance.at(static_cast<int>(pixel.x()), static_cast<int>(pixel.y()));
    if (!ray.on_rim) radiance_.add(ray.on_plane, ray.unit, std::max(0.0, static_cast<double>(value)));
    if (ray.cell < 0) continue;
    const std::size_t pair = pair_of(ray.direction, ray.cell);
    if (stamp_[pair] == now_) continue;
    stamp_[pair] = now_;
    if (seen_[pair] < UINT16_MAX) ++seen_[pair];
  }
}

void Coverage::find_places() {
  if (places_radius_m_ == radiance_.radius_m()) return;
  places_radius_m_ = radiance_.radius_m();
  for (int d = 0; d < grid_.directions(); ++d)
    for (int cell = 0; cell < cell_count(); ++cell)
      places_[pair_of(d, cell)] = radiance_.place(cell_in_plane(cell), grid_.centre(d));
}

void Coverage::evaluate() {
  if (!stale_) return;
  stale_ = false;
  radiance_.settle();
  find_places();
  double light = 0, solid_angle = 0;
  for (int d = 0; d < grid_.directions(); ++d)
    for (int cell = 0; cell < cell_count(); ++cell) {
      const std::size_t pair = pair_of(d, cell);
      weight_[pair] = 0;
      if (!reachable(grid_.patch_of(d), cell)) continue;
      const double omega = grid_.projected_solid_angle(d);
      weight_[pair] = static_cast<float>(radiance_.radiance(places_[pair]) * omega);
      light += static_cast<double>(weight_[pair]);
      solid_angle += omega;
    }
  covered_ = 0;
  std::fill(own_.begin(), own_.end(), 0.F);
  std::fill(wide_.begin(), wide_.end(), 0.F);
  std::fill(wanted_.begin(), wanted_.end(), 0.F);
  if (!(light > 0)) return patches_.clear();
  for (int d = 0; d < grid_.directions(); ++d) evaluate_direction(d, light / solid_angle, light);
  report_patches(light);
  constexpr double until_not_done = 0.02;
  done_ = covered_ >= options_.done_at - (done_ ? until_not_done : 0);
}

void Coverage::evaluate_direction(int d, double mean_radiance, double light) {
  const double reach_m = options_.reach * options_.plane.size_m.minCoeff();
  const double whole_plane_m = options_.plane.size_m.norm();
  const double omega = grid_.projected_solid_angle(d);
  const int cells = cell_count();
  const auto row = seen_.begin() + static_cast<std::ptrdiff_t>(pair_of(d, 0));
  const int views_anywhere = std::accumulate(row, row + cells, 0);
  float mended_anywhere = 0;
  for (int cell = 0; cell < cells; ++cell) {
    const std::size_t pair = pair_of(d, cell);
    covered_ij_[pair] = 0;
    if (!(weight_[pair] > 0)) continue;
    const double relative = static_cast<double>(weight_[pair]) / omega / mean_radiance;
    const double near_m = reach_m / relative;
    const int needed = relative >= options_.bright ? 2 : 1;
    const bool anywhere = near_m >= whole_plane_m;
    const std::span<const int> near = anywhere ? std::span<const int>() : cells_within(cell, near_m);
    int views = anywhere ? views_anywhere : 0;
    for (const int other : near) views += seen_[pair_of(d, other)];
    const double c = std::min(1.0, static_cast<double>(views) / needed);
    covered_ij_[pair] = static_cast<float>(c);
    const double share = static_cast<double>(weight_[pair]) / light;
    covered_ += share * c;
    if (c >= 1) continue;
    const auto mended = static_cast<float>(share / needed);
    if (anywhere) mended_anywhere += mended;
    std::vector<float>& mends = near.size() == 1 ? own_ : wide_;
    for (const int other : near) mends[pair_of(d, other)] += mended;
  }
  for (int cell = 0; cell < cells; ++cell) {
    const std::size_t pair = pair_of(d, cell);
    wide_[pair] += mended_anywhere;
    wanted_[pair_of(grid_.patch_of(d), cell)] += own_[pair] + wide_[pair];
  }
}

// The cell itself, and those whose middles are so near.
std::span<const int> Coverage::cells_within(int cell, double near_m) const {
  const std::vector<int>& around = neighbours_[static_cast<std::size_t>(cell)];
  std::size_t count = 1;
  while (count < around.size() && apart_m_[pair_of(cell, around[count])] <= near_m) ++count;
  return {around.data(), count};
}

void Coverage::report_patches(double light) {
  patches_.clear();
  for (int patch = 0; patch < grid_.patches(); ++patch) {
    double weight = 0, covered = 0;
    for (int d = 4 * patch; d < 4 * patch + 4; ++d)
      for (int cell = 0; cell < cell_count(); ++cell) {
        const std::size_t pair = pair_of(d, cell);
        weight += static_cast<double>(weight_[pair]);
        covered += static_cast<double>(weight_[pair] * covered_ij_[pair]);
      }
    if (!(weight > 0)) continue;
    const Vector3d& centre = grid_.patch_centre(patch);
    patches_.push_back({std::atan2(centre.y(), centre.x()) / degree, std::asin(centre.z()) / degree, weight / light,
                        covered / weight});
  }
}

CoverageStatus Coverage::status() {
  evaluate();
  return {covered_, done_, patches_, std::nullopt};
}

double Coverage::wanted(int patch, int cell) {
  evaluate();
  return reachable(patch, cell) ? static_cast<double>(wanted_[pair_of(patch, cell)]) : 0;
}

double Coverage::gain(std::span<const Rigid3> poses) {
  evaluate();
  ++now_;
  // What one view mends in many cells counts once a direction, through whichever cell it mends most.
  std::fill(widest_.begin(), widest_.end(), 0.F);
  double sum = 0;
  for (const Rigid3& world_from_mirror : poses) {
    cast(world_from_mirror, 12, 9);
    for (const RaySeen& ray : rays_) {
      if (ray.cell < 0) continue;
      const std::size_t pair = pair_of(ray.direction, ray.cell);
      if (stamp_[pair] == now_) continue;
      stamp_[pair] = now_;
      sum += static_cast<double>(own_[pair]);
      float& widest = widest_[static_cast<std::size_t>(ray.direction)];
      if (wide_[pair] <= widest) continue;
      sum += static_cast<double>(wide_[pair] - widest);
      widest = wide_[pair];
    }
  }
  return sum;
}

}  // namespace mf
