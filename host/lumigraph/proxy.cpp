// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/proxy.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

#include "common/dense.h"
#include "common/error.h"
#include "common/file_bytes.h"
#include "host/lumigraph/visual_hull.h"

namespace mf {

namespace {

namespace fs = std::filesystem;

constexpr float no_end = std::numeric_limits<float>::infinity();

std::vector<double> numbers_in(const std::string& name, std::string_view text) {
  std::vector<double> numbers;
  while (!text.empty()) {
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    const bool separated = error == std::errc() && (end == text.data() + text.size() || *end == ',');
    if (!separated || !std::isfinite(value))
      throw InputError("--proxy", name, "has something else than numbers after its colon: separate them by commas");
    numbers.push_back(value);
    text.remove_prefix(std::min(text.size(), static_cast<std::size_t>(end - text.data()) + 1));
  }
  return numbers;
}

Eigen::Vector3d sight_of(const PosedPhoto& photo) {
  return photo.cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitZ();
}

// The mean 1/z of the points, over every photo that has them in its picture.
std::optional<double> mean_inverse_depth(const PhotoSet& set) {
  double sum = 0;
  int seen = 0;
  for (const PosedPhoto& photo : set.photos)
    for (const Eigen::Vector3f& point : set.points) {
      const Eigen::Vector3d x = photo.cam_from_world * point.cast<double>();
      if (!(x.z() > 0)) continue;
      const Eigen::Vector2d pixel = photo.camera.project(x);
      if (!(pixel.x() > 0 && pixel.y() > 0 && pixel.x() < photo.camera.width && pixel.y() < photo.camera.height))
        continue;
      sum += 1 / x.z();
      ++seen;
    }
  return seen > 0 ? std::optional(sum / seen) : std::nullopt;
}

// The point nearest to all optical axes: Σ (I − ddᵀ) x = Σ (I − ddᵀ) c.
Eigen::Vector3d convergence(const PhotoSet& set, const MeanSight& sight) {
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const PosedPhoto& photo : set.photos) {
    const Eigen::Vector3d d = sight_of(photo);
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - d * d.transpose();
    a += across;
    b += across * centre_of(photo);
  }
  // Parallel axes leave the distance open: the least eigenvalue, n · (mean square sine to the common direction), is
  // then that of a jitter of 0.3°.
  const double along = sight.direction.dot(a * sight.direction) / static_cast<double>(set.photos.size());
  const auto solution = solve_symmetric(a, b);
  const Eigen::Vector3d x = solution ? Eigen::Vector3d(*solution) : sight.centre;
  if (!(along > 3e-5) || !((x - sight.centre).dot(sight.direction) > 0))
    throw InputError(set.source, "--proxy plane",
                     "needs a distance: the set has no points (points3D.txt), and the optical axes do not converge "
                     "before the cameras: give plane:D");
  return x;
}

PlaneProxy facing_plane(const MeanSight& sight, double distance) {
  return {sight.direction.cast<float>(), static_cast<float>(sight.direction.dot(sight.centre) + distance)};
}

Proxy make_plane(const std::string& name, const std::vector<double>& numbers, const PhotoSet& set) {
  const MeanSight sight = mean_sight(set);
  if (numbers.size() > 1 || (numbers.size() == 1 && !(numbers[0] > 0)))
    throw InputError("--proxy", name, "takes one distance above 0, or none");
  if (!numbers.empty()) return facing_plane(sight, numbers[0]);
  if (const auto inverse = mean_inverse_depth(set)) return facing_plane(sight, 1 / *inverse);
  return facing_plane(sight, (convergence(set, sight) - sight.centre).dot(sight.direction));
}

Proxy make_sphere(const std::string& name, const std::vector<double>& numbers, const PhotoSet& set) {
  if (numbers.size() != 1 || !(numbers[0] > 0)) throw InputError("--proxy", name, "takes one radius above 0: sphere:R");
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const PosedPhoto& photo : set.photos) centre += centre_of(photo) / static_cast<double>(set.photos.size());
  for (const PosedPhoto& photo : set.photos)
    if ((centre_of(photo) - centre).norm() >= numbers[0])
      throw InputError("--proxy", name, photo.name + " was taken from outside of the sphere: give a larger radius");
  return SphereProxy{centre.cast<float>(), static_cast<float>(numbers[0])};
}

