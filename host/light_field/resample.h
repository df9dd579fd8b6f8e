// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/progress.h"
#include "host/light_field/field_views.h"
#include "host/light_field/light_field.h"

namespace mf {

struct ResampleOptions {
  double height_m = 0;    // of the light-field plane above the world's z = 0; the plane is parallel to the ground
  int directions = 2500;  // about how many, over the hemisphere; ≥ 11
  int size = 128;         // texels along each side of the rectangle; 2 to 1024
  std::string proxy =
      "auto";  // auto: a sphere whose radius photo-consistency chooses; plane; sphere:R (metres); sphere:inf
  int k = 0;   // views blended for a ray; 0: 15 for the plane (the paper's), 6 else; 1 to 64
  std::optional<std::array<double, 4>> rectangle;  // x0 y0 x1 y1 in world metres; else from the mirror's openings

  // What is wrong, in words that name the field; nothing when all is well.
  [[nodiscard]] std::optional<std::string> validate() const;
};

// One try of the proxy search.
struct ProxyScore {
  FieldProxy proxy;
  double inconsistency = 0;  // mean robust spread of log2 radiance among the views that answer for one ray, stops
};

struct ResampleResult {
  LightField field;
  std::vector<ProxyScore> proxy_scores;   // empty when the proxy was given
  std::map<std::string, double> seconds;  // by stage
  std::size_t views = 0;
  double mean_confidence = 0;  // cosine-weighted over directions, mean over the plane
};

// The views resampled into L(p, ω) on a plane parallel to the ground (Ihrke et al. 2008, §4.3), each ray blended from
// the k best views (Buehler et al. 2001, §4.1), seen over the proxy: see docs/light_field.md.
// `views` see the world frame; `rectangle` is the plane's part to cover.
[[nodiscard]] ResampleResult resample(const std::vector<FieldView>& views, const PlaneRectangle& rectangle,
                                      const ResampleOptions&, const Progress&);

// Sphere radii tried against each other: for rays through the rectangle, how well do the k best views agree on what
// they see at the proxy? Sorted by radius. Every radius is larger than the rectangle's half diagonal.
[[nodiscard]] std::vector<ProxyScore> score_proxies(const std::vector<FieldView>& views,
                                                    const PlaneRectangle& rectangle, int k);

// The rectangle of the plane z = height (world) that the mirrors' openings cover: the box around all points that at
// least a tenth as many views pass as the best-covered point. Nothing when no view's rays come down to the plane.
[[nodiscard]] std::optional<PlaneRectangle> covered_rectangle(const Calibration&, const MirrorTarget&, double height_m);

}  // namespace mf
