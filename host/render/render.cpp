// SPDX-License-Identifier: Apache-2.0
#include "host/render/render.h"

#include <numbers>

#include "common/check.h"
#include "host/render/bounce.h"
#include "host/render/gbuffer.h"

namespace mf {

namespace {

constexpr int ground_texels = 256;  // a side: 2 % of the object's radius each
constexpr int bounce_lights = 320;  // what lights the object from below before the bounce
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
        mesh_(transformed(input.light.plane.world_from_plane.inverse(), input.mesh_in_world)),
        scene_(mesh_),
        illuminator_(options.backend, mesh_, scene_) {
    check(!input.ground || !input.light.bare.texels.empty(), "a ground's own light");
  }

  RenderResult run() {
    RenderResult result;
    result.backend = illuminator_.description();
    const Rigid3 cam_from_plane = input_->view.cam_from_world * input_->light.plane.world_from_plane;
    const GBuffer g = make_gbuffer(mesh_, scene_, input_->view.camera, cam_from_plane);
    const GroundLight ground = light_ground();
    LightSet lights = input_->light.from_above;
    if (input_->ground) append_ground_light(lights, ground.radiance.image(), options_->ground_directions);
    result.lights = lights.lights.size() + lights.emitter_points.size();
    result.fragments = g.points.size() + g.ground_points.size();
    shade_object(g, lights, result);
    shade_ground(g, ground, result);
    return result;
  }

 private:
  // The light that the mesh keeps from points of the plane.
  std::vector<Eigen::Vector3f> shadow(std::span<const SurfacePoint> points) {
    return illuminator_.irradiance(points, input_->light.from_above, LightSum::blocked, *progress_);
  }

  GroundLight light_ground() {
    GroundLight light{ground_around(scene_.bounds(), ground_texels), ground_around(scene_.bounds(), bounce_texels)};
    if (mesh_.triangles.empty()) return light;
    const std::vector<SurfacePoint> points = points_of(light.radiance);
    std::vector<Eigen::Vector3f> blocked;
    if (input_->ground) {
      blocked = shadow(points);
      darken(light, points, blocked);
    }
    if (options_->bounce_directions == 0) return light;
    LightSet lights = input_->light.for_bounce;
    if (input_->ground) append_ground_light(lights, light.radiance.image(), bounce_lights);
    on_vertices_ = vertex_irradiance(mesh_, scene_, lights);
    if (!input_->ground) return light;
    const std::vector<Eigen::Vector3f> bounced =
        gather_bounce(mesh_, scene_, on_vertices_, points_of(light.bounce), options_->bounce_directions);
    for (std::size_t i = 0; i < bounced.size(); ++i) light.bounce.texels[i].head<3>() = bounced[i];
    darken(light, points, blocked);
    return light;
  }

  // radiance = that of the bare ground · E_with / E_without
  void darken(GroundLight& light, const std::vector<SurfacePoint>& points,
              const std::vector<Eigen::Vector3f>& blocked) const {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector2f p = points[i].position.head<2>();
      const Eigen::Vector3f without = bare_at(p);
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
    if (!input_->ground) return;
    const std::vector<Eigen::Vector3f> blocked = shadow(g.ground_points);
    for (std::size_t i = 0; i < g.ground_points.size(); ++i) {
      const Eigen::Vector3f& p = g.ground_points[i].position;
      const Eigen::Vector3f without = bare_at(p.head<2>());
      const Eigen::Vector3f with = without - blocked[i] + bounce_at(ground.bounce, p);
      for (int c = 0; c < 3; ++c) {
        const std::size_t at = 3 * static_cast<std::size_t>(g.ground_pixels[i]) + static_cast<std::size_t>(c);
        result.ground_without.data[at] = without[c];
        result.ground_with.data[at] = std::max(0.F, with[c]);
      }
    }
  }

  [[nodiscard]] Eigen::Vector3f bare_at(const Eigen::Vector2f& p) const { return input_->light.on_bare_plane(p); }

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
  std::vector<Eigen::Vector3f> on_vertices_;  // direct irradiance; empty without a bounce
};

}  // namespace

std::optional<std::string> RenderOptions::validate() const {
  if (ground_directions < 16 || ground_directions > 100000) return "ground_directions must lie between 16 and 100000";
  if (bounce_directions != 0 && (bounce_directions < 16 || bounce_directions > 100000))
    return "bounce_directions must be 0 or lie between 16 and 100000";
  return std::nullopt;
}

RenderResult render(const RenderInput& input, const RenderOptions& options, const Progress& progress) {
  check(!options.validate(), "valid render options");
  return Renderer(input, options, progress).run();
}

GroundRadiance diffuse_ground(const IncidentLight& light, const TriangleMesh& mesh_in_world, double albedo) {
  const TriangleMesh mesh = transformed(light.plane.world_from_plane.inverse(), mesh_in_world);
  GroundRadiance ground = ground_around(bounds_of(mesh), ground_texels);
  for (int y = 0; y < ground.height; ++y)
    for (int x = 0; x < ground.width; ++x)
      ground.texels[static_cast<std::size_t>(y * ground.width + x)].head<3>() =
          static_cast<float>(albedo / std::numbers::pi) * light.on_bare_plane(ground.position(x, y));
  return ground;
}

}  // namespace mf