// Points are rarely all right: a box leaves out the outermost hundredth on each side.
BoxProxy box_of_points(const PhotoSet& set) {
  if (set.points.size() < 8)
    throw InputError(set.source, "--proxy box",
                     "needs the scene's points (points3D.txt): or give box:x0,y0,z0,x1,y1,z1");
  BoxProxy box;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<float> sorted;
    for (const Eigen::Vector3f& point : set.points) sorted.push_back(point[axis]);
    std::sort(sorted.begin(), sorted.end());
    const std::size_t outliers = sorted.size() / 100;
    box.low[axis] = sorted[outliers];
    box.high[axis] = sorted[sorted.size() - 1 - outliers];
    for (const PosedPhoto& photo : set.photos) {
      box.low[axis] = std::min(box.low[axis], static_cast<float>(centre_of(photo)[axis]));
      box.high[axis] = std::max(box.high[axis], static_cast<float>(centre_of(photo)[axis]));
    }
  }
  return box;
}

Proxy make_box(const std::string& name, const std::vector<double>& numbers, const PhotoSet& set) {
  if (numbers.empty()) return box_of_points(set);
  if (numbers.size() != 6) throw InputError("--proxy", name, "takes six numbers: box:x0,y0,z0,x1,y1,z1");
  BoxProxy box;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    if (!(numbers[i] < numbers[i + 3]))
      throw InputError("--proxy", name, "has a first corner that is not the lower one");
    box.low[axis] = static_cast<float>(numbers[i]);
    box.high[axis] = static_cast<float>(numbers[i + 3]);
  }
  return box;
}

// The tunnel's z is the mean line of sight; its y the photos' mean down.
Proxy make_tunnel(const std::string& name, const std::vector<double>& numbers, const PhotoSet& set) {
  const bool right = numbers.size() == 2 || numbers.size() == 3;
  if (!right || !std::all_of(numbers.begin(), numbers.end(), [](double n) { return n > 0; }))
    throw InputError("--proxy", name,
                     "takes a width and a height, and a distance of its end if it has one: tunnel:W,H,D");
  const MeanSight sight = mean_sight(set);
  Eigen::Vector3d down = Eigen::Vector3d::Zero();
  for (const PosedPhoto& photo : set.photos)
    down += photo.cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitY();
  Eigen::Matrix3d box_from_world;
  box_from_world.row(2) = sight.direction.transpose();
  const Eigen::Vector3d across = down.cross(sight.direction).normalized();
  box_from_world.row(0) = across.transpose();
  box_from_world.row(1) = sight.direction.cross(across).transpose();
  BoxProxy box;
  box.box_from_world.rotation = Eigen::Quaterniond(box_from_world);
  box.box_from_world.translation = -(box_from_world * sight.centre);
  const auto half_width = static_cast<float>(numbers[0] / 2);
  const auto half_height = static_cast<float>(numbers[1] / 2);
  box.low = {-half_width, -half_height, -no_end};
  box.high = {half_width, half_height, numbers.size() == 3 ? static_cast<float>(numbers[2]) : no_end};
  return box;
}

Proxy make_hull(const std::string& name, const std::vector<double>& numbers, const PhotoSet& set) {
  if (numbers.size() > 1 && numbers.size() != 7)
    throw InputError("--proxy", name, "takes a number of cells, and a box if it needs one: hull:N,x0,y0,z0,x1,y1,z1");
  HullOptions options;
  if (!numbers.empty()) options.resolution = static_cast<int>(std::clamp(numbers[0], 0.0, 1e6));
  if (numbers.size() == 7)
    options.box = {Eigen::Vector3d(numbers[1], numbers[2], numbers[3]),
                   Eigen::Vector3d(numbers[4], numbers[5], numbers[6])};
  if (const auto wrong = options.validate()) throw InputError("--proxy", name, *wrong);
  return MeshProxy(visual_hull(set, options));
}

Proxy make_mesh(const std::string& name, const fs::path& folder) {
  fs::path file = name;
  if (!fs::exists(file) && file.is_relative() && fs::exists(folder / file)) file = folder / file;
  if (!fs::exists(file))
    throw InputError("--proxy", name,
                     "is no proxy and no file: give plane, plane:D, sphere:R, box, tunnel:W,H, hull or a mesh");
  TriangleMesh mesh = read_mesh(file);
  const fs::path similarity = file.parent_path() / (file.stem().string() + "_to_pose_similarity.npy");
  if (fs::exists(similarity)) mesh = moved_by_similarity(std::move(mesh), similarity);
  return MeshProxy(std::move(mesh));
}

