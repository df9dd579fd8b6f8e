// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "common/error.h"
#include "common/session.h"
#include "host/cli/command.h"
#include "host/cli/session_files.h"
#include "host/light_field/resample.h"
#include "host/lumigraph/read_photos.h"
#include "host/viewer/layout.h"
#include "host/viewer/light_field_window.h"
#include "host/viewer/lumigraph_window.h"
#include "host/viewer/session_window.h"

namespace mf {

namespace {

struct ViewArguments {
  std::filesystem::path shown;
  double height_m = 0;
  std::filesystem::path colmap;
  std::filesystem::path transforms;
  std::string proxy = "plane";
  double scale = 1;
  std::filesystem::path path_folder = "path";
  std::vector<int> size{1280, 800};
  std::filesystem::path screenshots = ".";
};

std::string describe_field(const std::filesystem::path& file, const LightField& field) {
  const Eigen::Vector2d size = field.plane.size_m();
  return fmt::format("{}: {} directions × {}² texels over {:.2f} × {:.2f} m, focused on {}", file.filename().string(),
                     field.directions.size(), field.resolution, size.x(), size.y(),
                     surroundings_name(field.surroundings));
}

Window open_window(const ViewArguments& a, const std::string& what) {
  Window window("mirrorfield: " + what, a.size[0], a.size[1]);
  window.keep_screenshots_in(a.screenshots);
  return window;
}

void view_light_field(const ViewArguments& a) {
  LightField field = read_light_field(a.shown);
  const std::string title = describe_field(a.shown, field);
  Window window = open_window(a, a.shown.string());
  show_light_field(window, std::move(field), title);
}

void view_session(const ViewArguments& a) {
  const SessionReader session(a.shown);
  const Calibration calibration = calibration_of(session);
  const std::string file = (session.folder() / "calibration.json").string();
  if (!calibration.cam_from_world)
    throw InputError(file, "cam_from_world", "is missing: record world tags with the session and calibrate again");
  const auto plane = covered_rectangle(calibration, session.header().target, a.height_m);
  if (!plane)
    throw InputError(file, "frames",
                     fmt::format("no used frame caught light at height {} m: give another --height", a.height_m));
  SessionView view(caught_rays(calibration, session.header().target), *plane);
  const Eigen::Vector2d size = plane->size_m();
  const std::string title = fmt::format("{}: {} frames over {:.2f} × {:.2f} m at height {} m", a.shown.string(),
                                        view.frames(), size.x(), size.y(), a.height_m);
  Window window = open_window(a, a.shown.string());
  show_session(window, std::move(view), title);
}

void view_photos(const ViewArguments& a) {
  if (!(a.scale > 0 && a.scale <= 1)) throw InputError("view", "--scale", "must be above 0 and at most 1");
  const PhotoSet set = scaled(read_posed_photos(a.colmap, a.transforms), a.scale);
  Proxy proxy = make_proxy(a.proxy, set, a.colmap.empty() ? a.transforms.parent_path() : a.colmap);
  const std::string title = fmt::format("{}: {} photos, proxy {}", set.source, set.photos.size(), describe(proxy));
  LumigraphView view(Lumigraph(set, std::move(proxy), {}, progress_bar()));
  Window window = open_window(a, set.source);
  show_lumigraph(window, std::move(view), {title, a.path_folder});
}

void run(const ViewArguments& a) {
  if (a.size[0] < smallest_window_width_px || a.size[1] < smallest_window_height_px || a.size[0] > 16384 ||
      a.size[1] > 16384)
    throw InputError("view", "--size",
                     fmt::format("must be a width from {} and a height from {} to 16384 pixels",
                                 smallest_window_width_px, smallest_window_height_px));
  if (int{!a.shown.empty()} + int{!a.colmap.empty()} + int{!a.transforms.empty()} != 1)
    throw InputError("view", "",
                     "needs one thing to show: a light field, a session, --colmap FOLDER or --transforms FILE");
  if (a.shown.empty())
    view_photos(a);
  else if (std::filesystem::is_directory(a.shown))
    view_session(a);
  else
    view_light_field(a);
}

}  // namespace

void add_view_command(CommandLine& program) {
  CommandLine command =
      program.command("view", "a window into a light field, a session, or the space between posed photos");
  const auto a = std::make_shared<ViewArguments>();  // shared: the parser's callback outlives this function
  command.option("shown", a->shown, "light field (.lf.exr), or a session's folder");
  command.option("--height", a->height_m, "session: of the plane above the world's ground, metres");
  command.option("--colmap", a->colmap, "photos: folder of a COLMAP text model");
  command.option("--transforms", a->transforms, "photos: transforms.json of nerfstudio or instant-ngp");
  command.option("--proxy", a->proxy,
                 "photos: plane, plane:D, sphere:R, box, tunnel:W,H[,D] or a mesh, as for lumigraph");
  command.option("--scale", a->scale, "photos: size that they are brought to first, 0 to 1");
  command.option("--path", a->path_folder, "photos: folder for a recorded camera path, its frames and its film");
  command.values("--size", 2, a->size, "width and height of the window, pixels (1280 800)");
  command.option("--screenshots", a->screenshots, "folder into which F12 writes view_0001.png, …");
  command.on_run([a] { run(*a); });
}

}  // namespace mf
