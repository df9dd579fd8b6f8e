// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "host/lumigraph/lumigraph.h"
#include "tests/host/lumigraph/made_photos.h"

namespace mf {
namespace {

using test::blotches;
using test::looking;
using test::pinhole;

constexpr double step_px = 0.01;

// Largest difference of neighbours about a pixel: a picture that moves by less than a pixel changes by less than that.
float local_gradient(const ImageF& picture, int x, int y, int c) {
  float low = picture.at(x, y, c);
  float high = low;
  for (int dy = -1; dy <= 1; ++dy)
    for (int dx = -1; dx <= 1; ++dx) {
      const float value = picture.at(std::clamp(x + dx, 0, picture.width - 1), std::clamp(y + dy, 0, picture.height - 1), c);
      low = std::min(low, value);
      high = std::max(high, value);
    }
  return high - low;
}

struct Change {
  double worst_unexplained = 0;  // change of a value beyond what its gradient explains
};

// The camera goes `steps` steps of 1/100 pixel along x and looks at every pixel's change.
Change walk(const Lumigraph& lumigraph, const View& start, double depth, int steps, double more_px) {
  const double step = step_px * depth / start.camera.fx();
  Change change;
  ImageF last;
  ImageU8 last_covered;
  for (int i = 0; i < steps; ++i) {
    View view = start;
    view.cam_from_world.translation.x() -= i * step;
    const LumigraphPicture picture = lumigraph.render(view, {});
    const auto& now = std::get<ImageF>(picture.picture);
    for (int y = 0; i > 0 && y < now.height; ++y)
      for (int x = 0; x < now.width; ++x) {
        if (picture.covered.at(x, y) == 0 || last_covered.at(x, y) == 0) continue;  // beyond all photos
        for (int c = 0; c < 3; ++c) {
          const double explained = (step_px + more_px) * local_gradient(now, x, y, c);
          const double differs = std::abs(now.at(x, y, c) - last.at(x, y, c));
          change.worst_unexplained = std::max(change.worst_unexplained, differs - explained);
        }
      }
    last = now;
    last_covered = picture.covered;
  }
  return change;
}

PhotoSet row_of_photos(const Proxy& walls) {
  PhotoSet set;
  for (int i = 0; i < 9; ++i) {
    const double x = 0.5 * (i - 4);
    const View view{pinhole(160, 30 + 2 * (i % 3)), looking({x, 0.2 * (i % 2), 5}, {0.7 * x, 0, 0})};
    set.photos.push_back(test::photo_of(std::to_string(i), view, walls, blotches(0.5F)));
  }
  return set;
}

// The proxy is the truth: whatever photos come and go, at borders too, the picture only moves.
TEST(Continuity, AKnownWallMovesByWhatItsGradientExplains) {
  const Proxy wall = PlaneProxy{Eigen::Vector3f(0.1F, 0, 1).normalized(), 0};
  const Lumigraph lumigraph(row_of_photos(wall), PlaneProxy{Eigen::Vector3f(0.1F, 0, 1).normalized(), 0});
  const View start{pinhole(96, 40), looking({-0.43, 0.11, 4.6}, {-0.3, 0.1, 0})};
  const Change change = walk(lumigraph, start, 4.6, 60, 0.02);
  EXPECT_LT(change.worst_unexplained, 1.0 / 255 / 4);
}

// The proxy is off by a fifth of the distance, so the photos differ by parallax of several pixels: what a photo that
// appears at once would show is of the order of the pattern, 0.3. Weights may change it by their slow slope only.
TEST(Continuity, PhotosThatDisagreeFadeIntoEachOther) {
  const Proxy wall = PlaneProxy{Eigen::Vector3f::UnitZ(), -1};
  const Lumigraph lumigraph(row_of_photos(wall), PlaneProxy{Eigen::Vector3f::UnitZ(), 0});
  const View start{pinhole(96, 40), looking({-0.43, 0.11, 4.6}, {-0.3, 0.1, 0})};
  const Change change = walk(lumigraph, start, 4.6, 60, 0.02);
  EXPECT_LT(change.worst_unexplained, 1.0 / 255);
}

// Behind a foreground photos come and go as it uncovers points.
TEST(Continuity, VisibilityFadesToo) {
  const Proxy walls = MeshProxy(test::bumpy_ball_on_floor(64));
  PhotoSet set;
  const std::vector<View> views = test::cap_of_views(24, 4, 55, pinhole(160, 50));
  for (std::size_t i = 0; i < views.size(); ++i) {
    set.photos.push_back(test::photo_of(std::to_string(i), views[i], walls, blotches(0.8F)));
    // Each photo at an exposure of its own, so that every change of weights shows.
    for (float& value : std::get<ImageF>(set.photos.back().picture).data) value *= 0.85F + 0.3F * static_cast<float>(i % 2);
  }
  const Lumigraph lumigraph(set, MeshProxy(test::bumpy_ball_on_floor(64)));
  const View start{pinhole(96, 45), looking({1.2, -1.6, 3}, {0, 0, -0.4})};
  const double step = step_px * 3.6 / start.camera.fx();
  ImageF last;
  int compared = 0;
  for (int i = 0; i < 40; ++i) {
    View view = start;
    view.cam_from_world.translation.x() -= i * step;
    const LumigraphPicture picture = lumigraph.render(view, {});
    const auto& now = std::get<ImageF>(picture.picture);
    for (int y = 0; i > 0 && y < now.height; ++y)
      for (int x = 0; x < now.width; ++x) {
        // The silhouette itself moves on a whole pixel at once: an edge of the picture, not of the blending.
        const auto before = lumigraph.point_at(start, {x + 0.5, y + 0.5});
        const auto after = lumigraph.point_at(view, {x + 0.5, y + 0.5});
        if (!before || !after || (*before - *after).norm() > 0.1) continue;
        ++compared;
        for (int c = 0; c < 3; ++c)
          EXPECT_LT(std::abs(now.at(x, y, c) - last.at(x, y, c)), 0.03 * local_gradient(now, x, y, c) + 2.0 / 255)
              << x << ", " << y << " of frame " << i;
      }
    last = now;
  }
  EXPECT_GT(compared, 100000);
}

}  // namespace
}  // namespace mf
