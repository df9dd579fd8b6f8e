// SPDX-License-Identifier: Apache-2.0
#include "host/viewer/light_field_window.h"

#include <fmt/format.h>
#include <imgui.h>

#include <cmath>

#include "host/io/image_file.h"

namespace mf {

namespace {

class LightFieldWindow {
 public:
  LightFieldWindow(Window& window, LightField field, std::string title)
      : window_(window),
        title_(std::move(title)),
        view_(std::move(field)),
        irradiance_exposure_(display_exposure(view_.irradiance())),
        radiance_exposure_(display_exposure(view_.hemisphere(256))) {}

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
  // A drag that starts on the plane's picture may leave it: the point then follows along the rectangle's edge.
  void drag_probe() {
    const auto pointer = window_.pointer();
    if (pointer && layout_.plane.holds(*pointer) && ImGui::IsMouseClicked(ImGuiMouseButton_Left)) dragging_ = true;
    if (!ImGui::IsMouseDown(ImGuiMouseButton_Left)) dragging_ = false;
    if (!pointer || !dragging_) return;
    const Eigen::Vector2d before = view_.probe_in_plane();
    view_.move_probe(view_.plane_point(layout_.plane.position_of(*pointer)));
    probe_moved_ = probe_moved_ || view_.probe_in_plane() != before;
  }

  void draw_panel() {
    ImGui::SetNextWindowPos({0, 0});
    ImGui::SetNextWindowSize({static_cast<float>(panel_width_px), static_cast<float>(window_.height())});
    ImGui::Begin("light field", nullptr,
                 ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove);
    ImGui::PushTextWrapPos();
    ImGui::TextUnformatted(title_.c_str());
    ImGui::Separator();
    if (ImGui::SliderFloat("exposure", &stops_, -8, 8, "%+.1f stops")) exposure_moved_ = true;
    auto height = static_cast<float>(view_.height_m());
    if (ImGui::SliderFloat("height", &height, 0, 0.5F, "%.2f m")) {
      view_.set_height(static_cast<double>(std::max(height, 0.0F)));
      probe_moved_ = true;
    }
    if (!view_.field().surroundings.is_plane() &&
        ImGui::SliderFloat("white at", &nearest_m_, 0.1F, 10, "%.2f m", ImGuiSliderFlags_Logarithmic))
      exposure_moved_ = true;
    ImGui::Separator();
    describe_probe();
    ImGui::Separator();
    ImGui::TextUnformatted(reading().c_str());
    ImGui::Separator();
    ImGui::TextUnformatted("Drag on the plane: the probe point\nF12: screenshot    Ctrl+Q: close");
    ImGui::TextUnformatted(window_.notice().c_str());
    ImGui::PopTextWrapPos();
    ImGui::End();
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
    caption(layout_.plane, "irradiance of the plane");
    caption(layout_.hemisphere, "light at the probe point, by direction");
    caption(layout_.distances, view_.field().surroundings.is_plane() ? "focused on the plane: no distances"
                                                                     : "nearness of the surroundings");
    caption(layout_.panorama, "the probe: +Y in the middle, zenith at the top");
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
    if (panorama_waits_ && !dragging_ && !ImGui::IsAnyItemActive()) {
      panorama_.set(to_srgb8(view_.panorama(panorama_width_px), radiance_exposure_ * gain));
      panorama_waits_ = false;
    } else if (panorama_waits_) {
      window_.hurry();
    }
    first_ = probe_moved_ = exposure_moved_ = false;
  }

  static void caption(const Box& picture, const std::string& text) {
    constexpr int text_height_px = 18;
    draw_caption({picture.x, picture.y - text_height_px}, text);
  }

  static void draw_cross(const Eigen::Vector2d& at) {
    constexpr float arm = 9, gap = 3;
    const auto x = static_cast<float>(at.x()), y = static_cast<float>(at.y());
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    for (const auto& [colour, width] : {std::pair{IM_COL32(0, 0, 0, 255), 3.0F}, {IM_COL32(255, 220, 0, 255), 1.0F}})
      for (const float sign : {-1.0F, 1.0F}) {
        list.AddLine({x + sign * gap, y}, {x + sign * arm, y}, colour, width);
        list.AddLine({x, y + sign * gap}, {x, y + sign * arm}, colour, width);
      }
  }

  static constexpr int panorama_width_px = 512;

  Window& window_;
  std::string title_;
  LightFieldView view_;
  double irradiance_exposure_, radiance_exposure_;  // at 0 stops
  float stops_ = 0;
  float nearest_m_ = 0.5F;
  LightFieldLayout layout_;
  ShownPicture plane_, hemisphere_, distances_, panorama_;
  int hemisphere_size_ = 0;
  bool first_ = true, dragging_ = false, probe_moved_ = false, exposure_moved_ = false, panorama_waits_ = true;
};

}  // namespace

void show_light_field(Window& window, LightField field, const std::string& title) {
  LightFieldWindow(window, std::move(field), title).run();
}

}  // namespace mf
