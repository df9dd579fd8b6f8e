// A batch of parallel lights. Mirrors LightBlock in host/render/irradiance_gl.cpp.
const int max_lights = 32;

struct Light {
  vec4 direction;        // xyz: unit, towards the light; w: solid angle in steradians
  vec4 shadow_u;         // shadow map coordinate u = dot(xyz, x) + w, 0 to 1 over the mesh
  vec4 shadow_v;         // likewise v
  vec4 shadow_depth;     // likewise depth, 0 nearest to the light, 1 farthest
  vec4 image;            // x: layer of the tile, y: size of a shadow map's texel in metres
  vec4 plane;            // the tile's rectangle: min x, max y, 1 / width, 1 / height
};

layout(std140) uniform LightBlock {
  Light lights[max_lights];
  ivec4 count;           // x: lights in this batch
};
