// SPDX-License-Identifier: Apache-2.0
#include "host/viewer/drawing.h"

#include <epoxy/gl.h>
#include <imgui.h>

#include <cstdint>
#include <utility>

#include "common/check.h"

namespace mf {

Panel::Panel(const Window& window, std::string keys) : window_(window), keys_(std::move(keys)) {
  ImGui::SetNextWindowPos({0, 0});
  ImGui::SetNextWindowSize({static_cast<float>(panel_width_px), static_cast<float>(window.height())});
  ImGui::Begin("panel", nullptr, ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove);
  ImGui::PushTextWrapPos();
  constexpr float slider_width_px = 180;  // leaves room for the longest name
  ImGui::PushItemWidth(slider_width_px);
}

Panel::~Panel() {
  ImGui::Separator();
  ImGui::TextUnformatted(keys_.c_str());
  ImGui::TextUnformatted("F12: screenshot    Ctrl+Q: close");
  ImGui::TextUnformatted(window_.notice().c_str());
  ImGui::PopItemWidth();
  ImGui::PopTextWrapPos();
  ImGui::End();
}

void ShownPicture::set(const ImageU8& picture, Enlarged enlarged) {
  check(!picture.empty() && (picture.channels == 1 || picture.channels == 3), "a grey or RGB picture");
  if (texture_.name() == 0) {
    texture_ = make_texture();
    glBindTexture(GL_TEXTURE_2D, texture_.name());
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  }
  glBindTexture(GL_TEXTURE_2D, texture_.name());
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, enlarged == Enlarged::smooth ? GL_LINEAR : GL_NEAREST);
  const bool grey = picture.channels == 1;
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_SWIZZLE_G, grey ? GL_RED : GL_GREEN);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_SWIZZLE_B, grey ? GL_RED : GL_BLUE);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexImage2D(GL_TEXTURE_2D, 0, grey ? GL_R8 : GL_RGB8, picture.width, picture.height, 0, grey ? GL_RED : GL_RGB,
               GL_UNSIGNED_BYTE, picture.data.data());
}

void ShownPicture::draw(const Box& box) const {
  if (texture_.name() == 0) return;
  const auto id = reinterpret_cast<ImTextureID>(static_cast<std::uintptr_t>(texture_.name()));
  const ImVec2 corner(static_cast<float>(box.x), static_cast<float>(box.y));
  ImGui::GetBackgroundDrawList()->AddImage(
      id, corner, {corner.x + static_cast<float>(box.width), corner.y + static_cast<float>(box.height)});
}

std::optional<Eigen::Vector2d> DraggedPoint::position(const Window& window, const Box& box) {
  const auto pointer = window.pointer();
  if (pointer && box.holds(*pointer) && ImGui::IsMouseClicked(ImGuiMouseButton_Left)) dragged_ = true;
  if (!ImGui::IsMouseDown(ImGuiMouseButton_Left)) dragged_ = false;
  if (!pointer || !dragged_) return std::nullopt;
  return box.position_of(*pointer);
}

void draw_caption(const Box& picture, const std::string& text) {
  constexpr int text_height_px = 18;
  ImGui::GetBackgroundDrawList()->AddText(
      {static_cast<float>(picture.x), static_cast<float>(picture.y - text_height_px)},
      ImGui::GetColorU32(ImGuiCol_Text), text.c_str());
}

void draw_cross(const Eigen::Vector2d& pixel) {
  constexpr float arm = 9, gap = 3;
  const auto x = static_cast<float>(pixel.x()), y = static_cast<float>(pixel.y());
  ImDrawList& list = *ImGui::GetBackgroundDrawList();
  for (const auto& [colour, width] : {std::pair{IM_COL32(0, 0, 0, 255), 3.0F}, {IM_COL32(255, 220, 0, 255), 1.0F}})
    for (const float sign : {-1.0F, 1.0F}) {
      list.AddLine({x + sign * gap, y}, {x + sign * arm, y}, colour, width);
      list.AddLine({x, y + sign * gap}, {x, y + sign * arm}, colour, width);
    }
}

}  // namespace mf
