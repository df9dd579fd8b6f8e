// SPDX-License-Identifier: Apache-2.0
#include "host/viewer/loading.h"

#include <fmt/format.h>
#include <imgui.h>

#include <utility>

#include "common/error.h"
#include "host/viewer/drawing.h"

namespace mf {

namespace {

// What ends work that was called off, from within its report of progress.
struct CalledOff {};

// One frame of a window without a picture: a word where the picture will be, the rest in the panel. False: it was
// closed.
bool show_text(Window& window, const std::string& word, const std::string& text) {
  if (!window.begin_frame()) return false;
  {
    const Panel panel(window, "");
    ImGui::TextUnformatted(text.c_str());
  }
  const Box room = picture_room(window.width(), window.height());
  draw_caption({room.x + room.width / 2, room.y + room.height / 2, 0, 0}, word);
  window.end_frame();
  return true;
}

}  // namespace

Loading::Loading(Work work)
    : future_(std::async(std::launch::async, [this, work = std::move(work)] {
        try {
          work([this](std::string_view stage, double fraction) { report(stage, fraction); });
        } catch (const CalledOff&) {  // as asked
        }
      })) {}

Loading::~Loading() {
  const std::lock_guard lock(mutex_);
  called_off_ = true;
}

bool Loading::ends_within(std::chrono::milliseconds time) {
  if (!future_.valid()) return true;
  if (future_.wait_for(time) != std::future_status::ready) return false;
  future_.get();
  return true;
}

void Loading::call_off() {
  {
    const std::lock_guard lock(mutex_);
    called_off_ = true;
  }
  if (future_.valid()) future_.get();
}

std::string Loading::stage() const {
  const std::lock_guard lock(mutex_);
  return stage_;
}

void Loading::report(std::string_view stage, double fraction) {
  const std::lock_guard lock(mutex_);
  if (called_off_) throw CalledOff();
  stage_ = fmt::format("{}, {:.0f} %", stage, 100 * fraction);
}

bool show_loading(Window& window, Loading& loading, const std::string& what) {
  try {
    while (!loading.ends_within({}))
      if (!show_text(window, "loading ...", fmt::format("{}\n{}", what, loading.stage()))) return false;
  } catch (const InputError& e) {
    while (show_text(window, "cannot be shown", e.what())) {
    }
    throw;
  }
  return true;
}

}  // namespace mf
