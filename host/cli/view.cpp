// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "common/error.h"
#include "host/cli/command.h"
#include "host/viewer/layout.h"
#include "host/viewer/light_field_window.h"

namespace mf {

namespace {

struct ViewArguments {
  std::filesystem::path field;
  std::vector<int> size{1280, 800};
  std::filesystem::path screenshots = ".";
};

std::string describe_field(const std::filesystem::path& file, const LightField& field) {
  const Eigen::Vector2d size = field.plane.size_m();
  return fmt::format("{}: {} directions × {}² texels over {:.2f} × {:.2f} m, focused on {}", file.filename().string(),
                     field.directions.size(), field.resolution, size.x(), size.y(),
                     surroundings_name(field.surroundings));
}

void run(const ViewArguments& a) {
  if (a.size[0] < smallest_window_width_px || a.size[1] < smallest_window_height_px || a.size[0] > 16384 ||
      a.size[1] > 16384)
    throw InputError("view", "--size",
                     fmt::format("must be a width from {} and a height from {} to 16384 pixels",
                                 smallest_window_width_px, smallest_window_height_px));
  LightField field = read_light_field(a.field);
  const std::string title = describe_field(a.field, field);
  Window window("mirrorfield: " + a.field.string(), a.size[0], a.size[1]);
  window.keep_screenshots_in(a.screenshots);
  show_light_field(window, std::move(field), title);
}

}  // namespace

void add_view_command(CommandLine& program) {
  CommandLine command = program.command("view", "look into a light field, or from between posed photos, in a window");
  const auto a = std::make_shared<ViewArguments>();  // shared: the parser's callback outlives this function
  command.option("field", a->field, "light field (.lf.exr)", Presence::required);
  command.values("--size", 2, a->size, "width and height of the window, pixels (1280 800)");
  command.option("--screenshots", a->screenshots, "folder into which F12 writes view_0001.png, …");
  command.on_run([a] { run(*a); });
}

}  // namespace mf
