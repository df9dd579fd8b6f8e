// SPDX-License-Identifier: Apache-2.0
#include "tests/host/desk/desk_truth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "host/io/exr.h"
#include "host/io/view.h"
#include "host/render/light_set.h"

namespace mf::test {

namespace {

constexpr double pi = std::numbers::pi;
constexpr double board_half_m = 0.2;
constexpr double square_m = 0.05;
constexpr double board_top_m = 0.0005;
const Eigen::Vector3d white_albedo(0.75, 0.75, 0.72);
const Eigen::Vector3f lamp_in_world(0.5F, 0.32F, 0.85F);

double luminance(const ImageF& picture, int x, int y) {
  return 0.2126 * static_cast<double>(picture.at(x, y, 0)) + 0.7152 * static_cast<double>(picture.at(x, y, 1)) +
         0.0722 * static_cast<double>(picture.at(x, y, 2));
}

ImageF blurred_along(const ImageF& picture, double sigma, int dx, int dy) {
  const int reach = static_cast<int>(std::ceil(3 * sigma));
  ImageF out(picture.width, picture.height, picture.channels);
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x)
      for (int c = 0; c < picture.channels; ++c) {
        double sum = 0, weights = 0;
        for (int i = -reach; i <= reach; ++i) {
          const double weight = std::exp(-0.5 * i * i / (sigma * sigma));
          const int u = std::clamp(x + i * dx, 0, picture.width - 1);
          const int v = std::clamp(y + i * dy, 0, picture.height - 1);
          sum += weight * static_cast<double>(picture.at(u, v, c));
          weights += weight;
        }
        out.at(x, y, c) = static_cast<float>(sum / weights);
      }
  return out;
}

ImageF blurred(const ImageF& picture, double sigma) {
  return blurred_along(blurred_along(picture, sigma, 1, 0), sigma, 0, 1);
}

// Mean of each block of `ours` that covers a pixel of `truth`; the sizes are multiples.
ImageF reduced_to(const ImageF& ours, const ImageF& truth) {
  const int n = ours.width / truth.width;
  ImageF out(truth.width, truth.height, 3);
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x)
      for (int c = 0; c < 3; ++c) {
        float sum = 0;
        for (int i = 0; i < n * n; ++i) sum += ours.at(n * x + i % n, n * y + i / n, c);
        out.at(x, y, c) = sum / static_cast<float>(n * n);
      }
  return out;
}

Eigen::Vector3d lat_long(const ImageF& picture, int x, int y) {
  const double theta = (y + 0.5) / picture.height * pi;
  const double phi = (x + 0.5) / picture.width * 2 * pi;
  return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

constexpr double lowest_cosine = 0.1;

struct ProbeSums {
  double irradiance = 0;
  Eigen::Vector3d brightest = Eigen::Vector3d::UnitZ();
};

ProbeSums sums_of(const ImageF& probe) {
  ProbeSums sums;
  ImageF upper = probe;
  for (int y = 0; y < probe.height; ++y)
    for (int x = 0; x < probe.width; ++x) {
      const Eigen::Vector3d direction = lat_long(probe, x, y);
      const double solid_angle = pi / probe.height * 2 * pi / probe.width * direction.head<2>().norm();
      sums.irradiance += luminance(probe, x, y) * solid_angle * std::max(direction.z(), 0.0);
      if (direction.z() < lowest_cosine)
        for (int c = 0; c < 3; ++c) upper.at(x, y, c) = 0;
    }
  upper = blurred(upper, 2);
  double most = 0;
  for (int y = 0; y < upper.height; ++y)
    for (int x = 0; x < upper.width; ++x) {
      if (luminance(upper, x, y) <= most) continue;
      most = luminance(upper, x, y);
      sums.brightest = lat_long(upper, x, y);
    }
  return sums;
}

Eigen::Vector3d bilinear(const ImageF& picture, const Eigen::Vector2d& at_px) {
  const Eigen::Vector2d p = at_px.array() - 0.5;
  const int x = std::clamp(static_cast<int>(std::floor(p.x())), 0, picture.width - 2);
  const int y = std::clamp(static_cast<int>(std::floor(p.y())), 0, picture.height - 2);
  const double a = p.x() - x, b = p.y() - y;
  Eigen::Vector3d value;
  for (int c = 0; c < 3; ++c)
    value[c] = (1 - b) * ((1 - a) * static_cast<double>(picture.at(x, y, c)) +
                          a * static_cast<double>(picture.at(x + 1, y, c))) +
               b * ((1 - a) * static_cast<double>(picture.at(x, y + 1, c)) +
                    a * static_cast<double>(picture.at(x + 1, y + 1, c)));
  return value;
}

// Points well inside the board's white squares.
std::vector<Eigen::Vector3d> points_on_white() {
  constexpr int side = 64;
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < side * side; ++i) {
    const int x = i % side, y = i / side;
    const double u = 2 * board_half_m * (x + 0.5) / side, v = 2 * board_half_m * (y + 0.5) / side;
    const double column = u / square_m, row = v / square_m;
    const bool white = (static_cast<int>(column) + static_cast<int>(row)) % 2 == 1;
    constexpr double inner = 0.38;
    const auto off_centre = [](double s) { return std::abs(s - std::floor(s) - 0.5); };
    if (white && off_centre(column) < inner && off_centre(row) < inner)
      points.emplace_back(u - board_half_m, v - board_half_m, board_top_m);
  }
  return points;
}

}  // namespace

