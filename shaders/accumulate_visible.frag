#version 430 core
#include "common_accumulate.glsl"

layout(location = 0) out vec4 irradiance;

// Adds a whole batch in single precision; blending adds it to the batches before.
void main() {
  Point point = fetch_point();
  vec3 sum = vec3(0.0);
  for (int i = 0; i < count.x; ++i) {
    vec3 w = direction_to(i, point);
    float cosine = dot(point.normal, w);
    if (cosine > 0.0 && dot(point.geometric_normal, w) > 0.0)
      sum += cosine * solid_angle(i, point, w) * visibility(i, point, w) * radiance(i, point, w);
  }
  irradiance = vec4(sum, 0.0);
}
