// SPDX-License-Identifier: Apache-2.0
#include "host/viewer/lumigraph_window.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

#include "common/error.h"
#include "common/seconds_since.h"
#include "host/viewer/drawing.h"
#include "host/viewer/path_recorder.h"

namespace mf {

namespace {

constexpr double turn_per_picture_rad = std::numbers::pi;  // a drag across the picture's width
constexpr double wheel_step = 1.1;                         // nearer by a tenth for each notch

class LumigraphWindow {
 public:
  LumigraphWindow(Window& window, LumigraphView view, const LumigraphWindowOptions& options)
      : window_(window), view_(std::move(view)), title_(options.title), recorder_(options.path_folder) {}

  void run() {
    while (window_.begin_frame()) {
      box_ = fitted(picture_room(window_.width(), window_.height()), view_.aspect());
      take_pointer();
      take_keys();
      draw_panel();
      draw_picture();
      window_.end_frame();
    }
  }

 private:
  // What the hand does in the picture.
  void take_pointer() {
    const ImGuiIO& io = ImGui::GetIO();
    const auto pointer = window_.pointer();
    position_.reset();
    if (pointer && box_.holds(*pointer)) position_ = box_.position_of(*pointer);
    if (position_)
      for (const ImGuiMouseButton button : {ImGuiMouseButton_Left, ImGuiMouseButton_Right, ImGuiMouseButton_Middle})
        if (ImGui::IsMouseClicked(button)) {
          dragging_ = button;
          view_.grab();
        }
    if (dragging_ && !ImGui::IsMouseDown(*dragging_)) dragging_.reset();
    if (dragging_ && (io.MouseDelta.x != 0 || io.MouseDelta.y != 0))
      drag(Eigen::Vector2d(static_cast<double>(io.MouseDelta.x), static_cast<double>(io.MouseDelta.y)) / box_.width);
    if (position_ && io.MouseWheel != 0) turn_wheel(static_cast<double>(io.MouseWheel), io.KeyShift);
  }

  void drag(const Eigen::Vector2d& step) {
    const Navigation& n = view_.navigation();
    const Eigen::Vector2d angle = step * turn_per_picture_rad;
    if (*dragging_ == ImGuiMouseButton_Left)
      navigate(orbited(n, -angle.x(), angle.y()));
    else if (*dragging_ == ImGuiMouseButton_Right)
      navigate(turned(n, -angle.x(), angle.y()));
    else
      navigate(moved(n, shift_of(step)));
  }

  // That takes what is at the pivot's depth along with the hand.
  [[nodiscard]] Eigen::Vector3d shift_of(const Eigen::Vector2d& step) const {
    const CameraModel camera = view_.view(box_.width).camera;
    const Eigen::Vector2d in_plane = step * box_.width * view_.navigation().focus_distance / camera.fx();
    return {-in_plane.x(), -in_plane.y(), 0};
  }

  void turn_wheel(double notches, bool focus) {
    const double factor = std::pow(wheel_step, -notches);
    if (!focus) {
      view_.grab();
      return navigate(dollied(view_.navigation(), factor));
    }
    if (!view_.has_focus()) return window_.set_notice("only a plane is focused: open it with --proxy plane");
    view_.focus_at(view_.depth_ahead() / factor);
    changed();
  }

  void take_keys() {
    if (window_.pressed('B')) toggle_blending_field();
    if (window_.pressed('K')) recorder_.add_key(view_.view(full_width()));
    if (window_.pressed('P') && view_.has_focus()) {
      view_.face_plane();
      changed();
    }
    const auto push = [this](char forward, char back) {
      return (window_.held(forward) ? 1.0 : 0.0) - (window_.held(back) ? 1.0 : 0.0);
    };
    const Eigen::Vector3d way(push('D', 'A'), push('Q', 'E'), push('W', 'S'));
    if (way.isZero()) {
      flight_speed_.reset();
      return;
    }
    // The speed is what lay ahead when the flight began: in half a second halfway there.
    if (!flight_speed_) flight_speed_ = view_.depth_ahead();
    constexpr double longest_step_s = 0.1;  // the first frame after a rest is no leap
    const double seconds = std::min(static_cast<double>(ImGui::GetIO().DeltaTime), longest_step_s);
    navigate(moved(view_.navigation(), way.normalized() * *flight_speed_ * seconds));
    window_.hurry();
  }

  void draw_panel() {
    const Panel panel(window_,
                      "Drag: orbit    right: turn    middle: shift\nwheel: nearer    Shift+wheel: focus\n"
                      "W A S D Q E: fly    B: blending field\nP: face the plane    K: key view    R: render path");
    draw_settings();
    draw_weights();
    draw_path();
    draw_photos();
  }

  void draw_settings() {
    LumigraphOptions options = view_.options();
    bool field = options.shown == Shown::blending_field;
    if (ImGui::Checkbox("blending field", &field)) toggle_blending_field();
    options = view_.options();
    bool moved = ImGui::SliderInt("k", &options.penalty.k, 1, 16);
    moved |= ImGui::SliderFloat("alpha (angle)", &options.penalty.angle, 0, 10, "%.2f");
    moved |= ImGui::SliderFloat("beta (resolution)", &options.penalty.resolution, 0, 1, "%.3f");
    moved |= ImGui::SliderFloat("gamma (border)", &options.penalty.border, 0.1F, 4, "%.2f");
    if (moved && !options.validate()) {  // what is typed in by Ctrl+click may lie beyond the slider's ends
      view_.set_options(options);
      changed();
    }
    auto depth = static_cast<float>(view_.depth_ahead());
    ImGui::BeginDisabled(!view_.has_focus());
    if (ImGui::DragFloat("focus", &depth, 0.01F * depth, 1e-3F, 1e6F, "%.3f") && depth > 0 && view_.has_focus()) {
      view_.focus_at(static_cast<double>(depth));
      changed();
    }
    ImGui::EndDisabled();
    if (view_.is_linear() && ImGui::SliderFloat("exposure", &stops_, -8, 8, "%+.1f stops")) changed();
  }

