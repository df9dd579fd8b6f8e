#version 430 core
#include "common_surface.glsl"

layout(location = 0) uniform vec4 plane;  // xyz: normal; w: how far the plane lies from the eye along it

vec4 meet(vec2 ray, vec3 d) {
  float along = dot(plane.xyz, d);
  return vec4(plane.xyz, along != 0.0 ? plane.w / along : 0.0);
}
