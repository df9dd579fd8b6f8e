// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/progress.h"
#include "host/blending/ray_penalty.h"
#include "host/blending/view_weights.h"
#include "host/io/view.h"
#include "host/lumigraph/moment.h"
#include "host/lumigraph/photo_pyramid.h"
#include "host/lumigraph/posed_photo.h"
#include "host/lumigraph/proxy.h"
#include "host/lumigraph/ray_answers.h"
#include "host/lumigraph/source_sight.h"

namespace mf {

class TilePool;

// What a picture of the lumigraph shows: the place, or which photo speaks for what, each in a colour of its own (the
// blending field of Buehler et al. 2001, figure 6).
enum class Shown { photos, blending_field };

struct LumigraphOptions {
  PenaltyOptions penalty{4, 1, 0.2F, 0.5F};  // angle: of the chord at the proxy point, radians
  float border = 0.03F;                      // 0.001 to 0.5 of a photo's shorter side: width of its soft border
  Shown shown = Shown::photos;
  std::optional<Moment>
      moment{};  // of a scene that moves; nothing: times are not looked at. Photos without one always speak

  // What is wrong, in words that name the field; nothing when all is well.
  [[nodiscard]] std::optional<std::string> validate() const;
};

// What a pixel rests on. A guess is a point of the proxy that lies in a photo's picture, but hidden or at a silhouette
// in each: it has that photo's colour at the place.
enum Covered : std::uint8_t { nothing = 0, guessed = 127, seen = 255 };

struct LumigraphPicture {
  Picture picture;  // black where nothing is covered; the blending field is 8-bit always
  ImageU8 covered;  // see Covered
};

// See RayBundle.
struct WantedResolution {
  float focal2 = 1;
  float beyond = 0;
};

// What a frame is made from, whoever makes it.
struct FrameInput {
  std::vector<std::uint32_t> speaking;  // the photos that may speak
  std::vector<AnsweringView> views;     // every photo, for this frame's eye
  WantedResolution wanted;
};

// New views of a place from posed photos and a rough idea of its shape: unstructured lumigraph rendering (Buehler,
// Bosse, McMillan, Gortler, Cohen 2001), per pixel.
//
// For each pixel's ray the point X where it meets the proxy is found, and the k photos with the least penalty there
// (ray_penalty.h) are blended at the places where they show X, with the weights of view_weights.h. The paper samples
// these weights at some vertices and interpolates; here every pixel has its exact ones: photos are ranked for tiles of
// the picture, then for bundles of 8 × 8 rays, and a photo is dropped for them only when no point of theirs can rank
// the photo among the k + 1 best. So no grid shows, and a thousand photos cost less than twice as much as fifty.
class Lumigraph {
 public:
  // Copies what it needs of the photos. Precondition: check_photos(photos).
  Lumigraph(const PhotoSet& photos, Proxy proxy, const VisibilityOptions& = {}, const Progress& = {});

  Lumigraph(Lumigraph&&) noexcept;
  ~Lumigraph();

  // Another proxy for the same photos: at once for a plane or walls; a mesh is looked at from every photo.
  void set_proxy(Proxy proxy, const Progress& = {});

  // A new view. `views`: the photos that may speak; empty: all. The picture is of the photos' kind. Any number of
  // threads may render at once.
  [[nodiscard]] LumigraphPicture render(const View&, const LumigraphOptions&,
                                        std::span<const std::uint32_t> views = {}) const;

  // Which photos speak for the ray through a pixel position, best first; empty where nothing is covered.
  [[nodiscard]] std::vector<ViewWeight> weights_at(const View&, const Eigen::Vector2d& pixel, const LumigraphOptions&,
                                                   std::span<const std::uint32_t> views = {}) const;

  // Where the ray through a pixel position meets the proxy, world.
  [[nodiscard]] std::optional<Eigen::Vector3d> point_at(const View&, const Eigen::Vector2d& pixel) const;

  struct Source {
    std::string name;
    CameraModel camera;
    Rigid3 cam_from_world;
    std::optional<double> time_s;
  };
  [[nodiscard]] const std::vector<Source>& sources() const { return sources_; }
  [[nodiscard]] const Proxy& proxy() const { return proxy_; }

  // What another back end draws with: see GlLumigraph.
  [[nodiscard]] const std::vector<AnsweringCamera>& cameras() const { return cameras_; }
  [[nodiscard]] const PhotoPyramids& pyramids() const { return pyramids_; }
  [[nodiscard]] const std::vector<SourceSight>& sights() const { return sights_; }
  [[nodiscard]] const VisibilityOptions& visibility() const { return visibility_; }
  [[nodiscard]] FrameInput frame_input(const View&, const LumigraphOptions&,
                                       std::span<const std::uint32_t> views) const;

 private:
  void look_at_proxy(const Progress&);
  [[nodiscard]] std::vector<AnsweringView> views_from(const Eigen::Vector3d& eye, const LumigraphOptions&) const;
  [[nodiscard]] WantedResolution resolution_of(const View&, std::span<const std::uint32_t> speaking) const;

  std::vector<Source> sources_;
  std::vector<AnsweringCamera> cameras_;
  std::vector<ImageU8> masks_;
  PhotoPyramids pyramids_;
  Proxy proxy_;
  VisibilityOptions visibility_;
  std::vector<SourceSight> sights_;
  std::unique_ptr<TilePool> pool_;  // memory that frames take over from each other
};

// Of one pixel alone: what `view` shows around a pixel position, as a picture of 1 × 1.
[[nodiscard]] View pixel_of_view(const View&, const Eigen::Vector2d& pixel);

// The colour of a photo in the blending field: neighbours in number are far apart in hue.
[[nodiscard]] std::array<std::uint8_t, 3> field_colour(std::uint32_t view);

}  // namespace mf
