// What no ray of a group undercuts: least_penalties() of host/lumigraph/view_bounds.h, a ball about the group's points.
// The weight counts as 1.
const float log_slip = 1e-4;  // octaves: above the approximation of the logarithm
const float rounding = 1e-6;  // of the distance: what single precision loses of penalties, several times

struct Ball {
  vec3 centre;  // relative to E
  float radius;
  vec3 normal;  // the mean, on the eye's side
  float spread;
  float least_cosine;  // of the angle between ray and normal
  float area;          // px^2 of the new view that a patch of 1 m^2 covers, at least: across the ray,
  float area_of_proxy; // and of the proxy
};

const int group = 64;
shared vec4 least[4][group];

// Afterwards the first holds the least of all.
void reduce(uint lane) {
  for (uint reach = uint(group) / 2u; reach > 0u; reach /= 2u) {
    barrier();
    if (lane < reach)
      for (int i = 0; i < 4; ++i) least[i][lane] = min(least[i][lane], least[i][lane + reach]);
  }
  barrier();
}

// Of the group's rays that meet the proxy. None: a radius below 0.
Ball ball_of_group(uint lane, bool meets, Ray ray) {
  for (int i = 0; i < 4; ++i) least[i][lane] = vec4(infinite);
  if (meets) {
    float along = dot(ray.d, ray.normal);
    vec3 towards_eye = along > 0.0 ? -ray.normal : ray.normal;
    float per_ray = 1.0 / length(ray.d);
    float cosine = max(abs(along) * per_ray, edge_on_cosine);
    float area = wanted.x / (per_ray * ray.depth * ray.depth);
    least[0][lane] = vec4(ray.x, cosine);
    least[1][lane] = vec4(-ray.x, area);
    least[2][lane] = vec4(towards_eye, cosine * area);
    least[3][lane] = vec4(-towards_eye, 0.0);
  }
  reduce(lane);
  vec3 low = least[0][0].xyz;
  vec3 high = -least[1][0].xyz;
  if (low.x > high.x) return Ball(vec3(0.0), -1.0, vec3(0.0), 0.0, 0.0, 0.0, 0.0);
  vec3 low_normal = least[2][0].xyz;
  vec3 high_normal = -least[3][0].xyz;
  float radius = 0.5 * length(high - low) + rounding * length(max(abs(low), abs(high)));
  return Ball(0.5 * (low + high), radius, 0.5 * (low_normal + high_normal), 0.5 * length(high_normal - low_normal),
              least[0][0].w, least[1][0].w, least[2][0].w);
}

// How far x lies beyond the nearest side of the photo's picture, metres; x in the photo's frame.
float beyond_picture(vec4 limits, vec3 x) {
  vec2 per_length = inversesqrt(1.0 + limits.zw * limits.zw);
  vec2 per_length_low = inversesqrt(1.0 + limits.xy * limits.xy);
  vec2 high = (x.xy - limits.zw * x.z) * per_length;
  vec2 low = (limits.xy * x.z - x.xy) * per_length_low;
  return max(max(high.x, high.y), max(low.x, low.y));
}

float bound(Speaker speaker, Ball b) {
  Photo photo = photos[speaker.photo];
  vec3 x_in_photo = vec3(dot(speaker.row_x.xyz, b.centre) + speaker.row_x.w,
                         dot(speaker.row_y.xyz, b.centre) + speaker.row_y.w,
                         dot(speaker.row_z.xyz, b.centre) + speaker.row_z.w);
  if (x_in_photo.z < -b.radius || beyond_picture(photo.limits, x_in_photo) > b.radius) return infinite;

  vec3 from_centre = b.centre + speaker.from_centre.xyz;
  float to_view = length(from_centre);
  float to_eye = length(b.centre);
  float nearest_view = to_view - b.radius;
  float nearest_eye = to_eye - b.radius;
  if (!(nearest_view > 0.0 && nearest_eye > 0.0)) return speaker.from_centre.w;
  float chord = length(from_centre / to_view - b.centre / to_eye);
  float nearer = min(nearest_view, nearest_eye);
  float farther = max(nearest_view, nearest_eye);
  float largest_chord = min(2.0, chord + 2.0 * b.radius / nearer);
  float rate = (abs(to_view - to_eye) + b.radius * largest_chord) / (nearer * farther) + largest_chord / farther;
  float least_chord = max(0.0, chord - b.radius * rate);

  float octaves = 0.0;
  float nearest_z = x_in_photo.z - b.radius;
  if (nearest_z > 0.0) {
    float cosines = 1.0 + (chord + b.radius * rate) / b.least_cosine;
    float cosine = max(abs(dot(from_centre, b.normal)) / to_view + b.spread + b.radius / nearest_view, edge_on_cosine);
    float area = max(b.area / cosines, b.area_of_proxy / cosine);
    float ratio = area * nearest_z * nearest_z * nearest_z /
                  (photo.focal.x * photo.focal.y * (to_view + b.radius));
    octaves = 0.5 * approximate_log2(max(ratio, 1e-30)) - log_slip;
  }
  return penalty.x * least_chord + penalty.y * max(octaves, 0.0) + speaker.from_centre.w;
}