std::filesystem::path desk_folder() {
  return std::filesystem::path(MF_SHARED_DATA) / "desk";
}

ProbeError probe_error(const ImageF& ours, const ImageF& truth) {
  const ImageF probe = reduced_to(ours, truth);
  std::vector<double> stops;
  for (int y = 0; y < truth.height; ++y)
    for (int x = 0; x < truth.width; ++x) {
      constexpr double black = 1e-4;
      if (lat_long(truth, x, y).z() < lowest_cosine || luminance(probe, x, y) < black || luminance(truth, x, y) < black)
        continue;
      stops.push_back(std::abs(std::log2(luminance(probe, x, y) / luminance(truth, x, y))));
    }
  ProbeError error;
  if (stops.empty()) return {INFINITY, 0, 180};
  std::nth_element(stops.begin(), stops.begin() + static_cast<std::ptrdiff_t>(stops.size() / 2), stops.end());
  error.median_abs_stop = stops[stops.size() / 2];
  const ProbeSums a = sums_of(probe), b = sums_of(truth);
  error.irradiance_ratio = a.irradiance / b.irradiance;
  error.lamp_deg = std::acos(std::min(a.brightest.dot(b.brightest), 1.0)) * 180 / pi;
  return error;
}

double lamp_error_m(const LightField& field) {
  double least = INFINITY;
  for (const ShadedEmitter& e : field.emitters)
    least = std::min(least, static_cast<double>((e.emitter.position - lamp_in_world).norm()));
  return least;
}

TableError table_error(const LightField& field) {
  const ImageF plate = blurred(read_exr(desk_folder() / "truth" / "plate0.exr"), 1);
  const View view = read_view(desk_folder() / "truth" / "views.json", 0, std::array<int, 2>{plate.width, plate.height});
  const ImageF irradiance = plane_irradiance(field);
  const Rigid3 plane_from_world = field.plane.world_from_plane.inverse();
  const Eigen::Vector3d weights(0.2126, 0.7152, 0.0722);
  std::vector<double> ours, truth;
  for (const Eigen::Vector3d& point : points_on_white()) {
    const Eigen::Vector2d at_px = view.camera.project(view.cam_from_world * point);
    truth.push_back(weights.dot(pi * bilinear(plate, at_px).cwiseQuotient(white_albedo)));
    const Eigen::Vector2d p = (plane_from_world * point).head<2>();
    const Eigen::Vector2d relative = (p - field.plane.min_m).cwiseQuotient(field.plane.size_m());
    ours.push_back(
        weights.dot(bilinear(irradiance, {relative.x() * irradiance.width, (1 - relative.y()) * irradiance.height})));
  }
  const auto n = static_cast<double>(ours.size());
  const Eigen::Map<const Eigen::ArrayXd> o(ours.data(), static_cast<Eigen::Index>(ours.size()));
  const Eigen::Map<const Eigen::ArrayXd> t(truth.data(), static_cast<Eigen::Index>(truth.size()));
  const double covariance = ((o - o.mean()) * (t - t.mean())).sum();
  const double spread = std::sqrt((o - o.mean()).square().sum() * (t - t.mean()).square().sum());
  return {o.mean() / t.mean(), covariance / spread, std::sqrt((o / t - 1).square().sum() / n)};
}

double composite_psnr(const ImageF& ours, const ImageF& truth, const ImageF& plate) {
  constexpr double sigma = 2;
  const ImageF a = blurred(ours, sigma), b = blurred(truth, sigma), bare = blurred(plate, sigma);
  double squares = 0, count = 0;
  for (int y = 0; y < b.height; ++y)
    for (int x = 0; x < b.width; ++x) {
      float change = 0, brightest = 0.05F;
      for (int c = 0; c < 3; ++c) {
        change = std::max(change, std::abs(b.at(x, y, c) - bare.at(x, y, c)));
        brightest = std::max(brightest, bare.at(x, y, c));
      }
      if (change <= 0.1F * brightest) continue;
      for (int c = 0; c < 3; ++c) squares += std::pow(static_cast<double>(a.at(x, y, c) - b.at(x, y, c)), 2);
      count += 3;
    }
  return 10 * std::log10(count / squares);
}

}  // namespace mf::test
