// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <chrono>
#include <functional>
#include <memory>
#include <optional>

#include "common/error.h"
#include "common/session.h"
#include "host/cli/command.h"
#include "host/cli/session_files.h"
#include "host/cli/session_lumigraph.h"
#include "host/light_field/resample.h"
#include "host/lumigraph/read_photos.h"
#include "host/viewer/layout.h"
#include "host/viewer/light_field_window.h"
#include "host/viewer/loading.h"
#include "host/viewer/lumigraph_window.h"
#include "host/viewer/session_window.h"

namespace mf {

namespace {

struct ViewArguments {
  std::filesystem::path shown;
  double height_m = 0;
  std::filesystem::path colmap;
  std::filesystem::path transforms;
  std::filesystem::path session;
  bool scene = false;
  std::string proxy;  // empty: plane, or of a session auto
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

// What cannot be opened opens no window when that shows at once, and also not where there is no display.
template <typename T>
void load_and_show(const ViewArguments& a, const std::string& what, const std::function<T(const Progress&)>& load,
                   const std::function<void(Window&, T)>& show) {
  std::optional<T> loaded;
  Loading loading([&](const Progress& progress) { loaded.emplace(load(progress)); });
  constexpr std::chrono::milliseconds quick(200);
  const bool done = loading.ends_within(quick);
  std::optional<Window> window;
  try {
    window.emplace(open_window(a, what));
  } catch (const InputError&) {
    loading.call_off();
    throw;
  }
  if (done || show_loading(*window, loading, what)) show(*window, std::move(*loaded));
}

void view_light_field(const ViewArguments& a) {
  using Loaded = std::unique_ptr<LightFieldView>;
  load_and_show<Loaded>(
      a, a.shown.string(), [&](const Progress&) { return std::make_unique<LightFieldView>(read_light_field(a.shown)); },
      [&](Window& window, Loaded view) { show_light_field(window, *view, describe_field(a.shown, view->field())); });
}

SessionView load_session(const ViewArguments& a) {
  const SessionReader session(a.shown);
  const Calibration calibration = calibration_of(session);
  const MirrorTarget& target = session.header().target;
  const std::string file = (session.folder() / "calibration.json").string();
  const PlaneRectangle plane = chosen_rectangle(calibration, target, a.height_m, std::nullopt, file);
  return {caught_rays(calibration, target), plane};
}

void view_session(const ViewArguments& a) {
  load_and_show<SessionView>(
      a, a.shown.string(), [&](const Progress&) { return load_session(a); },
      [&](Window& window, SessionView view) {
        const Eigen::Vector2d size = view.plane().size_m();
        const std::string title = fmt::format("{}: {} frames over {:.2f} × {:.2f} m at height {} m", a.shown.string(),
                                              view.frames(), size.x(), size.y(), a.height_m);
        show_session(window, std::move(view), title);
      });
}

PhotoSet read_photos(const ViewArguments& a, const Progress& progress) {
  if (!a.session.empty()) return read_session_photos(a.session, a.scale, a.scene, progress);
  return scaled(read_posed_photos(a.colmap, a.transforms), a.scale);
}

Proxy proxy_of(const ViewArguments& a, const PhotoSet& set, const Progress& progress) {
  if (!a.session.empty()) return session_proxy(a.proxy.empty() ? "auto" : a.proxy, set, a.session, progress);
  return make_proxy(a.proxy.empty() ? "plane" : a.proxy, set, a.colmap.empty() ? a.transforms.parent_path() : a.colmap);
}

void view_photos(const ViewArguments& a) {
  if (!(a.scale > 0 && a.scale <= 1)) throw InputError("view", "--scale", "must be above 0 and at most 1");
  struct Loaded {
    LumigraphView view;
    std::string title;
  };
  const std::filesystem::path& what = !a.session.empty() ? a.session : a.colmap.empty() ? a.transforms : a.colmap;
  load_and_show<Loaded>(
      a, what.string(),
      [&](const Progress& progress) {
        const PhotoSet set = read_photos(a, progress);
        Proxy proxy = proxy_of(a, set, progress);
        std::string title = fmt::format("{}: {} photos, proxy {}", set.source, set.photos.size(), describe(proxy));
        return Loaded{LumigraphView(Lumigraph(set, std::move(proxy), {}, progress)), std::move(title)};
      },
      [&](Window& window, Loaded loaded) {
        show_lumigraph(window, std::move(loaded.view), {loaded.title, a.path_folder});
      });
}

void run(const ViewArguments& a) {
  if (a.scene && a.session.empty())
    throw InputError("view", "--scene", "is for a session's pictures: give --session FOLDER, or leave it out");
  if (a.size[0] < smallest_window_width_px || a.size[1] < smallest_window_height_px || a.size[0] > 16384 ||
      a.size[1] > 16384)
    throw InputError("view", "--size",
                     fmt::format("must be a width from {} and a height from {} to 16384 pixels",
                                 smallest_window_width_px, smallest_window_height_px));
  if (int{!a.shown.empty()} + int{!a.colmap.empty()} + int{!a.transforms.empty()} + int{!a.session.empty()} != 1)
    throw InputError("view", "",
                     "needs one thing to show: a light field, a session, --colmap FOLDER, --transforms FILE or "
                     "--session FOLDER");
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
  command.option("shown", a->shown, "light field (.lf.exr), or a session's folder: where its frames caught light");
  command.option("--height", a->height_m, "session: of the plane above the world's ground, metres");
  command.option("--colmap", a->colmap, "photos: folder of a COLMAP text model");
  command.option("--transforms", a->transforms, "photos: transforms.json of nerfstudio or instant-ngp");
  command.option("--session", a->session, "photos: what the frames of a calibrated session saw in the mirror");
  command.flag("--scene", a->scene, "with --session: its pictures without the mirror too");
  command.option("--proxy", a->proxy,
                 "photos: plane (default), plane:D, sphere:R, box, tunnel:W,H[,D] or a mesh, as for lumigraph; with "
                 "--session also auto (default) or a light field, NAME.lf.exr");
  command.option("--scale", a->scale, "photos: size that they are brought to first, 0 to 1");
  command.option("--path", a->path_folder, "photos: folder for a recorded camera path, its frames and its film");
  command.values("--size", 2, a->size, "width and height of the window, pixels (1280 800)");
  command.option("--screenshots", a->screenshots, "folder into which F12 writes view_0001.png, …");
  command.on_run([a] { run(*a); });
}

}  // namespace mf
