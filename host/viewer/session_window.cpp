// SPDX-License-Identifier: Apache-2.0
#include "host/viewer/session_window.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>

#include "host/light_field/surroundings.h"
#include "host/viewer/drawing.h"

namespace mf {

namespace {

constexpr int cells_across = 128;  // of the counts' picture, along the longer side

class SessionWindow {
 public:
  SessionWindow(Window& window, SessionView view, std::string title)
      : window_(window), title_(std::move(title)), view_(std::move(view)) {
    const Eigen::Vector2d cell_counts = view_.plane().size_m() / view_.plane().size_m().maxCoeff() * cells_across;
    counts_ = view_.counts(std::max(1, static_cast<int>(std::lround(cell_counts.x()))),
                           std::max(1, static_cast<int>(std::lround(cell_counts.y()))));
    most_ = *std::max_element(counts_.data.begin(), counts_.data.end());
    seen_ = view_.seen_at(point());
  }

  void run() {
    show_counts();
    while (window_.begin_frame()) {
      const Box room = picture_room(window_.width(), window_.height());
      const Eigen::Vector2d size = view_.plane().size_m();
      const auto half = [&](int column, double aspect) {
        return fitted({room.x + column * room.width / 2, caption_height_px, room.width / 2 - 8,
                       room.height - caption_height_px - 8},
                      aspect);
      };
      plane_box_ = half(0, size.x() / size.y());
      disc_box_ = half(1, 1);
      if (const auto position = drag_.position(window_, plane_box_)) {
        position_ = position->cwiseMax(Eigen::Vector2d::Zero()).cwiseMin(Eigen::Vector2d::Ones());
        seen_ = view_.seen_at(point());
      }
      draw_panel();
      draw_pictures();
      window_.end_frame();
    }
  }

 private:
  [[nodiscard]] Eigen::Vector2d point() const {
    const Eigen::Vector2d from_min(position_.x(), 1 - position_.y());
    return view_.plane().min_m + from_min.cwiseProduct(view_.plane().size_m());
  }

  void show_counts() {
    ImageU8 shown(counts_.width, counts_.height, 1);
    std::transform(counts_.data.begin(), counts_.data.end(), shown.data.begin(), [this](float count) {
      return static_cast<std::uint8_t>(std::lround(255 * count / std::max(most_, 1.0F)));
    });
    plane_.set(shown);
  }

  void draw_panel() {
    const Panel panel(window_, "Drag on the plane: the point");
    ImGui::TextUnformatted(title_.c_str());
    ImGui::Separator();
    const Eigen::Vector3d x = view_.plane().world_from_plane * Eigen::Vector3d(point().x(), point().y(), 0);
    ImGui::TextUnformatted(fmt::format("point {:.3f} {:.3f} {:.3f} m (world)\n{} of {} frames caught light there\n"
                                       "(the best point of the plane: {:.0f})",
                                       x.x(), x.y(), x.z(), seen_.size(), view_.frames(), most_)
                               .c_str());
  }

  void draw_pictures() {
    plane_.draw(plane_box_);
    draw_caption(plane_box_, "frames that caught light at a point of the plane");
    draw_cross(plane_box_.pixel_of(position_));
    draw_caption(disc_box_, "directions caught at the point");
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    const Eigen::Vector2d middle = disc_box_.pixel_of({0.5, 0.5});
    list.AddCircleFilled({static_cast<float>(middle.x()), static_cast<float>(middle.y())},
                         0.5F * static_cast<float>(disc_box_.width), IM_COL32(32, 32, 40, 255), 96);
    constexpr float dot_px = 3;
    for (const SessionView::Seen& seen : seen_) {
      const Eigen::Vector2d dot =
          disc_box_.pixel_of(equal_area_square(seen.direction_in_plane.cast<float>()).cast<double>());
      list.AddCircleFilled({static_cast<float>(dot.x()), static_cast<float>(dot.y())}, dot_px,
                           IM_COL32(255, 220, 0, 255));
    }
  }

  Window& window_;
  std::string title_;
  SessionView view_;
  ImageF counts_;
  float most_ = 0;
  Eigen::Vector2d position_{0.5, 0.5};  // of the point in the plane's picture
  std::vector<SessionView::Seen> seen_;
  Box plane_box_, disc_box_;
  DraggedPoint drag_;
  ShownPicture plane_;
};

}  // namespace

void show_session(Window& window, SessionView view, const std::string& title) {
  SessionWindow(window, std::move(view), title).run();
}

}  // namespace mf
