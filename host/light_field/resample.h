// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/progress.h"
#include "host/light_field/field_views.h"
#include "host/light_field/light_field.h"
#include "host/light_field/provenance.h"
#include "host/light_field/surroundings_search.h"
#include "host/team/team.h"

namespace mf {

struct ResampleOptions {
  double height_m = 0;    // of the light-field plane above the world's z = 0; the plane is parallel to the ground
  int directions = 2476;  // at least so many over the hemisphere (DirectionSet); 11 to 500000. 2476: 3° apart
  int size = 128;         // texels along each side of the rectangle; 2 to 1024
  // What the views are focused on. auto: a distance per direction by photo-consistency; sphere: one sphere whose radius
  // photo-consistency chooses; sphere:R (metres); sphere:inf; box: a room whose sides it chooses; box:X0,Y0,X1,Y1,H
  // (world metres); mesh:FILE (world coordinates); plane: the light-field plane itself (the paper's).
  std::string proxy = "auto";
  int k = 0;  // views blended for a ray; 0: 15 for the plane (the paper's), 6 else; 1 to 64
  // Buehler's penalty (host/blending/ray_penalty.h): β in metres of ray distance per octave of missing resolution, ≥ 0;
  // γ > 0, how strongly views are shunned near their border. α, the unit of both, is 1. The plane has no choice of
  // them.
  double resolution = 0;
  double border = 1;
  bool fill = true;         // give texels that no view saw a guess, at confidence 0; else they stay black
  bool provenance = false;  // also tell which frames lit which texels
  std::optional<std::array<double, 4>> rectangle;  // x0 y0 x1 y1 in world metres; else from the mirror's openings

  // What is wrong, in words that name the field; nothing when all is well.
  [[nodiscard]] std::optional<std::string> validate() const;
};

struct ResampleResult {
  LightField field;
  std::vector<SphereScore> sphere_scores;  // only when a sphere was chosen
  std::map<std::string, double> seconds;   // by stage; blending and packing: of all threads, over their number
  std::size_t views = 0;
  double mean_confidence = 0;            // cosine-weighted over directions, mean over the plane
  double filled_share = 0;               // of the texels: those that no view saw, if they were given a guess
  std::optional<Provenance> provenance;  // when asked for
};

// A capture that is focused and ready to be resampled (Ihrke et al. 2008, §4.3), each ray blended from the k best views
// (Buehler et al. 2001, §4.1), seen over the proxy: see docs/light_field.md. Tiles are made on demand.
class Resampling {
 public:
  // `views` see the world frame and outlive this; `rectangle` is the plane's part to cover.
  // A team shares the work of focusing.
  Resampling(const std::vector<FieldView>& views, const PlaneRectangle& rectangle, const ResampleOptions&, const Team&,
             const Progress&);
  ~Resampling();
  Resampling(const Resampling&) = delete;
  Resampling& operator=(const Resampling&) = delete;

  // Everything but the texels.
  [[nodiscard]] const LightField& field() const;
  [[nodiscard]] const PenaltyOptions& penalty() const;  // how views are chosen for a ray
  // One direction's tile, resolution² texels. In any thread, in any order: the result is the same. Returns how many of
  // them no view saw and were given a guess.
  std::size_t fill(std::size_t direction, Eigen::Vector4f* tile);
  // Several at once, as many tiles after each other; `guessed`: by direction. Done fastest with
  // directions_at_once() successive directions.
  void fill(std::span<const std::size_t> directions, Eigen::Vector4f* tiles, std::span<std::size_t> guessed);
  [[nodiscard]] std::size_t directions_at_once() const;
  // Which frames light which texels, by the names of the calibration's frames.
  [[nodiscard]] Provenance provenance(std::vector<std::string> frame_names) const;

  [[nodiscard]] const std::vector<SphereScore>& sphere_scores() const;
  [[nodiscard]] std::size_t views() const;
  [[nodiscard]] double focusing_s() const;  // how long the construction took

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// All tiles, in memory: 16 bytes a texel and direction.
[[nodiscard]] ResampleResult resample(const std::vector<FieldView>& views, const PlaneRectangle& rectangle,
                                      const ResampleOptions&, const Progress&);

// All tiles, written to a file as they are made; the result's field has no texels. `absolute`: radiance is in the units
// of the reference reading. A team deals out the directions; rank 0 writes, the same bytes as one process alone, and
// its result is the one that counts.
[[nodiscard]] ResampleResult resample_to_file(Resampling&, const std::filesystem::path&, bool absolute, Team&,
                                              const Progress&);

// The rectangle of the plane z = height (world) that the mirrors' openings cover: the box around all points that at
// least a tenth as many views pass as the best-covered point; of the 4 × 4 m about the footprints' middle. Nothing when
// no view's rays come down to the plane.
[[nodiscard]] std::optional<PlaneRectangle> covered_rectangle(const Calibration&, const MirrorTarget&, double height_m);

// `wanted` (x0 y0 x1 y1, world metres), else covered_rectangle(). Throws InputError that names `file` (of the
// calibration), the flag and what the views cover: without a world frame or used frames, for a height far from where
// the mirror was waved (a slip of the unit), for a rectangle that no view looks through, and for one to be found that
// is larger than the 4 × 4 m searched.
[[nodiscard]] PlaneRectangle chosen_rectangle(const Calibration&, const MirrorTarget&, double height_m,
                                              const std::optional<std::array<double, 4>>& wanted,
                                              const std::string& file);

}  // namespace mf
