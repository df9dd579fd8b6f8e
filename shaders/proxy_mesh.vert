#version 430 core
#include "common_view.glsl"

layout(location = 0) in vec3 x_in_world;
layout(location = 0) uniform vec4 raster;  // fx, fy, cx, cy of the pinhole that triangles are drawn with, as shares of
                                           // its width or height
layout(location = 1) uniform float nearest;  // metres: what is nearer to the eye's plane is not drawn

// Row 0 of the target is the picture's first: no flip. Depth is the fragment shader's; z only clips.
void main() {
  vec3 from_eye = x_in_world - eye.xyz;
  vec3 x = vec3(dot(axes[0].xyz, from_eye), dot(axes[1].xyz, from_eye), dot(axes[2].xyz, from_eye));
  vec2 at = 2.0 * (raster.xy * x.xy + raster.zw * x.z) - x.z;
  gl_Position = vec4(at, x.z - 2.0 * nearest, x.z);
}
