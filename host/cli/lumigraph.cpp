// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/lumigraph.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <nlohmann/json.hpp>

#include "common/atomic_file.h"
#include "common/error.h"
#include "common/json_file.h"
#include "common/seconds_since.h"
#include "host/cli/command.h"
#include "host/cli/session_lumigraph.h"
#include "host/gl/backend.h"
#include "host/io/image_file.h"
#include "host/lumigraph/camera_path.h"
#include "host/lumigraph/leave_one_out.h"
#include "host/lumigraph/path_times.h"
#include "host/lumigraph/picture_file.h"
#include "host/lumigraph/read_photos.h"
#include "host/lumigraph/two_plane.h"
#include "host/lumigraph/visual_hull.h"

namespace mf {

namespace {

namespace fs = std::filesystem;

struct LumigraphArguments {
  fs::path colmap;
  fs::path transforms;
  fs::path session;
  bool scene = false;
  std::string proxy;
  fs::path save_proxy;
  std::optional<double> mask_below;
  fs::path camera_path;
  std::string two_plane;
  std::optional<double> st_distance;
  fs::path output;
  bool leave_one_out = false;
  std::string backend = "cpu";
  bool json = false;
  double scale = 1;
  int k = LumigraphOptions{}.penalty.k;
  double angle = LumigraphOptions{}.penalty.angle;
  double resolution = LumigraphOptions{}.penalty.resolution;
  double gamma = LumigraphOptions{}.penalty.border;
  double border = LumigraphOptions{}.border;
  double tolerance = VisibilityOptions{}.tolerance;
  double silhouette = VisibilityOptions{}.silhouette;
  std::optional<double> time;
  std::optional<double> period;
  double time_penalty = 4;  // per period: of photos an eighth of it away, as much as half a radian
};

// Nothing when no time is asked for.
std::optional<Moment> wanted_moment(const LumigraphArguments& a, const PhotoSet& set, bool path_has_times) {
  if (!a.time && !a.period && !path_has_times) return std::nullopt;
  Moment moment = moment_of(set, a.period, a.time_penalty);
  if (a.time) moment.time_s = *a.time;
  if (const auto wrong = moment.validate()) throw InputError("lumigraph", "", *wrong);
  return moment;
}

LumigraphOptions options_of(const LumigraphArguments& a, const PhotoSet& set, bool path_has_times = false) {
  LumigraphOptions options;
  options.penalty = {a.k, static_cast<float>(a.angle), static_cast<float>(a.resolution), static_cast<float>(a.gamma)};
  options.border = static_cast<float>(a.border);
  options.moment = wanted_moment(a, set, path_has_times);
  if (const auto wrong = options.validate()) throw InputError("lumigraph", "", *wrong);
  return options;
}

VisibilityOptions visibility_of(const LumigraphArguments& a) {
  const VisibilityOptions options{static_cast<float>(a.tolerance), static_cast<float>(a.silhouette)};
  if (const auto wrong = options.validate()) throw InputError("lumigraph", "", *wrong);
  return options;
}

PhotoSet read_photos(const LumigraphArguments& a) {
  if ((a.colmap.empty() ? 0 : 1) + (a.transforms.empty() ? 0 : 1) + (a.session.empty() ? 0 : 1) != 1)
    throw InputError("lumigraph", "",
                     "needs photos: give one of --colmap FOLDER, --transforms FILE and --session FOLDER");
  if (!(a.scale > 0 && a.scale <= 1)) throw InputError("lumigraph", "--scale", "must be above 0 and at most 1");
  if (a.scene && a.session.empty())
    throw InputError("lumigraph", "--scene", "is for a session's pictures: give --session FOLDER, or leave it out");
  if (!a.session.empty()) return read_session_photos(a.session, a.scale, a.scene, progress_bar());
  PhotoSet set = read_posed_photos(a.colmap, a.transforms);
  if (a.mask_below) mask_dark_background(set, static_cast<float>(*a.mask_below));
  return scaled(std::move(set), a.scale);
}

Proxy proxy_of(const LumigraphArguments& a, const PhotoSet& set) {
  Proxy proxy = a.session.empty() ? make_proxy(a.proxy.empty() ? "plane" : a.proxy, set,
                                               a.colmap.empty() ? a.transforms.parent_path() : a.colmap)
                                  : session_proxy(a.proxy.empty() ? "auto" : a.proxy, set, a.session, progress_bar());
  if (a.save_proxy.empty()) return proxy;
  const auto* mesh = std::get_if<MeshProxy>(&proxy);
  if (mesh == nullptr)
    throw InputError("lumigraph", "--save-proxy", "saves a mesh: give --proxy hull, or a session's auto");
  write_obj(a.save_proxy, mesh->mesh);
  return proxy;
}

// |a − b| around mid-grey for codes; plain difference for linear pictures.
Picture difference_of(const Picture& a, const Picture& b, const ImageU8& where) {
  return std::visit(
      [&]<typename T>(const Image<T>& x) -> Picture {
        const auto& y = std::get<Image<T>>(b);
        Image<T> out(x.width, x.height, 3);
        for (std::size_t i = 0; i < out.data.size(); ++i) {
          if (where.data[i / 3] == 0) continue;
          if constexpr (std::is_integral_v<T>)
            out.data[i] = static_cast<T>(std::clamp(128 + x.data[i] - y.data[i], 0, 255));
          else
            out.data[i] = x.data[i] - y.data[i];
        }
        return out;
      },
      a);
}

void run_leave_one_out(const LumigraphArguments& a, const PhotoSet& set, const FrameRenderer& renderer,
                       std::chrono::steady_clock::time_point start) {
  const LumigraphOptions options = options_of(a, set);
  if (!a.output.empty()) make_folder(a.output);
  const LeaveOneOut result = leave_one_out(
      renderer, set, options,
      [&](const LeftOutView& view, const LeftOutPictures& pictures) {
        if (a.output.empty()) return;
        const fs::path stem = a.output / fs::path(view.name).filename().stem();
        write_picture(stem, pictures.foretold.picture);
        write_picture(stem.string() + "_difference",
                      difference_of(pictures.foretold.picture, pictures.photo, pictures.foretold.covered));
      },
      progress_bar());
  nlohmann::json summary{{"psnr_db", result.psnr_db},
                         {"nearest_view_psnr_db", result.nearest_view_psnr_db},
                         {"ssim", result.ssim},
                         {"backend", renderer.description()},
                         {"proxy", describe(renderer.lumigraph().proxy())},
                         {"seconds", seconds_since(start)},
                         {"views", nlohmann::json::array()}};
  std::string text;
  for (const LeftOutView& view : result.views) {
    summary["views"].push_back({{"name", view.name},
                                {"psnr_db", view.psnr_db},
                                {"ssim", view.ssim},
                                {"nearest_view_psnr_db", view.nearest_view_psnr_db},
                                {"covered", view.covered}});
    text += fmt::format("{}: {:.2f} dB, SSIM {:.4f}, nearest view {:.2f} dB\n", view.name, view.psnr_db, view.ssim,
                        view.nearest_view_psnr_db);
  }
  text += fmt::format("mean {:.2f} dB, SSIM {:.4f}, nearest view {:.2f} dB; {:.1f} s\n", result.psnr_db, result.ssim,
                      result.nearest_view_psnr_db, seconds_since(start));
  print_summary(a.json, summary, text);
}

// "8,8": so many cameras on planes that fit; else the file of a layout.
TwoPlane two_plane_of(const LumigraphArguments& a, const PhotoSet& set, const Lumigraph& lumigraph) {
  std::array<int, 2> cameras{};
  const char* const end = a.two_plane.data() + a.two_plane.size();
  const auto columns = std::from_chars(a.two_plane.data(), end, cameras[0]);
  if (columns.ec == std::errc() && columns.ptr != end && *columns.ptr == ',') {
    const auto rows = std::from_chars(columns.ptr + 1, end, cameras[1]);
    if (rows.ec == std::errc() && rows.ptr == end) return fitted_two_plane(lumigraph, set, cameras, a.st_distance);
  }
  if (!fs::is_regular_file(a.two_plane))
    throw InputError("--two-plane", a.two_plane, "is neither U,V (cameras each way) nor the file of a layout");
  if (a.st_distance) throw InputError("lumigraph", "--st-distance", "is the layout's, st_distance_m: change it there");
  return two_plane_from_json(read_json_file(a.two_plane), a.two_plane);
}

void run_two_plane(const LumigraphArguments& a, const PhotoSet& set, const FrameRenderer& renderer,
                   std::chrono::steady_clock::time_point start) {
  const Lumigraph& lumigraph = renderer.lumigraph();
  if (a.output.empty()) throw InputError("lumigraph", "--output", "is missing: name a folder for the light field");
  if (a.st_distance && !(*a.st_distance > 0)) throw InputError("lumigraph", "--st-distance", "must be above 0");
  const TwoPlane planes = two_plane_of(a, set, lumigraph);
  const TwoPlaneSummary written = write_two_plane(a.output, renderer, planes, options_of(a, set), progress_bar());
  const fs::path transforms = a.output / "transforms.json";
  print_summary(
      a.json,
      {{"pictures", written.pictures},
       {"covered", written.covered},
       {"layout", to_json(planes)},
       {"backend", renderer.description()},
       {"proxy", describe(lumigraph.proxy())},
       {"photos", lumigraph.sources().size()},
       {"transforms", transforms.string()},
       {"seconds", seconds_since(start)}},
      fmt::format(
          "{} × {} cameras over {:.3g} × {:.3g} m, pictures {} × {} of a window {:.3g} × {:.3g} m at "
          "{:.4g} m, {:.0f} % covered; {:.1f} s\nopen it: mirrorfield view --transforms {} --proxy plane:{:.6g}\n",
          planes.cameras[0], planes.cameras[1], planes.uv_size_m.x(), planes.uv_size_m.y(), planes.size_px[0],
          planes.size_px[1], planes.st_size_m.x(), planes.st_size_m.y(), planes.st_distance_m, 100 * written.covered,
          seconds_since(start), transforms.string(), planes.st_distance_m));
}

// A frame that shows nothing is a mistake of the path or the proxy, not a black picture.
void check_shows_something(const LumigraphPicture& frame, std::size_t number, const LumigraphArguments& a) {
  const auto& covered = frame.covered.data;
  if (std::any_of(covered.begin(), covered.end(), [](std::uint8_t c) { return c != Covered::nothing; })) return;
  throw InputError(a.camera_path.string(), fmt::format("frame {}", number),
                   "shows nothing that the photos show: move it to where they look, or give another --proxy");
}

void run_camera_path(const LumigraphArguments& a, const PhotoSet& set, const FrameRenderer& renderer,
                     std::chrono::steady_clock::time_point start) {
  const Lumigraph& lumigraph = renderer.lumigraph();
  if (a.output.empty()) throw InputError("lumigraph", "--output", "is missing: name a folder for the frames");
  const std::vector<View> views = read_camera_path(a.camera_path);
  const std::vector<double> times = a.time ? std::vector<double>{} : read_path_times(a.camera_path);
  LumigraphOptions options = options_of(a, set, !times.empty());
  const Progress progress = progress_bar();
  double render_s = 0;
  std::string extension;
  for (std::size_t i = 0; i < views.size(); ++i) {
    report_progress(progress, "frames", static_cast<double>(i) / static_cast<double>(views.size()));
    const auto before = std::chrono::steady_clock::now();
    if (!times.empty()) options.moment->time_s = times[i];
    const LumigraphPicture frame = renderer.render(views[i], options);
    render_s += seconds_since(before);
    check_shows_something(frame, i, a);
    make_folder(a.output);
    extension = write_picture(a.output / fmt::format("{:05}", i), frame.picture).extension();
  }
  report_progress(progress, "frames", 1);
  const double per_second = static_cast<double>(views.size()) / render_s;
  const std::string pattern = (a.output / ("%05d" + extension)).string();
  print_summary(a.json,
                {{"frames", views.size()},
                 {"frames_per_second", per_second},
                 {"backend", renderer.description()},
                 {"proxy", describe(lumigraph.proxy())},
                 {"photos", lumigraph.sources().size()},
                 {"pictures", pattern},
                 {"seconds", seconds_since(start)}},
                fmt::format("{} frames from {} photos, {:.1f} a second; proxy: {}\n{}\n"
                            "a video: ffmpeg -framerate 30 -i {} -pix_fmt yuv420p {}.mp4\n",
                            views.size(), lumigraph.sources().size(), per_second, describe(lumigraph.proxy()), pattern,
                            pattern, (a.output.parent_path() / a.output.stem()).string()));
}

// Some photo must see the proxy somewhere: looked at on a grid of its picture.
void check_proxy_is_seen(const Lumigraph& lumigraph, const LumigraphArguments& a) {
  constexpr int steps = 8;
  for (const Lumigraph::Source& source : lumigraph.sources())
    for (int i = 0; i < steps * steps; ++i) {
      const int column = i % steps, row = i / steps;
      const Eigen::Vector2d pixel((column + 0.5) / steps * source.camera.width,
                                  (row + 0.5) / steps * source.camera.height);
      if (lumigraph.point_at({source.camera, source.cam_from_world}, pixel)) return;
    }
  throw InputError("--proxy", a.proxy,
                   "lies behind the photos or beside what they show: is it in the frame of their poses?");
}

void run(LumigraphArguments& a) {
  const auto start = std::chrono::steady_clock::now();
  if ((a.leave_one_out ? 1 : 0) + (a.camera_path.empty() ? 0 : 1) + (a.two_plane.empty() ? 0 : 1) != 1)
    throw InputError("lumigraph", "",
                     "needs a task: give one of --camera-path FILE, --two-plane U,V and --leave-one-out");
  const auto backend = parse_backend(a.backend);
  if (!backend) throw InputError("lumigraph", "--backend", "'" + a.backend + "' is none: use auto, gl or cpu");
  std::optional<EglContext> context = open_backend(*backend);
  const PhotoSet set = read_photos(a);
  const Lumigraph lumigraph(set, proxy_of(a, set), visibility_of(a), progress_bar());
  check_proxy_is_seen(lumigraph, a);
  const FrameRenderer renderer(lumigraph, std::move(context));
  if (a.leave_one_out)
    run_leave_one_out(a, set, renderer, start);
  else if (!a.two_plane.empty())
    run_two_plane(a, set, renderer, start);
  else
    run_camera_path(a, set, renderer, start);
}

}  // namespace

void add_lumigraph_command(CommandLine& program) {
  CommandLine command = program.command("lumigraph", "new views from posed photos and a rough shape");
  const auto a = std::make_shared<LumigraphArguments>();  // shared: the parser's callback outlives this function
  command.option("--colmap", a->colmap, "folder of a COLMAP text model and its photos");
  command.option("--transforms", a->transforms, "transforms.json of nerfstudio or instant-ngp");
  command.option("--session", a->session, "folder of a calibrated session: what its frames saw in the mirror");
  command.flag("--scene", a->scene, "with --session: its pictures without the mirror too");
  command.option(
      "--proxy", a->proxy,
      "plane (default), plane:D, sphere:R, box, box:x0,y0,z0,x1,y1,z1, tunnel:W,H[,D], hull[:N] or a mesh; with "
      "--session also auto (default) or a light field, NAME.lf.exr");
  command.option("--save-proxy", a->save_proxy,
                 "OBJ file for a proxy that was found: a hull, a session's surroundings");
  command.option("--mask-below", a->mask_below,
                 "photos without a mask: pixels whose channels are all at most this are background");
  command.option("--camera-path", a->camera_path,
                 "JSON of the views to make: a list of views, or key frames (docs/lumigraph.md)");
  command.flag("--leave-one-out", a->leave_one_out, "foretell every photo from the others, and say how well");
  command.option("--two-plane", a->two_plane,
                 "write a two-plane light field: U,V (cameras each way), or the file of a layout");
  command.option("--st-distance", a->st_distance,
                 "with --two-plane U,V: metres between the planes (default: where the proxy is)");
  command.option("-o,--output", a->output, "folder for the pictures");
  command.option("--backend", a->backend, "cpu (default), gl, or auto: gl on a graphics card, else cpu");
  command.option("-k", a->k, "photos that speak for a ray");
  command.option("--angle", a->angle, "α: penalty per radian between the wanted ray and the photo's");
  command.option("--resolution", a->resolution, "β: penalty per octave by which the photo is coarser than wanted");
  command.option("--gamma", a->gamma, "γ: how strongly photos are shunned at their borders and where half hidden");
  command.option("--border", a->border, "width of a photo's soft border, as a fraction of its shorter side");
  command.option("--tolerance", a->tolerance, "depth, relative, by which a point may lie behind what a photo sees");
  command.option("--silhouette", a->silhouette, "pixels at jumps of its depth where a photo is not trusted");
  command.option("--time", a->time, "time of the new views, seconds: photos taken at another time are shunned");
  command.option("--period", a->period, "seconds after which the scene's motion comes again");
  command.option("--time-penalty", a->time_penalty, "τ: penalty per period by which a photo was taken at another time");
  command.option("--scale", a->scale, "size that photos are brought to first, 0 to 1");
  add_json_flag(command, a->json);
  command.on_run([a] { run(*a); });
}

}  // namespace mf
