#version 430 core
#include "common_surface.glsl"

layout(location = 0) uniform mat3 box_from_world;  // rotation
layout(location = 3) uniform vec3 low;             // the walls from the eye, in the box' axes; absent ones at 1e30
layout(location = 4) uniform vec3 high;

// Where the ray leaves the slabs that it is in last: the far wall.
vec4 meet(vec2 ray, vec3 world_d) {
  vec3 d = box_from_world * world_d;
  float enter = 0.0;
  float leave = 1e30;
  int wall = 2;
  for (int axis = 0; axis < 3; ++axis) {
    if (d[axis] == 0.0) continue;
    float a = low[axis] / d[axis];
    float b = high[axis] / d[axis];
    enter = max(enter, min(a, b));
    if (max(a, b) < leave) {
      leave = max(a, b);
      wall = axis;
    }
  }
  vec3 normal = vec3(box_from_world[0][wall], box_from_world[1][wall], box_from_world[2][wall]);
  return vec4(normal, leave > enter ? leave : 0.0);
}
