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

// Share of the light that reaches the point: 2 x 2 comparisons, weighted. The point is moved off its surface by the size
// of a texel, more where light grazes, so that the surface doesn't shade itself.
float visibility(int i, Point point) {
  float slope = 1.0 - abs(dot(point.geometric_normal, lights[i].direction.xyz));
  vec3 x = point.x + point.geometric_normal * lights[i].image.y * (0.5 + slope);
  vec2 map = vec2(dot(lights[i].shadow_u.xyz, x) + lights[i].shadow_u.w,
                  dot(lights[i].shadow_v.xyz, x) + lights[i].shadow_v.w);
  float depth = dot(lights[i].shadow_depth.xyz, x) + lights[i].shadow_depth.w;
  return texture(shadow_maps, vec4(map, float(i), clamp(depth, 0.0, 1.0)));
}

// Radiance at p = x - w x_z / w_z, where the line along the direction crosses the plane: the skewed projective texture.
vec3 radiance(int i, Point point) {
  vec3 w = lights[i].direction.xyz;
  vec2 p = point.x.xy - w.xy * (point.x.z / w.z);
  vec4 plane = lights[i].plane;
  vec2 at = vec2((p.x - plane.x) * plane.z, (plane.y - p.y) * plane.w);
  return texture(tiles, vec3(at, lights[i].image.x)).rgb;
}
