// Each pixel ranks the photos and blends the k best: Buehler et al. 2001, 4.1, with the weights of
// host/blending/view_weights.h. The program's text sets k.
#include "common_view.glsl"
#include "common_photos.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 1) uniform sampler2D surface;  // see common_surface.glsl
layout(binding = 0) uniform writeonly image2D picture;  // rgb, and how it is covered

const float ray_weight_tie = 1e-6;  // see view_weights.h
const float least_seen = 0.02;      // see lumigraph.cpp
const float guessed = 127.0 / 255.0;

// What the photo puts into the picture.
vec3 shown(Photo photo, Answer a);

float least_penalty[k + 1];  // in rising order
int who[k + 1];              // speakers

void clear_ranking() {
  for (int row = 0; row <= k; ++row) {
    least_penalty[row] = infinite;
    who[row] = -1;
  }
}

void insert(float penalty, int speaker) {
  for (int row = 0; row <= k; ++row) {
    if (!(penalty < least_penalty[row])) continue;
    float held = least_penalty[row];
    int holder = who[row];
    least_penalty[row] = penalty;
    who[row] = speaker;
    penalty = held;
    speaker = holder;
  }
}

void rank(int speaker, Ray ray) {
  float worst = least_penalty[k];
  Answer a = answer(speakers[speaker], ray, worst);
  if (a.penalty < worst) insert(a.penalty, speaker);
}

vec4 blend(Ray ray) {
  vec3 sum = vec3(0.0);
  float total = 0.0;
  float sight = 0.0;
  for (int row = 0; row < k; ++row) {
    if (who[row] < 0) break;
    float fading = 1.0 - (least_penalty[row] + wanted.z) / (least_penalty[k] + wanted.z);
    float weight = (max(fading, 0.0) + ray_weight_tie) / (least_penalty[row] + wanted.z);
    Speaker speaker = speakers[who[row]];
    Answer a = answer(speaker, ray, infinite);
    sum += weight * shown(photos[speaker.photo], a);
    total += weight;
    sight = max(sight, a.weight);
  }
  if (!(total > 0.0)) return vec4(0.0);
  return vec4(sum / total, sight > least_seen ? 1.0 : guessed);
}

void main() {
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, size.xy))) return;
  vec4 met = texelFetch(surface, pixel, 0);
  vec4 colour = vec4(0.0);
  if (met.w > 0.0) {
    vec3 d = in_world(texelFetch(rays, pixel, 0).xy);
    Ray ray = Ray(d, met.w * d, met.xyz, met.w);
    clear_ranking();
    for (int i = 0; i < count.x; ++i) rank(i, ray);
    colour = blend(ray);
  }
  imageStore(picture, pixel, colour);
}
