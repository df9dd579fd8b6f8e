// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/vertex_field.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <opencv2/imgproc.hpp>
#include <set>

#include "host/lumigraph/proxy_rays.h"
#include "host/lumigraph/ray_answers.h"

namespace mf::bench {

namespace {

struct Vertex {
  Eigen::Vector2d pixel;
  float depth = 0;  // of the proxy; infinite: not there
  std::vector<ViewWeight> weights;
};

// Depth, then the k best photos, of the vertices [first, first + 64).
class VertexWeights {
 public:
  VertexWeights(const VertexField& field, const View& view, const LumigraphOptions& options)
      : field_(field), view_(view), options_(options), eye_(view.cam_from_world.inverse().translation) {
    for (const Lumigraph::Source& source : field.sources)
      answering_.push_back(
          answering_view(answering_camera(source.camera), source.cam_from_world, {}, eye_, options.border));
  }

  void operator()(std::span<Vertex> vertices) const {
    const std::size_t count = vertices.size();
    std::array<std::array<float, largest_bundle>, 12> row;
    const auto part = [&](std::size_t i) { return std::span(row[i]).first(count); };
    const Eigen::Matrix3d world_from_cam = view_.cam_from_world.rotation.conjugate().toRotationMatrix();
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Vector3d d = world_from_cam * view_.camera.unproject(vertices[i].pixel).value();
      for (std::size_t c = 0; c < 3; ++c) row[c][i] = static_cast<float>(d[static_cast<Eigen::Index>(c)]);
    }
    trace(field_.proxy, {eye_.cast<float>(), part(0), part(1), part(2), part(3), part(4), part(5), part(6)});
    for (std::size_t i = 0; i < count; ++i) {
      vertices[i].depth = row[3][i];
      if (!std::isfinite(row[3][i])) row[3][i] = 1;  // such vertices are not drawn
    }
    const RayBundle bundle{part(0), part(1), part(2), part(3),
                           part(4), part(5), part(6), static_cast<float>(view_.camera.fx() * view_.camera.fy())};
    std::vector<std::vector<ViewPenalty>> candidates(count);
    std::array<float, largest_bundle> weight;
    std::array<float, largest_bundle> worst;
    worst.fill(std::numeric_limits<float>::infinity());
    for (std::uint32_t v = 0; v < answering_.size(); ++v) {
      const RayAnswers answers{part(7), part(8), part(9), std::span(weight).first(count), part(10)};
      answer(answering_[v], bundle, options_.penalty, 1, worst, answers);
      for (std::size_t i = 0; i < count; ++i) candidates[i].push_back({v, row[10][i]});
    }
    for (std::size_t i = 0; i < count; ++i) {
      vertices[i].weights.resize(static_cast<std::size_t>(options_.penalty.k));
      vertices[i].weights.resize(blend_weights(candidates[i], options_.penalty.k, 1e-6F, vertices[i].weights));
    }
  }

 private:
  const VertexField& field_;
  const View& view_;
  const LumigraphOptions& options_;
  Eigen::Vector3d eye_;
  std::vector<AnsweringView> answering_;
};

using Pixel = std::pair<float, float>;
using Triangle = std::array<Pixel, 3>;

class Triangulation {
 public:
  explicit Triangulation(const CameraModel& camera)
      : width_(static_cast<float>(camera.width)),
        height_(static_cast<float>(camera.height)),
        delaunay_(cv::Rect(-1, -1, camera.width + 3, camera.height + 3)) {}

  void add(const Eigen::Vector2d& pixel) {
    const Pixel at(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()));
    if (at.first >= 0 && at.second >= 0 && at.first <= width_ && at.second <= height_ && points_.insert(at).second)
      delaunay_.insert(cv::Point2f(at.first, at.second));
  }

  // The edge is in the triangulation when its ends are neighbours; else its middle is added, and both halves looked at.
  void hold(const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
    constexpr double shortest_px = 2;
    add(from);
    add(to);
    if ((to - from).norm() < shortest_px || neighbours(from, to)) return;
    const Eigen::Vector2d middle = (from + to) / 2;
    hold(from, middle);
    hold(middle, to);
  }

