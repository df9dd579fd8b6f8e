#version 430 core
#include "common_accumulate.glsl"

layout(location = 0) out vec4 irradiance;

// What the mesh keeps from the points.
void main() {
  Point point = fetch_point();
  vec3 sum = vec3(0.0);
  for (int i = 0; i < count.x; ++i) {
    vec3 w = direction_to(i, point);
    float cosine = dot(point.normal, w);
    if (cosine <= 0.0) continue;
    float blocked = 1.0 - visibility(i, point, w);
    if (blocked > 0.0) sum += cosine * solid_angle(i, point, w) * blocked * radiance(i, point, w);
  }
  irradiance = vec4(sum, 0.0);
}
