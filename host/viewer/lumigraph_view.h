// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <variant>
#include <vector>

#include "common/image.h"
#include "host/io/view.h"
#include "host/lumigraph/lumigraph.h"
#include "host/viewer/navigation.h"

namespace mf {

// A lumigraph and the camera that a hand moves in it. Nothing here draws or knows a window.
//
// Positions in the picture are fractions of its width and height, (0, 0) the upper left corner.
class LumigraphView {
 public:
  // Starts at the photo that was taken nearest to the middle of all, with its lens. What is up is what the photos'
  // upper edges point to on average.
  explicit LumigraphView(Lumigraph);

  [[nodiscard]] const Lumigraph& lumigraph() const { return lumigraph_; }

  // The lens is one of the photos', without its distortion; the picture has its aspect.
  [[nodiscard]] const Navigation& navigation() const { return navigation_; }
  void navigate(const Navigation& to) { navigation_ = to; }
  void jump(std::size_t photo);  // to a photo's place, with its lens
  [[nodiscard]] double aspect() const;
  [[nodiscard]] View view(int width_px) const;
  // The photos' own width: a finer picture shows nothing more, and its resolution term would let other photos speak at
  // a photo's own place.
  [[nodiscard]] int largest_width_px() const { return lens_.width; }

  // Of what the middle of the picture shows, along the optical axis; else the distance of the focus as it is.
  [[nodiscard]] double depth_ahead() const;
  // Puts the pivot on what the middle of the picture shows: a movement begins.
  void grab();

  // A plane as proxy is what the picture is focused on; it keeps its direction. Other proxies have no focus to move.
  [[nodiscard]] bool has_focus() const { return std::holds_alternative<PlaneProxy>(lumigraph_.proxy()); }
  // Moves the plane to where the optical axis is `depth` > 0 before the camera. Precondition: has_focus().
  void focus_at(double depth);
  // Turns it about that point to face the camera. Precondition: has_focus().
  void face_plane();

  [[nodiscard]] const LumigraphOptions& options() const { return options_; }
  // Precondition: valid.
  void set_options(const LumigraphOptions&);

  // For the screen: photos' codes as they are, linear photos as sRGB times 2^stops (0: most of the first picture
  // shows).
  [[nodiscard]] ImageU8 render(const View&, double stops) const;
  [[nodiscard]] bool is_linear() const { return exposure_ > 0; }

  // Which photos speak for a position of the picture of that width, best first.
  [[nodiscard]] std::vector<ViewWeight> weights_at(const Eigen::Vector2d& position, int width_px) const;

 private:
  Lumigraph lumigraph_;
  LumigraphOptions options_;
  Navigation navigation_;
  CameraModel lens_;
  double exposure_ = 0;  // of linear photos; 0: they are 8-bit codes
};

// How large pictures are made while they move, so that they follow the hand: the full size divided by 1, 2 or 4, as the
// time of the last one allows.
class Pace {
 public:
  [[nodiscard]] int divisor() const { return divisor_; }
  // A picture at 1/divisor of its size took so long.
  void took(double seconds, int divisor);

 private:
  int divisor_ = 1;
};

}  // namespace mf
