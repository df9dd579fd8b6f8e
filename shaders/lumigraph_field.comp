#version 430 core
#include "common_lumigraph.glsl"

// Which photo speaks for what: figure 6 of the paper.
vec3 shown(Photo photo, Answer a) {
  return photo.colour.rgb;
}