// The data of a .npy of doubles: "\x93NUMPY", version 1.0, a header's length, the header, little-endian numbers.
std::vector<double> read_npy_doubles(const fs::path& path, std::size_t count) {
  const std::string bytes = read_file_bytes(path);
  constexpr std::size_t preamble = 10;
  const InputError wrong(path.string(), "",
                         fmt::format("is no NumPy array of {} doubles: save it with numpy.save", count));
  if (bytes.size() < preamble || !bytes.starts_with("\x93NUMPY\x01")) throw wrong;
  const std::size_t header =
      static_cast<unsigned char>(bytes[8]) + 256U * static_cast<unsigned char>(bytes[9]) + preamble;
  if (bytes.size() != header + count * sizeof(double) || bytes.substr(0, header).find("'<f8'") == std::string::npos)
    throw wrong;
  static_assert(std::endian::native == std::endian::little);
  std::vector<double> values(count);
  std::memcpy(values.data(), bytes.data() + header, count * sizeof(double));
  return values;
}

}  // namespace

MeanSight mean_sight(const PhotoSet& set) {
  MeanSight mean{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  for (const PosedPhoto& photo : set.photos) {
    mean.centre += centre_of(photo) / static_cast<double>(set.photos.size());
    mean.direction += sight_of(photo) / static_cast<double>(set.photos.size());
  }
  // A mean vector this short is what directions all around leave: no plane faces them.
  if (!(mean.direction.norm() > 0.3))
    throw InputError(set.source, "--proxy",
                     "no one plane or tunnel faces photos that look all around: give sphere:R, box or a mesh");
  mean.direction.normalize();
  return mean;
}

TriangleMesh moved_by_similarity(TriangleMesh mesh, const fs::path& npy) {
  const std::vector<double> v = read_npy_doubles(npy, 10);
  const Eigen::Vector3d r(v[0], v[1], v[2]);
  const Eigen::Vector3d t(v[3], v[4], v[5]);
  const Eigen::Vector3d c(v[7], v[8], v[9]);
  const double scale = std::exp(v[6]);
  const Eigen::Matrix3d back =
      r.norm() > 0 ? Eigen::AngleAxisd(-r.norm(), r.normalized()).toRotationMatrix() : Eigen::Matrix3d::Identity();
  if (!back.allFinite() || !t.allFinite() || !c.allFinite() || !(scale > 0) || !std::isfinite(scale))
    throw InputError(npy.string(), "", "holds numbers that are not finite: make it again, or take it away");
  for (Eigen::Vector3f& p : mesh.positions) p = (back * (p.cast<double>() - c - t) / scale + c).cast<float>();
  for (Eigen::Vector3f& n : mesh.normals) n = back.cast<float>() * n;
  return mesh;
}

Proxy make_proxy(const std::string& name, const PhotoSet& set, const fs::path& folder) {
  const std::size_t colon = name.find(':');
  const std::string kind = name.substr(0, colon);
  const bool known = kind == "plane" || kind == "sphere" || kind == "box" || kind == "tunnel" || kind == "hull";
  if (!known || fs::exists(name)) return make_mesh(name, folder);
  const std::vector<double> numbers =
      colon == std::string::npos ? std::vector<double>{} : numbers_in(name, std::string_view(name).substr(colon + 1));
  if (kind == "plane") return make_plane(name, numbers, set);
  if (kind == "sphere") return make_sphere(name, numbers, set);
  if (kind == "box") return make_box(name, numbers, set);
  if (kind == "hull") return make_hull(name, numbers, set);
  return make_tunnel(name, numbers, set);
}

std::string describe(const Proxy& proxy) {
  struct Describer {
    std::string operator()(const PlaneProxy& p) const {
      return fmt::format("plane ({:.4g}, {:.4g}, {:.4g}) · x = {:.6g}", p.normal.x(), p.normal.y(), p.normal.z(),
                         p.offset);
    }
    std::string operator()(const SphereProxy& s) const {
      return fmt::format("sphere of radius {:.6g} about ({:.4g}, {:.4g}, {:.4g})", s.radius, s.centre.x(), s.centre.y(),
                         s.centre.z());
    }
    std::string operator()(const BoxProxy& b) const {
      return fmt::format("box ({:.4g}, {:.4g}, {:.4g}) to ({:.4g}, {:.4g}, {:.4g})", b.low.x(), b.low.y(), b.low.z(),
                         b.high.x(), b.high.y(), b.high.z());
    }
    std::string operator()(const MeshProxy& m) const {
      return fmt::format("mesh of {} triangles", m.mesh.triangles.size());
    }
  };
  return std::visit(Describer{}, proxy);
}

}  // namespace mf
