// A group of 8 x 8 pixels tells which photos could be among the k + 1 best of any; each pixel ranks those and blends its
// k best: Buehler et al. 2001, 4.1, with the weights of
// host/blending/view_weights.h. The program's text sets k.
#include "common_view.glsl"
#include "common_photos.glsl"
#include "common_bounds.glsl"

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

shared uint worst_bits;  // of the group's (k + 1)-th least penalties so far: floats above 0 are in their bits' order
shared float bounds[group];
shared uint near[2];     // a bit for each of the photos that the group looks at: bound below that

// A ray that misses the proxy needs nothing: its worst is 0.
void rank_all(uint lane, bool meets, Ray ray, Ball ball) {
  for (int first = 0; first < count.x; first += group) {
    if (lane == 0u) {
      worst_bits = 0u;
      near[0] = near[1] = 0u;
    }
    barrier();
    atomicMax(worst_bits, meets ? floatBitsToUint(least_penalty[k]) : 0u);
    barrier();
    int mine = first + int(lane);
    bounds[lane] = mine < count.x ? bound(speakers[mine], ball) : infinite;
    if (bounds[lane] < uintBitsToFloat(worst_bits)) atomicOr(near[lane / 32u], 1u << (lane % 32u));
    barrier();
    if (meets)
      for (int word = 0; word < 2; ++word)
        for (uint left = near[word]; left != 0u; left &= left - 1u) {
          int at = 32 * word + findLSB(left);
          if (bounds[at] < least_penalty[k]) rank(first + at, ray);
        }
    barrier();
  }
}

void main() {
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  bool in_picture = all(lessThan(pixel, size.xy));
  vec4 met = in_picture ? texelFetch(surface, pixel, 0) : vec4(0.0);
  bool meets = met.w > 0.0;
  vec3 d = meets ? in_world(texelFetch(rays, pixel, 0).xy) : vec3(0.0);
  Ray ray = Ray(d, met.w * d, met.xyz, met.w);
  clear_ranking();
  Ball ball = ball_of_group(gl_LocalInvocationIndex, meets, ray);
  if (ball.radius >= 0.0) rank_all(gl_LocalInvocationIndex, meets, ray, ball);
  if (in_picture) imageStore(picture, pixel, meets ? blend(ray) : vec4(0.0));
}
