// Where each pixel's ray meets the proxy: xyz the normal there, unit length, w the distance in lengths of a ray whose z
// is 1 in the camera, which is the depth; all 0 where the ray misses. The reference is trace() of
// host/lumigraph/proxy_rays.h.
#include "common_view.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0) uniform writeonly image2D surface;

const float far = 1e29;  // no proxy is there: beyond any scene

// The proxy's; w <= 0 or far and more: missed. d is the ray in the world.
vec4 meet(vec2 ray, vec3 d);

void main() {
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, size.xy))) return;
  vec2 ray = texelFetch(rays, pixel, 0).xy;
  vec4 met = vec4(0.0);
  if (ray.x < no_ray) met = meet(ray, in_world(ray));
  imageStore(surface, pixel, met.w > 0.0 && met.w < far ? met : vec4(0.0));
}
