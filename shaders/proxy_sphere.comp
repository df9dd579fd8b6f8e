#version 430 core
#include "common_surface.glsl"

layout(location = 0) uniform vec4 sphere;  // xyz: the eye from the centre; w: radius

// The far root of |o + t d|^2 = r^2: from outside the near wall is looked through.
vec4 meet(vec2 ray, vec3 d) {
  vec3 o = sphere.xyz;
  float a = dot(d, d);
  float b = dot(o, d);
  float discriminant = b * b - a * (dot(o, o) - sphere.w * sphere.w);
  if (discriminant < 0.0) return vec4(0.0);
  float t = (-b + sqrt(discriminant)) / a;
  return vec4((o + t * d) / sphere.w, t);
}
