// The new view. Mirrors ViewBlock in host/lumigraph/proxy_surface_gl.cpp.
layout(std140, binding = 0) uniform ViewBlock {
  vec4 axes[3];  // xyz: the camera's x, y and z in the world
  vec4 eye;      // xyz: E, world
  ivec4 size;    // x, y: pixels
};

// x and y of each pixel's ray in the camera, whose z is 1; no_ray and more where the camera has none.
layout(binding = 0) uniform sampler2D rays;
const float no_ray = 1e30;

vec3 in_world(vec2 ray) {
  return axes[0].xyz * ray.x + axes[1].xyz * ray.y + axes[2].xyz;
}
