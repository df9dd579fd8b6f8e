// The proxy's triangles, world. Three numbers a vertex or a triangle.
layout(std430, binding = 0) readonly buffer Positions {
  float position[];
};
layout(std430, binding = 1) readonly buffer Normals {
  float normal[];
};
layout(std430, binding = 2) readonly buffer Triangles {
  uint corner[];
};

vec3 position_of(uint vertex) {
  return vec3(position[3u * vertex], position[3u * vertex + 1u], position[3u * vertex + 2u]);
}
vec3 normal_of(uint vertex) {
  return vec3(normal[3u * vertex], normal[3u * vertex + 1u], normal[3u * vertex + 2u]);
}
