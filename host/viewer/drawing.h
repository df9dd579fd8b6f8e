// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "common/image.h"
#include "host/gl/gl_objects.h"
#include "host/viewer/layout.h"
#include "host/viewer/window.h"

namespace mf {

// What the windows of the viewer are made of. Everything here belongs between begin_frame() and end_frame().

// The panel of settings at the left, from its construction to its end, which adds `keys` (what the keys do) and the
// window's notice. ImGui's widgets between them are in it.
class Panel {
 public:
  Panel(const Window&, std::string keys);
  Panel(const Panel&) = delete;
  Panel& operator=(const Panel&) = delete;
  ~Panel();

 private:
  const Window& window_;
  std::string keys_;
};

// A picture on the graphics side, drawn behind the panels.
class ShownPicture {
 public:
  // How pixels that are larger than the screen's look: squares, as data, or without edges, as a photo.
  enum class Enlarged { sharp, smooth };
  // 8 bits, 1 or 3 channels, not empty; its first row is shown at the top. Replaces what was there.
  void set(const ImageU8&, Enlarged = Enlarged::sharp);
  // Into the box; nothing before the first set().
  void draw(const Box&) const;

 private:
  GlTexture texture_;
};

// A point that the left button drags over a picture. A drag that starts on the picture may leave it.
class DraggedPoint {
 public:
  // Where the point is dragged to now, as a fraction of the box, perhaps beyond it; nothing when it is left alone.
  [[nodiscard]] std::optional<Eigen::Vector2d> position(const Window&, const Box&);
  [[nodiscard]] bool is_dragged() const { return dragged_; }

 private:
  bool dragged_ = false;
};

// A line of text above a picture.
void draw_caption(const Box& picture, const std::string& text);

// A yellow cross whose middle is left open.
void draw_cross(const Eigen::Vector2d& pixel);

}  // namespace mf
