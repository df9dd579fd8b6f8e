#version 430 core
#extension GL_ARB_shader_viewport_layer_array : enable
#extension GL_AMD_vertex_shader_layer : enable
#include "common_lights.glsl"

layout(location = 0) in vec3 x_in_plane;

// One instance a light, one layer an instance.
void main() {
  Light light = lights[gl_InstanceID];
  vec3 map = vec3(dot(light.shadow_u.xyz, x_in_plane) + light.shadow_u.w,
                  dot(light.shadow_v.xyz, x_in_plane) + light.shadow_v.w,
                  dot(light.shadow_depth.xyz, x_in_plane) + light.shadow_depth.w);
  gl_Position = vec4(2.0 * map - 1.0, 1.0);
  gl_Layer = gl_InstanceID;
}
