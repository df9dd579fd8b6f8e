#version 430 core
#extension GL_ARB_shader_viewport_layer_array : enable
#extension GL_AMD_vertex_shader_layer : enable
#include "common_lights.glsl"

layout(location = 0) in vec3 x_in_plane;

// One instance a light, one layer an instance.
void main() {
  Light light = lights[gl_InstanceID];
  vec4 x = vec4(x_in_plane, 1.0);
  vec3 map = vec3(dot(light.shadow_u, x), dot(light.shadow_v, x), dot(light.shadow_depth, x));
  float w = dot(light.shadow_w, x);
  gl_Position = vec4(2.0 * map - w, w);
  gl_Layer = gl_InstanceID;
}
