#version 430 core
layout(location = 1) uniform float nearest;
layout(location = 0) out uint triangle;  // its number and 1

// Inverse depth, so that single precision is as fine far away as it is near.
void main() {
  triangle = uint(gl_PrimitiveID) + 1u;
  gl_FragDepth = nearest * gl_FragCoord.w;
}