  [[nodiscard]] std::vector<Triangle> triangles() const {
    std::vector<cv::Vec6f> all;
    delaunay_.getTriangleList(all);
    std::vector<Triangle> inside;
    for (const cv::Vec6f& t : all) {
      const Triangle triangle{Pixel(t[0], t[1]), Pixel(t[2], t[3]), Pixel(t[4], t[5])};
      if (std::all_of(triangle.begin(), triangle.end(), [&](const Pixel& p) { return points_.count(p) != 0; }))
        inside.push_back(triangle);
    }
    return inside;
  }
  [[nodiscard]] const std::set<Pixel>& points() const { return points_; }

 private:
  bool neighbours(const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
    int edge = 0;
    int vertex = 0;
    const cv::Point2f start(static_cast<float>(from.x()), static_cast<float>(from.y()));
    const cv::Point2f end(static_cast<float>(to.x()), static_cast<float>(to.y()));
    if (delaunay_.locate(start, edge, vertex) != cv::Subdiv2D::PTLOC_VERTEX) return true;  // out of the picture
    int first = 0;
    delaunay_.getVertex(vertex, &first);
    for (int e = first, turns = 0; turns < 64; ++turns) {
      cv::Point2f other;
      delaunay_.edgeDst(e, &other);
      if (other == end) return true;
      e = delaunay_.getEdge(e, cv::Subdiv2D::NEXT_AROUND_ORG);
      if (e == first) break;
    }
    return false;
  }

  float width_, height_;
  std::set<Pixel> points_;
  cv::Subdiv2D delaunay_;
};

Triangulation triangulate(const VertexField& field, const View& view) {
  Triangulation triangulation(view.camera);
  const auto on_grid = [&](int size, int i) { return std::min(i * field.grid_px, size); };
  for (int y = 0; (y - 1) * field.grid_px < view.camera.height; ++y)
    for (int x = 0; (x - 1) * field.grid_px < view.camera.width; ++x)
      triangulation.add({on_grid(view.camera.width, x), on_grid(view.camera.height, y)});
  for (const Lumigraph::Source& source : field.sources) {
    const Eigen::Vector3d centre = view.cam_from_world * source.cam_from_world.inverse().translation;
    if (centre.z() > 1e-6) triangulation.add(view.camera.project(centre));
  }
  for (const VertexField::Edge& edge : field.edges) {
    Eigen::Vector3d from = view.cam_from_world * edge.from;
    Eigen::Vector3d to = view.cam_from_world * edge.to;
    constexpr double near = 0.05;
    if (from.z() < near && to.z() < near) continue;
    if (from.z() < near) from += (near - from.z()) / (to.z() - from.z()) * (to - from);
    if (to.z() < near) to += (near - to.z()) / (from.z() - to.z()) * (from - to);
    // The part in the picture: the edge is cut at the border.
    Eigen::Vector2d a = view.camera.project(from);
    Eigen::Vector2d b = view.camera.project(to);
    double low = 0;
    double high = 1;
    for (int axis = 0; axis < 2; ++axis) {
      const double size = axis == 0 ? view.camera.width : view.camera.height;
      const double step = b[axis] - a[axis];
      if (std::abs(step) < 1e-9) continue;
      low = std::max(low, std::min(-a[axis] / step, (size - a[axis]) / step));
      high = std::min(high, std::max(-a[axis] / step, (size - a[axis]) / step));
    }
    if (low < high) triangulation.hold(a + low * (b - a), a + high * (b - a));
  }
  return triangulation;
}

float weight_at(const Vertex& vertex, std::uint32_t view) {
  for (const ViewWeight& w : vertex.weights)
    if (w.view == view) return w.weight;
  return 0;
}

// Inverse depth and weights are linear over the picture.
struct Linear {
  double at_origin, per_x, per_y;
  [[nodiscard]] double operator()(double x, double y) const { return at_origin + per_x * x + per_y * y; }
};

