// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "host/gl/gl_objects.h"
#include "host/io/view.h"
#include "host/lumigraph/proxy.h"

namespace mf {

// Texture units and buffer bindings that both passes of a frame share (shaders/common_view.glsl).
inline constexpr GLuint rays_unit = 0;
inline constexpr GLuint surface_unit = 1;

// Where each pixel's ray of a view meets a proxy, on OpenGL: the first pass of a frame.
//
// Planes, spheres and boxes are intersected in a compute shader, by the formulas of trace() (proxy_rays.h). Of a mesh
// the triangles' numbers are drawn first, by a pinhole; the shader then meets the drawn triangle with the pixel's exact
// ray, and interpolates its normal. For a view without distortion the pinhole is the view's camera, texel by pixel; for
// one with it, it holds the view's field of view at four times its resolution, and the ray meets
// what was drawn at the four nearest texels, so that only pixels at outlines may differ.
class GlProxySurface {
 public:
  // A current context is a precondition of everything here; the proxy outlives this. Throws InputError when OpenGL's
  // buffers cannot hold the mesh.
  explicit GlProxySurface(const Proxy&);

  // Leaves the view in ViewBlock, its rays at rays_unit, and at surface_unit the normal and the distance of each pixel.
  void find(const View&);

 private:
  struct Raster {  // the pinhole that triangles are drawn with, texels
    CameraModel camera;
    GlTexture triangles, depth;
    GlFramebuffer target;
  };

  void upload_mesh(const TriangleMesh&);
  void set_camera(const CameraModel&);
  void make_raster(const CameraModel&);
  void use_surface(const PlaneProxy&, const View&);
  void use_surface(const SphereProxy&, const View&);
  void use_surface(const BoxProxy&, const View&);
  void use_surface(const MeshProxy&, const View&);

  const Proxy* proxy_;
  CameraModel camera_;  // that rays and targets are of; 0 × 0: none yet
  GlBuffer view_block_;
  GlTexture rays_, surface_;
  GlProgram meet_;
  // Of meshes.
  GlProgram draw_;
  GlBuffer positions_, normals_, triangles_;
  GlVertexArray layout_;
  float nearest_ = 0;
  Raster raster_;
};

}  // namespace mf
