// The photos, and how each answers for a ray of the new view: what answer() of host/lumigraph/ray_answers.h computes
// for bundles of rays. Mirrors GlslPhoto, GlslSpeaker and GlslBlend in host/lumigraph/lumigraph_gl.cpp.
//
// The program's text sets photo_pages and sight_pages: how many textures hold the photos and their sights.
struct Photo {
  vec4 focal;       // fx, fy, cx, cy
  vec4 distortion;  // k1 k2 p1 p2
  vec4 lens;        // k3, largest r^2, width, height
  vec4 limits;      // of the picture in normalized coordinates: left, top, right, bottom
  vec4 sight;       // texels a pixel, inverse depth of code 1, last column, last row
  ivec4 sight_at;   // column, row, layer, page; page -1: it shows whatever lies in its picture
  ivec4 levels;     // of its pyramid: the first, how many
  vec4 colour;      // in the blending field, 0 to 1
};
struct Speaker {
  vec4 row_x;        // xyz: a row of cam_from_world's rotation, w: E in the photo's frame
  vec4 row_y;
  vec4 row_z;
  vec4 from_centre;  // xyz: E - C, world, w: time penalty
  float per_border_px;
  int photo;
};
layout(std430, binding = 3) readonly buffer Photos {
  Photo photos[];
};
layout(std430, binding = 4) readonly buffer Speakers {
  Speaker speakers[];
};
layout(std140, binding = 1) uniform BlendBlock {
  vec4 penalty;       // alpha, beta, gamma, depth tolerance
  vec4 wanted;        // focal2, beyond, floor of the weights
  ivec4 count;        // x: speakers
};

layout(binding = 10) uniform sampler2DArray sights[sight_pages];  // r: trust, g: inverse depth, 1 at Photo.sight.y

const float infinite = 3e38;         // the text of a shader has no infinity
const float nearest_depth = 1e-3;    // of the depth in the new view: nearer points are not in a photo's picture
const float edge_on_cosine = 0.05;   // see ray_answers.h
const float fetch_octaves = 0.7925;  // see ray_answers.cpp
const float least_sight = 2e-5;      // see source_sight.h

// A ray of the new view and the proxy's point on it.
struct Ray {
  vec3 d;        // world, 1 along the optical axis
  vec3 x;        // X - E
  vec3 normal;
  float depth;
};

struct Answer {
  vec2 at;        // photo pixels
  float lod;      // of the photo's pyramid
  float weight;   // 0 to 1, 0: it says nothing
  float penalty;  // infinite where it says nothing
};

// As approximate_log2 of host/blending/ray_penalty.h.
float approximate_log2(float value) {
  int bits = floatBitsToInt(value);
  float m = intBitsToFloat((bits & 0x007FFFFF) | 0x3F800000) - 1.0;
  return float((bits >> 23) - 127) +
         m * (1.4419170 + m * (-0.7090964 + m * (0.4156059 + m * (-0.1935755 + m * 0.0451490))));
}

vec2 distorted(Photo photo, vec2 x) {
  vec4 d = photo.distortion;
  float r2 = dot(x, x);
  float radial = 1.0 + r2 * (d.x + r2 * (d.y + r2 * photo.lens.x));
  return x * radial + 2.0 * d.zw * x.x * x.y + d.wz * (r2 + 2.0 * x * x);
}

float divided_by_weight(float plain, float weight) {
  if (!(weight > 0.0)) return infinite;
  return plain / (penalty.z == 0.5 ? sqrt(max(weight, 1e-20)) : pow(weight, penalty.z));
}

// What the photo sees of a point at this inverse depth, between four texels.
float look(Photo photo, vec2 at, float inverse_depth) {
  vec2 texel = clamp(at * photo.sight.x - 0.5, vec2(0.0), photo.sight.zw);
  vec2 between = texel - floor(texel);
  vec4 codes[2] = vec4[2](vec4(0.0), vec4(0.0));  // trust, inverse depth, of the four
  for (int page = 0; page < sight_pages; ++page) {
    if (page != photo.sight_at.w) continue;
    vec3 corner = vec3((vec2(photo.sight_at.xy) + floor(texel) + 1.0) / vec2(textureSize(sights[page], 0).xy),
                       float(photo.sight_at.z));
    codes[0] = textureGather(sights[page], corner, 0);
    codes[1] = textureGather(sights[page], corner, 1);
  }
  // A gather begins below left and goes round: (0, 1), (1, 1), (1, 0), (0, 0).
  vec2 top = vec2(mix(codes[0].w, codes[0].z, between.x), mix(codes[1].w, codes[1].z, between.x));
  vec2 bottom = vec2(mix(codes[0].x, codes[0].y, between.x), mix(codes[1].x, codes[1].y, between.x));
  vec2 trust_and_depth = mix(top, bottom, between.y);
  if (!(trust_and_depth.x > 0.0)) return 0.0;
  float behind = photo.sight.y * trust_and_depth.y / inverse_depth - 1.0;
  float sees = smoothstep(0.0, 1.0, trust_and_depth.x) * (1.0 - smoothstep(0.0, 1.0, behind / penalty.w - 1.0));
  return max(least_sight, sees);
}

// A penalty of `worst` or more may be less than the true one: what the photo sees is not looked up then.
Answer answer(Speaker speaker, Ray ray, float worst) {
  Photo photo = photos[speaker.photo];
  vec3 x_in_photo = vec3(dot(speaker.row_x.xyz, ray.x) + speaker.row_x.w, dot(speaker.row_y.xyz, ray.x) + speaker.row_y.w,
                         dot(speaker.row_z.xyz, ray.x) + speaker.row_z.w);
  bool before = x_in_photo.z > nearest_depth * ray.depth;
  float inverse_depth = 1.0 / (before ? x_in_photo.z : 1.0);
  vec2 normalized = x_in_photo.xy * inverse_depth;
  vec2 at = photo.focal.xy * distorted(photo, normalized) + photo.focal.zw;

  vec3 from_centre = ray.x + speaker.from_centre.xyz;
  float per_view = 1.0 / sqrt(dot(from_centre, from_centre));
  float per_ray = 1.0 / sqrt(dot(ray.d, ray.d));
  float chord = length(from_centre * per_view - ray.d * per_ray);

  float cos_view = max(abs(dot(ray.normal, from_centre)) * per_view, edge_on_cosine);
  float cos_ray = max(abs(dot(ray.normal, ray.d)) * per_ray, edge_on_cosine);
  float area_ratio = wanted.x / (photo.focal.x * photo.focal.y) *
                     (cos_ray * per_view * x_in_photo.z * x_in_photo.z * x_in_photo.z) /
                     (per_ray * cos_view * ray.depth * ray.depth);
  float octaves = 0.5 * approximate_log2(before ? area_ratio : 1.0);

  vec2 inside = min(at, photo.lens.zw - at) * speaker.per_border_px;
  float border = smoothstep(0.0, 1.0, inside.x) * smoothstep(0.0, 1.0, inside.y);

  Answer a;
  a.at = at;
  a.lod = max(-octaves - wanted.y - fetch_octaves, 0.0);
  a.weight = before && dot(normalized, normalized) < photo.lens.y ? border * border : 0.0;
  float plain = penalty.x * chord + penalty.y * max(octaves, 0.0) + speaker.from_centre.w;
  a.penalty = divided_by_weight(plain, a.weight);
  if (photo.sight_at.w < 0 || !(a.penalty < worst)) return a;
  a.weight *= look(photo, at, inverse_depth);
  a.penalty = divided_by_weight(plain, a.weight);
  return a;
}
