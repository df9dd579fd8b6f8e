#version 430 core
#include "common_surface.glsl"
#include "common_mesh.glsl"

layout(location = 0) uniform vec4 raster;  // fx, fy, cx, cy of the pinhole that triangles were drawn with, texels
layout(binding = 1) uniform usampler2D triangles;

// The ray meets the triangle that was drawn there. Where it passes by, as it may at an outline when the view's camera
// distorts and the pinhole does not, the triangle's nearest point counts, roughly: barycentric coordinates are clamped.
vec4 meet(vec2 ray, vec3 d) {
  ivec2 texel = ivec2(floor(raster.xy * ray + raster.zw));
  uint drawn = texelFetch(triangles, clamp(texel, ivec2(0), textureSize(triangles, 0) - 1), 0).x;
  if (drawn == 0u) return vec4(0.0);
  uint first = 3u * (drawn - 1u);
  uint a = corner[first];
  uint b = corner[first + 1u];
  uint c = corner[first + 2u];
  vec3 from_a = eye.xyz - position_of(a);
  vec3 ab = position_of(b) - position_of(a);
  vec3 ac = position_of(c) - position_of(a);
  // Moeller, Trumbore 1997.
  vec3 p = cross(d, ac);
  float determinant = dot(p, ab);
  if (determinant == 0.0) return vec4(0.0);
  float u = clamp(dot(p, from_a) / determinant, 0.0, 1.0);
  float v = clamp(dot(cross(from_a, ab), d) / determinant, 0.0, 1.0 - u);
  float depth = dot(axes[2].xyz, u * ab + v * ac - from_a);
  return vec4(normalize((1.0 - u - v) * normal_of(a) + u * normal_of(b) + v * normal_of(c)), depth);
}
