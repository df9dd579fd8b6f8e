// SPDX-License-Identifier: Apache-2.0
#include "host/viewer/light_field_window.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>

#include "host/io/image_file.h"
#include "host/viewer/drawing.h"

namespace mf {

namespace {

class LightFieldWindow {
 public:
  LightFieldWindow(Window& window, LightFieldView& view, std::string title)
      : window_(window),
        title_(std::move(title)),
        view_(view),
        irradiance_exposure_(display_exposure(view_.irradiance())),
        radiance_exposure_(display_exposure(view_.hemisphere(glance_px))),
        nearest_m_(nearest_of(view_.inverse_distances(glance_px))) {}

  void run() {
    while (window_.begin_frame()) {
      const Eigen::Vector2d size = view_.field().plane.size_m();
      layout_ = light_field_layout(window_.width(), window_.height(), size.x() / size.y());
      drag_probe();
      draw_panel();
      draw_pictures();
      window_.end_frame();
    }
  }

 private:
  void drag_probe() {
    const auto position = drag_.position(window_, layout_.plane);
    if (!position) return;
    const Eigen::Vector2d before = view_.probe_in_plane();
    view_.move_probe(view_.plane_point(*position));
    probe_moved_ = view_.probe_in_plane() != before;
  }

  void draw_panel() {
    const Panel panel(window_, "Drag on the plane: the probe point");
    if (ImGui::SliderFloat("exposure", &stops_, -8, 8, "%+.1f stops")) exposure_moved_ = true;
    auto height = static_cast<float>(view_.height_m());
    if (ImGui::SliderFloat("height", &height, 0, 0.5F, "%.2f m")) {
      view_.set_height(static_cast<double>(std::max(height, 0.0F)));
      probe_moved_ = true;
    }
    if (!view_.field().surroundings.is_plane() &&
        ImGui::SliderFloat("white at", &nearest_m_, nearest_of_slider_m, farthest_of_slider_m, "%.2f m",
                           ImGuiSliderFlags_Logarithmic))
      exposure_moved_ = true;
    ImGui::Separator();
    ImGui::TextUnformatted(title_.c_str());
    ImGui::Separator();
    describe_probe();
    ImGui::Separator();
    ImGui::TextUnformatted(reading().c_str());
  }

  void describe_probe() const {
    const Eigen::Vector3d x = view_.probe_in_world();
    const Eigen::Vector3f e = view_.irradiance_at(view_.probe_in_plane());
    ImGui::TextUnformatted(
        fmt::format("probe at {:.3f} {:.3f} {:.3f} m (world)\nirradiance of the plane {:.3g} {:.3g} {:.3g}", x.x(),
                    x.y(), x.z(), e.x(), e.y(), e.z())
            .c_str());
  }

  // What is under the pointer.
  [[nodiscard]] std::string reading() const {
    const auto pointer = window_.pointer();
    if (!pointer) return "point at a picture to read it";
    if (layout_.plane.holds(*pointer)) {
      const Eigen::Vector2d p = view_.plane_point(layout_.plane.position_of(*pointer));
      const Eigen::Vector3f e = view_.irradiance_at(p);
      return fmt::format("{:.3f} {:.3f} m on the plane: irradiance {:.3g} {:.3g} {:.3g}", p.x(), p.y(), e.x(), e.y(),
                         e.z());
    }
    std::optional<DirectionReading> read;
    for (const Box& disc : {layout_.hemisphere, layout_.distances})
      if (disc.holds(*pointer)) read = view_.read_disc(disc.position_of(*pointer));
    if (layout_.panorama.holds(*pointer)) read = view_.read_panorama(layout_.panorama.position_of(*pointer));
    return read ? describe(*read) : "point at a picture to read it";
  }

  void draw_pictures() {
    refresh_pictures();
    plane_.draw(layout_.plane);
    hemisphere_.draw(layout_.hemisphere);
    if (!view_.field().surroundings.is_plane()) distances_.draw(layout_.distances);
    panorama_.draw(layout_.panorama);
    draw_caption(layout_.plane, "irradiance of the plane");
    draw_caption(layout_.hemisphere, "light at the probe point, by direction");
    draw_caption(layout_.distances, view_.field().surroundings.is_plane() ? "focused on the plane: no distances"
                                                                          : "nearness of the surroundings");
    draw_caption(layout_.panorama, "the probe: +Y in the middle, zenith at the top");
    draw_cross(layout_.plane.pixel_of(view_.plane_position(view_.probe_in_plane())));
  }

  // Remakes what changed. The panorama takes longest: while the point is dragged it waits for a rest.
  void refresh_pictures() {
    const bool resized = hemisphere_size_ != layout_.hemisphere.width;
    hemisphere_size_ = layout_.hemisphere.width;
    const double gain = std::exp2(static_cast<double>(stops_));
    if (first_ || exposure_moved_) plane_.set(to_srgb8(view_.irradiance(), irradiance_exposure_ * gain));
    if (first_ || resized || probe_moved_ || exposure_moved_) {
      hemisphere_.set(to_srgb8(view_.hemisphere(hemisphere_size_), radiance_exposure_ * gain));
      if (!view_.field().surroundings.is_plane())
        distances_.set(
            show_inverse_distances(view_.inverse_distances(layout_.distances.width), static_cast<double>(nearest_m_)));
      panorama_waits_ = true;
    }
    if (panorama_waits_ && !drag_.is_dragged() && !ImGui::IsAnyItemActive()) {
      panorama_.set(to_srgb8(view_.panorama(panorama_width_px), radiance_exposure_ * gain));
      panorama_waits_ = false;
    } else if (panorama_waits_) {
      window_.hurry();
    }
    first_ = probe_moved_ = exposure_moved_ = false;
  }

  static constexpr int panorama_width_px = 512;
  static constexpr int glance_px = 256;  // of pictures that only choose what the first ones look like

  // What is white at first: the nearest that the first point sees, within the slider's ends.
  static float nearest_of(const ImageF& inverse_distances) {
    if (inverse_distances.empty()) return nearest_of_slider_m;
    const float largest = *std::max_element(inverse_distances.data.begin(), inverse_distances.data.end());
    return std::clamp(1 / std::max(largest, 1 / farthest_of_slider_m), nearest_of_slider_m, farthest_of_slider_m);
  }
  static constexpr float nearest_of_slider_m = 0.1F, farthest_of_slider_m = 10;

  Window& window_;
  std::string title_;
  LightFieldView& view_;
  double irradiance_exposure_, radiance_exposure_;  // at 0 stops
  float nearest_m_;                                 // shown white
  float stops_ = 0;
  LightFieldLayout layout_;
  DraggedPoint drag_;
  ShownPicture plane_, hemisphere_, distances_, panorama_;
  int hemisphere_size_ = 0;
  bool first_ = true, probe_moved_ = false, exposure_moved_ = false, panorama_waits_ = true;
};

}  // namespace

void show_light_field(Window& window, LightFieldView& view, const std::string& title) {
  LightFieldWindow(window, view, title).run();
}

}  // namespace mf