void draw(const VertexField& field, const View& view, const std::array<const Vertex*, 3>& corners, ImageF& sum) {
  Eigen::Matrix3d corner_rows;
  for (int i = 0; i < 3; ++i) {
    if (!std::isfinite(corners[static_cast<std::size_t>(i)]->depth)) return;
    corner_rows.row(i) << 1, corners[static_cast<std::size_t>(i)]->pixel.transpose();
  }
  if (std::abs(corner_rows.determinant()) < 1e-9) return;
  const Eigen::Matrix3d inverse = corner_rows.inverse();
  const auto linear = [&](auto value) {
    const Eigen::Vector3d c = inverse * Eigen::Vector3d(value(*corners[0]), value(*corners[1]), value(*corners[2]));
    return Linear{c[0], c[1], c[2]};
  };
  const Linear inverse_depth = linear([](const Vertex& v) { return 1.0 / v.depth; });
  std::set<std::uint32_t> speaking;
  for (const Vertex* corner : corners)
    for (const ViewWeight& w : corner->weights) speaking.insert(w.view);
  Eigen::Vector2d low = corners[0]->pixel.cwiseMin(corners[1]->pixel).cwiseMin(corners[2]->pixel);
  Eigen::Vector2d high = corners[0]->pixel.cwiseMax(corners[1]->pixel).cwiseMax(corners[2]->pixel);
  const int y0 = std::max(0, static_cast<int>(std::ceil(low.y() - 0.5)));
  const int y1 = std::min(sum.height - 1, static_cast<int>(std::ceil(high.y() - 0.5)) - 1);
  const Rigid3 world_from_cam = view.cam_from_world.inverse();
  for (const std::uint32_t speaker : speaking) {  // a pass
    const Linear weight = linear([&](const Vertex& v) { return static_cast<double>(weight_at(v, speaker)); });
    const Lumigraph::Source& source = field.sources[speaker];
    const Rigid3 source_from_cam = source.cam_from_world * world_from_cam;
    const Eigen::Matrix3d k = source.camera.k_matrix();
    // Projective texture: pixel and inverse depth of the new view → homogeneous pixel of the photo.
    const Eigen::Matrix3d turn = k * source_from_cam.rotation.toRotationMatrix() * view.camera.k_matrix().inverse();
    const Eigen::Vector3d shift = k * source_from_cam.translation;
    for (int y = y0; y <= y1; ++y) {
      double from = low.x();
      double to = high.x();
      // The span of the row inside of the three edges: where all barycentric coordinates are ≥ 0.
      for (int i = 0; i < 3; ++i) {
        const double at = inverse(0, i) + inverse(2, i) * (y + 0.5);
        const double slope = inverse(1, i);
        if (slope > 0) from = std::max(from, -at / slope);
        if (slope < 0) to = std::min(to, -at / slope);
        if (slope == 0 && at < 0) to = from - 1;
      }
      const int x1 = std::min(sum.width - 1, static_cast<int>(std::ceil(to - 0.5)) - 1);
      for (int x = std::max(0, static_cast<int>(std::ceil(from - 0.5))); x <= x1; ++x) {
        const double w = weight(x + 0.5, y + 0.5);
        if (!(w > 0)) continue;
        const Eigen::Vector3d h = turn * Eigen::Vector3d(x + 0.5, y + 0.5, 1) + inverse_depth(x + 0.5, y + 0.5) * shift;
        const Float4 colour =
            field.photos[speaker].sample(static_cast<float>(h.x() / h.z()), static_cast<float>(h.y() / h.z()), 0);
        for (int c = 0; c < 3; ++c) sum.at(x, y, c) += static_cast<float>(w) * colour[c];
      }
    }
  }
}

}  // namespace

ImageU8 render_by_vertices(const VertexField& field, const View& view, const LumigraphOptions& options) {
  const Triangulation triangulation = triangulate(field, view);
  std::vector<Vertex> vertices;
  std::map<Pixel, const Vertex*> vertex_at;
  vertices.reserve(triangulation.points().size());
  for (const Pixel& p : triangulation.points()) {
    vertices.push_back({{p.first, p.second}, 0, {}});
    vertex_at[p] = &vertices.back();
  }
  const VertexWeights weigh(field, view, options);
  const std::size_t bundles = (vertices.size() + largest_bundle - 1) / largest_bundle;
  tbb::parallel_for(std::size_t{0}, bundles, [&](std::size_t i) {
    const std::size_t first = i * largest_bundle;
    weigh(std::span(vertices).subspan(first, std::min(largest_bundle, vertices.size() - first)));
  });
  ImageF sum(view.camera.width, view.camera.height, 3);
  const std::vector<Triangle> triangles = triangulation.triangles();
  tbb::parallel_for(std::size_t{0}, triangles.size(), [&](std::size_t i) {
    const Triangle& t = triangles[i];
    draw(field, view, {vertex_at.at(t[0]), vertex_at.at(t[1]), vertex_at.at(t[2])}, sum);
  });
  ImageU8 picture(sum.width, sum.height, 3);
  for (std::size_t i = 0; i < picture.data.size(); ++i)
    picture.data[i] = static_cast<std::uint8_t>(std::lround(std::clamp(sum.data[i], 0.0F, 255.0F)));
  return picture;
}

}  // namespace mf::bench
