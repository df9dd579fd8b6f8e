#version 430 core
#include "common_view.glsl"
#include "common_mesh.glsl"

layout(location = 1) uniform float nearest;
layout(location = 2) uniform vec3 inside;  // a point that the walls stand about, world
layout(location = 0) out uint triangle;

// A crossing towards the inside is looked through: one of a triangle that parts the eye from that point.
void main() {
  uint first = 3u * uint(gl_PrimitiveID);
  vec3 a = position_of(corner[first]);
  vec3 n = cross(position_of(corner[first + 1u]) - a, position_of(corner[first + 2u]) - a);
  if (dot(n, a - eye.xyz) * dot(n, a - inside) < 0.0) discard;
  triangle = uint(gl_PrimitiveID) + 1u;
  gl_FragDepth = nearest * gl_FragCoord.w;
}
