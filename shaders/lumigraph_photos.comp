#version 430 core
#include "common_lumigraph.glsl"

// A level's place: (column | row << 16, width | height << 16, layer, page).
layout(std430, binding = 5) readonly buffer Levels {
  uvec4 levels[];
};
layout(binding = 2) uniform sampler2DArray pages[photo_pages];

// Bilinear in one level, its border repeated. Position: 0 to 1 over the photo.
vec3 fetch(int level, vec2 position) {
  uvec4 at = levels[level];
  vec2 extent = vec2(at.y & 0xFFFFu, at.y >> 16);
  vec2 texel = vec2(at.x & 0xFFFFu, at.x >> 16) + clamp(position * extent, vec2(0.5), extent - 0.5);
  for (int page = 0; page < photo_pages; ++page)
    if (page == int(at.w))
      return textureLod(pages[page], vec3(texel / vec2(textureSize(pages[page], 0).xy), float(at.z)), 0.0).rgb;
  return vec3(0.0);
}

vec3 shown(Photo photo, Answer a) {
  vec2 position = a.at / photo.lens.zw;
  int last = photo.levels.y - 1;
  int below = min(int(a.lod), last);
  vec3 fine = fetch(photo.levels.x + below, position);
  float between = a.lod - float(below);
  if (between <= 0.0 || below == last) return fine;
  return mix(fine, fetch(photo.levels.x + below + 1, position), between);
}
