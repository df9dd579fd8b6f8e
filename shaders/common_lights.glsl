// A batch of lights, far off or points of an emitter. Mirrors LightBlock in host/render/irradiance_gl.cpp.
const int max_lights = 32;

struct Light {
  vec4 place;            // far off: unit direction towards the light, and 0; a point of an emitter: where, and 1
  vec4 emitter;          // a point of an emitter: the emitter's centre and radius
  vec4 strength;         // x: far off the solid angle in steradians, else the point's share of the emitter's
  vec4 shadow_u;         // shadow map coordinate u = dot(this, (x, 1)) / dot(shadow_w, (x, 1)), 0 to 1 over the mesh
  vec4 shadow_v;         // likewise v
  vec4 shadow_depth;     // likewise depth, 0 nearest to the light, 1 farthest
  vec4 shadow_w;         // far off: 0, 0, 0, 1
  vec4 image;            // x: layer of the tile, y: size of a shadow map's texel in metres
  vec4 plane;            // the tile's rectangle: min x, max y, 1 / width, 1 / height
};

layout(std140) uniform LightBlock {
  Light lights[max_lights];
  ivec4 count;           // x: lights in this batch
};
