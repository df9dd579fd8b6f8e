// What both ways of summing share. The G-buffer is a list of points, laid out in rows.
#include "common_lights.glsl"

layout(binding = 0) uniform sampler2D positions;
layout(binding = 1) uniform sampler2D normals;
layout(binding = 2) uniform sampler2D geometric_normals;
layout(binding = 3) uniform sampler2DArrayShadow shadow_maps;
layout(binding = 4) uniform sampler2DArray tiles;

struct Point {
  vec3 x;
  vec3 normal;
  vec3 geometric_normal;
};

Point fetch_point() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  return Point(texelFetch(positions, at, 0).xyz, texelFetch(normals, at, 0).xyz,
               texelFetch(geometric_normals, at, 0).xyz);
}

// Unit direction from the point towards the light.
vec3 direction_to(int i, Point point) {
  return normalize(lights[i].place.xyz - lights[i].place.w * point.x);
}

// Under which the point sees the light. Of an emitter's ball 2 pi (1 - cos), without the difference of nearly equal
// numbers; nothing of one that lies no higher than the point.
float solid_angle(int i, Point point, vec3 w) {
  if (lights[i].place.w == 0.0) return lights[i].strength.x;
  if (w.z <= 1e-3) return 0.0;
  float sine = min(1.0, lights[i].emitter.w / max(distance(lights[i].emitter.xyz, point.x), 1e-12));
  return lights[i].strength.x * 6.283185307 * sine * sine / (1.0 + sqrt(1.0 - sine * sine));
}

// Share of the light that reaches the point: 2 x 2 comparisons, weighted. The point is moved off its surface by the size
// of a texel, more where light grazes, so that the surface doesn't shade itself. What lies behind a light has no shadow.
float visibility(int i, Point point, vec3 w) {
  float slope = 1.0 - abs(dot(point.geometric_normal, w));
  vec4 x = vec4(point.x + point.geometric_normal * lights[i].image.y * (0.5 + slope), 1.0);
  float ahead = dot(lights[i].shadow_w, x);
  if (ahead <= 0.0) return 1.0;
  vec3 map = vec3(dot(lights[i].shadow_u, x), dot(lights[i].shadow_v, x), dot(lights[i].shadow_depth, x)) / ahead;
  return texture(shadow_maps, vec4(map.xy, float(i), clamp(map.z, 0.0, 1.0)));
}

// Radiance at p = x - w x_z / w_z, where the line along the direction crosses the plane: the skewed projective texture.
vec3 radiance(int i, Point point, vec3 w) {
  vec2 p = point.x.xy - w.xy * (point.x.z / w.z);
  vec4 plane = lights[i].plane;
  vec2 at = vec2((p.x - plane.x) * plane.z, (plane.y - p.y) * plane.w);
  return texture(tiles, vec3(at, lights[i].image.x)).rgb;
}
