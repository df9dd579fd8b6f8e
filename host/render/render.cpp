// SPDX-License-Identifier: Apache-2.0
#include "host/render/render.h"

#include <numbers>

#include "common/check.h"
#include "host/render/bounce.h"
#include "host/render/gbuffer.h"

namespace mf {

namespace {

constexpr int ground_texels = 256;  // a side: 2 % of the object's radius each
constexpr int bounce_texels = 96;   // light off the object is smoother than its shadow

std::vector<SurfacePoint> points_of(const GroundRadiance& ground) {
  std::vector<SurfacePoint> points;
  for (int y = 0; y < ground.height; ++y)
    for (int x = 0; x < ground.width; ++x) {
      const Eigen::Vector2f p = ground.position(x, y);
      points.push_back({{p.x(), p.y(), 0}, Eigen::Vector3f::UnitZ(), Eigen::Vector3f::UnitZ()});
    }
  return points;
}

// Irradiance of the bare plane, to be looked up.
struct PlaneIrradiance {
  Eigen::Vector2f min_m, max_m;
  int resolution;
  std::vector<Eigen::Vector4f> texels;

  explicit PlaneIrradiance(const LightField& field)
      : min_m(field.plane.min_m.cast<float>()), max_m(field.plane.max_m.cast<float>()), resolution(field.resolution) {
    const ImageF map = plane_irradiance(field);
    for (std::size_t i = 0; i < map.data.size(); i += 3)
      texels.emplace_back(map.data[i], map.data[i + 1], map.data[i + 2], 0.F);
  }
  [[nodiscard]] Eigen::Vector3f at(const Eigen::Vector3f& p) const {
    return sample(PlaneImage{min_m, max_m, resolution, resolution, texels.data()}, p.head<2>()).head<3>();
  }
};

// What the object's presence does to the ground's light, on a grid.
struct GroundLight {
  GroundRadiance radiance;  // with the object there
  GroundRadiance bounce;    // irradiance that the object reflects onto the ground
};

class Renderer {
 public:
  Renderer(const RenderInput& input, const RenderOptions& options, const Progress& progress)
      : input_(&input),
        options_(&options),
        progress_(&progress),
        mesh_(transformed(input.field.plane.world_from_plane.inverse(), input.mesh_in_world)),
        scene_(mesh_),
        illuminator_(options.backend, mesh_, scene_),
        from_above_(make_light_set(input.field, options.importance)),
        bare_(input.field) {}

  RenderResult run() {
    RenderResult result;
    result.backend = illuminator_.description();
    const Rigid3 cam_from_plane = input_->view.cam_from_world * input_->field.plane.world_from_plane;
    const GBuffer g = make_gbuffer(mesh_, scene_, input_->view.camera, cam_from_plane);
    const GroundLight ground = light_ground();
    LightSet lights = from_above_;
    if (input_->ground) append_ground_light(lights, ground.radiance.image(), options_->ground_directions);
    result.lights = lights.lights.size();
    result.fragments = g.points.size() + g.ground_points.size();
    shade_object(g, lights, result);
    shade_ground(g, ground, result);
    return result;
  }

 private:
  // The light that the mesh keeps from points of the plane.
  std::vector<Eigen::Vector3f> shadow(std::span<const SurfacePoint> points) {
    return illuminator_.irradiance(points, from_above_, LightSum::blocked, *progress_);
  }

  GroundLight light_ground() {
    GroundLight light{ground_around(scene_.bounds(), ground_texels), ground_around(scene_.bounds(), bounce_texels)};
    if (mesh_.triangles.empty()) return light;
    const std::vector<SurfacePoint> points = points_of(light.radiance);
    const std::vector<Eigen::Vector3f> blocked = shadow(points);
    darken(light, points, blocked);
    if (options_->bounce_directions == 0) return light;
    LightSet lights = from_above_;
    if (input_->ground) append_ground_light(lights, light.radiance.image(), options_->ground_directions);
    on_vertices_ = vertex_irradiance(mesh_, scene_, lights);
    const std::vector<Eigen::Vector3f> bounced =
        gather_bounce(mesh_, scene_, on_vertices_, points_of(light.bounce), options_->bounce_directions);
    for (std::size_t i = 0; i < bounced.size(); ++i) light.bounce.texels[i].head<3>() = bounced[i];
    darken(light, points, blocked);
    return light;
  }

  // radiance = that of the bare ground · E_with / E_without
  void darken(GroundLight& light, const std::vector<SurfacePoint>& points,
              const std::vector<Eigen::Vector3f>& blocked) const {
    if (!input_->ground) return;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector2f p = points[i].position.head<2>();
      const Eigen::Vector3f without = bare_.at(points[i].position);
      const Eigen::Vector3f with = without - blocked[i] + sample(light.bounce.image(), p).head<3>();
      const Eigen::Vector3f bare = sample(input_->ground->image(), p).head<3>();
      for (int c = 0; c < 3; ++c)
        light.radiance.texels[i][c] = without[c] > 0 ? bare[c] * std::max(0.F, with[c]) / without[c] : bare[c];
    }
  }

