#version 430 core
#include "common_accumulate.glsl"

layout(location = 0) out vec4 irradiance;

// What the mesh keeps from the points.
void main() {
  Point point = fetch_point();
  vec3 sum = vec3(0.0);
  for (int i = 0; i < count.x; ++i) {
    float cosine = dot(point.normal, lights[i].direction.xyz);
    if (cosine <= 0.0) continue;
    float blocked = 1.0 - visibility(i, point);
    if (blocked > 0.0) sum += cosine * lights[i].direction.w * blocked * radiance(i, point);
  }
  irradiance = vec4(sum, 0.0);
}
