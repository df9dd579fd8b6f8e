#version 430 core
#include "common_surface.glsl"
#include "common_mesh.glsl"

layout(location = 0) uniform vec4 raster;  // fx, fy, cx, cy of the pinhole that triangles were drawn with, texels
layout(binding = 1) uniform usampler2D triangles;

// u, v and the depth where the ray meets the triangle's plane: Moeller, Trumbore 1997.
vec3 meet_plane(uint triangle, vec3 d) {
  vec3 a = position_of(corner[3u * triangle]);
  vec3 ab = position_of(corner[3u * triangle + 1u]) - a;
  vec3 ac = position_of(corner[3u * triangle + 2u]) - a;
  vec3 from_a = eye.xyz - a;
  vec3 p = cross(d, ac);
  vec3 q = cross(from_a, ab);
  float determinant = dot(p, ab);
  return determinant != 0.0 ? vec3(dot(p, from_a), dot(q, d), dot(q, ac)) / determinant : vec3(-1.0);
}

bool in_triangle(vec3 at) {
  const float at_an_edge = -1e-4;  // of a side: neighbours leave no gap between them
  return min(min(at.x, at.y), 1.0 - at.x - at.y) >= at_an_edge && at.z > 0.0;
}

vec4 point_of(uint triangle, vec3 at) {
  vec3 n = (1.0 - at.x - at.y) * normal_of(corner[3u * triangle]) + at.x * normal_of(corner[3u * triangle + 1u]) +
           at.y * normal_of(corner[3u * triangle + 2u]);
  return vec4(normalize(n), at.z);
}

uint drawn_at(ivec2 texel) {
  return texelFetch(triangles, clamp(texel, ivec2(0), textureSize(triangles, 0) - 1), 0).x;
}

// Of the triangles that were drawn at the four nearest texels the first that the ray meets: rays of a camera that
// distorts pass between the texels. Triangles may be smaller than those; where none is met, the one that was drawn
// nearest by counts at its nearest point, roughly: barycentric coordinates are clamped.
vec4 meet(vec2 ray, vec3 d) {
  vec2 position = raster.xy * ray + raster.zw;
  ivec2 texel = ivec2(floor(position));
  ivec2 beside = ivec2(sign(position - vec2(texel) - 0.5));
  vec4 first = vec4(0.0, 0.0, 0.0, far);
  for (int i = 0; i < 4; ++i) {
    uint drawn = drawn_at(texel + beside * ivec2(i & 1, i >> 1));
    if (drawn == 0u) continue;
    vec3 at = meet_plane(drawn - 1u, d);
    if (in_triangle(at) && at.z < first.w) first = point_of(drawn - 1u, at);
  }
  if (first.w < far) return first;
  uint drawn = drawn_at(texel);
  if (drawn == 0u) return vec4(0.0);
  vec3 at = meet_plane(drawn - 1u, d);
  at.x = clamp(at.x, 0.0, 1.0);
  at.y = clamp(at.y, 0.0, 1.0 - at.x);
  vec3 a = position_of(corner[3u * (drawn - 1u)]);
  vec3 x = a + at.x * (position_of(corner[3u * (drawn - 1u) + 1u]) - a) +
           at.y * (position_of(corner[3u * (drawn - 1u) + 2u]) - a);
  return point_of(drawn - 1u, vec3(at.xy, dot(axes[2].xyz, x - eye.xyz)));
}