  void shade_object(const GBuffer& g, const LightSet& lights, RenderResult& result) {
    result.object = ImageF(g.width, g.height, 4);
    std::vector<Eigen::Vector3f> onto_itself;
    if (!on_vertices_.empty())
      onto_itself = gather_bounce(mesh_, scene_, on_vertices_, vertex_points(mesh_), options_->bounce_directions);
    const std::vector<Eigen::Vector3f> direct =
        illuminator_.irradiance(g.points, lights, LightSum::visible, *progress_);
    for (std::size_t i = 0; i < g.fragments.size(); ++i) {
      const Fragment& f = g.fragments[i];
      Eigen::Vector3f irradiance = direct[i];
      Eigen::Vector3f albedo = Eigen::Vector3f::Zero();
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t v = mesh_.triangles[f.triangle][k];
        albedo += f.barycentric[k] * mesh_.albedo[v];
        if (!onto_itself.empty()) irradiance += f.barycentric[k] * onto_itself[v];
      }
      const Eigen::Vector3f radiance = albedo.cwiseProduct(irradiance) / std::numbers::pi_v<float>;
      float* pixel = &result.object.data[4 * static_cast<std::size_t>(f.pixel)];
      for (int c = 0; c < 3; ++c) pixel[c] += f.coverage * radiance[c];
      pixel[3] += f.coverage;
    }
  }

  void shade_ground(const GBuffer& g, const GroundLight& ground, RenderResult& result) {
    result.ground_without = ImageF(g.width, g.height, 3);
    result.ground_with = ImageF(g.width, g.height, 3);
    const std::vector<Eigen::Vector3f> blocked = shadow(g.ground_points);
    for (std::size_t i = 0; i < g.ground_points.size(); ++i) {
      const Eigen::Vector3f& p = g.ground_points[i].position;
      const Eigen::Vector3f without = bare_.at(p);
      const Eigen::Vector3f with = without - blocked[i] + bounce_at(ground.bounce, p);
      for (int c = 0; c < 3; ++c) {
        const std::size_t at = 3 * static_cast<std::size_t>(g.ground_pixels[i]) + static_cast<std::size_t>(c);
        result.ground_without.data[at] = without[c];
        result.ground_with.data[at] = std::max(0.F, with[c]);
      }
    }
  }

  // Beyond the grid the object's light is less than a thousandth of what it is beneath it: none.
  static Eigen::Vector3f bounce_at(const GroundRadiance& bounce, const Eigen::Vector3f& p) {
    const Eigen::Array2f xy = p.head<2>().array();
    if ((xy < bounce.min_m.array()).any() || (xy > bounce.max_m.array()).any()) return Eigen::Vector3f::Zero();
    return sample(bounce.image(), p.head<2>()).head<3>();
  }

  const RenderInput* input_;
  const RenderOptions* options_;
  const Progress* progress_;
  TriangleMesh mesh_;  // plane frame
  RayScene scene_;
  Illuminator illuminator_;
  LightSet from_above_;
  PlaneIrradiance bare_;
  std::vector<Eigen::Vector3f> on_vertices_;  // direct irradiance; empty without a bounce
};

}  // namespace

std::optional<std::string> RenderOptions::validate() const {
  if (ground_directions < 16 || ground_directions > 100000) return "ground_directions must lie between 16 and 100000";
  if (bounce_directions != 0 && (bounce_directions < 16 || bounce_directions > 100000))
    return "bounce_directions must be 0 or lie between 16 and 100000";
  return importance.validate();
}

RenderResult render(const RenderInput& input, const RenderOptions& options, const Progress& progress) {
  check(!options.validate(), "valid render options");
  return Renderer(input, options, progress).run();
}

GroundRadiance diffuse_ground(const LightField& field, const TriangleMesh& mesh_in_world, double albedo) {
  const TriangleMesh mesh = transformed(field.plane.world_from_plane.inverse(), mesh_in_world);
  GroundRadiance ground = ground_around(bounding_sphere(mesh), ground_texels);
  const PlaneIrradiance bare(field);
  for (int y = 0; y < ground.height; ++y)
    for (int x = 0; x < ground.width; ++x) {
      const Eigen::Vector2f p = ground.position(x, y);
      const Eigen::Vector3f radiance = static_cast<float>(albedo / std::numbers::pi) * bare.at({p.x(), p.y(), 0});
      ground.texels[static_cast<std::size_t>(y * ground.width + x)].head<3>() = radiance;
    }
  return ground;
}

}  // namespace mf