  void toggle_blending_field() {
    LumigraphOptions options = view_.options();
    options.shown = options.shown == Shown::photos ? Shown::blending_field : Shown::photos;
    view_.set_options(options);
    changed();
  }

  static ImVec4 swatch_colour(std::uint32_t photo) {
    const auto colour = field_colour(photo);
    return ImGui::ColorConvertU32ToFloat4(IM_COL32(colour[0], colour[1], colour[2], 255));
  }

  static void swatch(std::uint32_t photo) {
    ImGui::ColorButton("##swatch", swatch_colour(photo), ImGuiColorEditFlags_NoTooltip | ImGuiColorEditFlags_NoBorder,
                       {14, 14});
    ImGui::SameLine();
  }

  // The photos that speak for the pixel under the pointer.
  void draw_weights() {
    ImGui::Separator();
    ImGui::TextUnformatted("under the pointer");
    constexpr float lines_height_px = 120;
    ImGui::BeginChild("weights", {0, lines_height_px});
    if (position_) {
      const std::vector<ViewWeight> weights = view_.weights_at(*position_, full_width());
      if (weights.empty()) ImGui::TextUnformatted("no photo shows this");
      for (const ViewWeight& w : weights) {
        constexpr float least_shown = 0.0005F;  // would read 0.0 %
        if (w.weight < least_shown) continue;
        ImGui::PushID(static_cast<int>(w.view));
        swatch(w.view);
        ImGui::TextUnformatted(
            fmt::format("{:5.1f} %  {}", 100 * w.weight, view_.lumigraph().sources()[w.view].name).c_str());
        ImGui::PopID();
      }
    }
    ImGui::EndChild();
  }

  void draw_path() {
    ImGui::Separator();
    if (ImGui::Button("add key view")) recorder_.add_key(view_.view(full_width()));
    ImGui::SameLine();
    ImGui::BeginDisabled(recorder_.keys().empty());
    if (ImGui::Button("drop last")) recorder_.drop_last_key();
    ImGui::EndDisabled();
    ImGui::SameLine();
    ImGui::BeginDisabled(recorder_.keys().size() < 2 || recorder_.is_working());
    const bool clicked = ImGui::Button("render path");
    ImGui::EndDisabled();
    const bool may_start = recorder_.keys().size() >= 2 && !recorder_.is_working();
    try {
      if (may_start && (clicked || window_.pressed('R'))) recorder_.start();
      if (recorder_.is_working()) {
        recorder_.work([this](const View& view) { return view_.render(view, static_cast<double>(stops_)); });
        window_.hurry();
      }
    } catch (const InputError& e) {  // the window stays: the user may give another folder, and sees why
      window_.set_notice(e.what());
    }
    ImGui::TextUnformatted(recorder_.status().c_str());
  }

  // Every photo; a click goes to where it was taken.
  void draw_photos() {
    ImGui::Separator();
    ImGui::TextUnformatted(title_.c_str());
    constexpr float keys_height_px = 110;
    ImGui::BeginChild("photos", {0, -keys_height_px});
    const auto& sources = view_.lumigraph().sources();
    ImGuiListClipper clipper;
    clipper.Begin(static_cast<int>(sources.size()));
    while (clipper.Step())
      for (int i = clipper.DisplayStart; i < clipper.DisplayEnd; ++i) {
        const auto photo = static_cast<std::uint32_t>(i);
        ImGui::PushID(i);
        swatch(photo);
        if (ImGui::Selectable(sources[photo].name.c_str())) {
          view_.jump(photo);
          changed();
        }
        ImGui::PopID();
      }
    ImGui::EndChild();
  }

  // Of a picture at rest, pixels.
  [[nodiscard]] int full_width() const { return std::min(box_.width, view_.largest_width_px()); }

  // While something moves, pictures are as large as time allows; then one of full size.
  void draw_picture() {
    if (full_width() != rendered_width_) full_size_waits_ = true;
    if (moved_ || full_size_waits_) {
      const int divisor = moved_ ? pace_.divisor() : 1;
      const auto start = std::chrono::steady_clock::now();
      const View view = view_.view(std::max(1, full_width() / divisor));
      picture_.set(view_.render(view, static_cast<double>(stops_)), ShownPicture::Enlarged::smooth);
      pace_.took(seconds_since(start), divisor);
      full_size_waits_ = divisor > 1;
      rendered_width_ = full_width();
      if (full_size_waits_) window_.hurry();
      moved_ = false;
    }
    picture_.draw(box_);
  }

  void navigate(const Navigation& to) {
    view_.navigate(to);
    changed();
  }
  void changed() { moved_ = true; }

  Window& window_;
  LumigraphView view_;
  std::string title_;
  PathRecorder recorder_;
  Box box_;
  std::optional<Eigen::Vector2d> position_;  // of the pointer in the picture
  std::optional<ImGuiMouseButton> dragging_;
  std::optional<double> flight_speed_;  // world units a second
  float stops_ = 0;
  ShownPicture picture_;
  Pace pace_;
  int rendered_width_ = 0;
  bool moved_ = true;            // the picture is out of date
  bool full_size_waits_ = true;  // it is right, but small
};

}  // namespace

void show_lumigraph(Window& window, LumigraphView view, const LumigraphWindowOptions& options) {
  LumigraphWindow(window, std::move(view), options).run();
}

}  // namespace mf
