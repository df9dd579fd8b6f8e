// SPDX-License-Identifier: Apache-2.0
//
// What the blending's parameters and the proxies are worth, without any truth but the capture itself: each of some
// views is left out, and what it saw is predicted from all others. Prints tables; the defaults of ResampleOptions come
// from them.
//
//   bench_leave_one_out [SESSION]      a calibrated session; without one the path-traced desk capture is imported
//
// A left-out view's pixel is a ray: from its virtual centre, wanted at the point p where it crosses the light-field
// plane. The others answer as they do for a texel of the field. The error is that of log2 luminance over a footprint of
// 0.9° (a part of a cell at 2500 directions) or 0.25° (the panorama's), noise of the left-out pixel included. Proxies
// are searched without the left-out views. Rays near emitters are left out: the field does not blend those (docs/
// light_field.md, "Emitters").
//
// The real mirror: five photos of a board in five poses of one mirror (shared/data/mirror_board). The board is the
// surroundings; rays are wanted at the left-out view's own centre. Photos are scaled to the same median.
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <numeric>
#include <random>
#include <sstream>

#if MF_HAVE_OPENCV
#include <opencv2/imgcodecs.hpp>
#endif

#include "common/homography.h"
#include "common/luminance.h"
#include "host/calibration/calibration.h"
#include "host/io/mesh.h"
#include "host/light_field/emitters.h"
#include "host/light_field/proxy_choice.h"
#include "host/light_field/ray_answer.h"
#include "host/light_field/resample.h"
#include "host/tracing/ray_scene.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_folder.h"

namespace mf {
namespace {

namespace fs = std::filesystem;

constexpr int every = 10;  // one view in so many is left out
constexpr int rays_per_view = 200;
constexpr float part_rad = 0.0158F;
constexpr float detail_rad = 0.0045F;

struct LeftOutRay {
  std::uint32_t view = 0;
  WantedRay ray;
  float log2_seen = 0;
};

struct Score {
  double median_stop = 0;
  double rms_stop = 0;  // an error counts for 3 stops at most
  double psnr_db = 0;   // of a display picture: exposed for its brightest 3 %, gamma 2.2
  double answered = 0;
};

float log2_luminance(const Eigen::Vector3f& c) {
  return std::log2(std::max(luminance_of(c), 1e-4F));
}

Score score_of(const std::vector<FieldView>& views, const Surroundings& surroundings,
               const std::vector<LeftOutRay>& rays, AnswerOptions options) {
  constexpr float unanswered = 1e9F;
  std::vector<float> predicted(rays.size(), unanswered);
  tbb::parallel_for(std::size_t{0}, rays.size(), [&](std::size_t i) {
    AnswerOptions except = options;
    except.except = rays[i].view;
    const RayAnswer answer = answer_of(views, surroundings, rays[i].ray, except);
    if (!answer.speaking.empty()) predicted[i] = log2_luminance(answer.radiance);
  });
  std::vector<float> errors, seen;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    seen.push_back(rays[i].log2_seen);
    if (predicted[i] != unanswered) errors.push_back(std::abs(predicted[i] - rays[i].log2_seen));
  }
  const auto bright = seen.begin() + static_cast<std::ptrdiff_t>(0.97 * static_cast<double>(seen.size()));
  std::nth_element(seen.begin(), bright, seen.end());
  const float exposure = 0.9F / std::exp2(*bright);
  const auto shown = [&](float log2) { return std::pow(std::min(exposure * std::exp2(log2), 1.0F), 1 / 2.2F); };
  double display = 0, stops = 0;
  for (std::size_t i = 0; i < rays.size(); ++i)
    if (predicted[i] != unanswered)
      display += std::pow(static_cast<double>(shown(predicted[i]) - shown(rays[i].log2_seen)), 2);
  for (const float e : errors) stops += std::pow(std::min(static_cast<double>(e), 3.0), 2);
  const auto n = static_cast<double>(errors.size());
  const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
  std::nth_element(errors.begin(), middle, errors.end());
  return {static_cast<double>(*middle), std::sqrt(stops / n), 10 * std::log10(n / display),
          n / static_cast<double>(rays.size())};
}

void print_row(const std::string& name, const Score& part, const Score& detail) {
  fmt::print("| {:<34} | {:.4f} | {:.3f} | {:.2f} | {:.4f} | {:.3f} | {:.2f} | {:.3f} |\n", name, part.median_stop,
             part.rms_stop, part.psnr_db, detail.median_stop, detail.rms_stop, detail.psnr_db, part.answered);
  std::fflush(stdout);
}

void print_head(const std::string& title) {
  fmt::print(
      "\n{}\n| | 0.9°: median, stop | RMS | PSNR, dB | 0.25°: median | RMS | PSNR | answered "
      "|\n|---|---|---|---|---|---|---|---|\n",
      title);
}

bool near_emitter(const std::vector<Emitter>& emitters, const WantedRay& ray) {
  return std::any_of(emitters.begin(), emitters.end(), [&](const Emitter& e) {
    constexpr float reach_m = 0.15F;
    const Eigen::Vector3f to = e.position - ray.p;
    return to.dot(ray.direction) > 0 && to.cross(ray.direction).norm() < e.radius_m + reach_m;
  });
}

// Rays of every tenth view, well inside of its opening, that cross the rectangle.
std::vector<LeftOutRay> left_out_rays(const std::vector<FieldView>& views, const PlaneRectangle& rectangle,
                                      const std::vector<Emitter>& emitters, float angle_rad) {
  std::mt19937 random(5);
  std::vector<LeftOutRay> rays;
  const float height = static_cast<float>(rectangle.world_from_plane.translation.z());
  for (std::uint32_t v = 0; v < views.size(); v += every) {
    const FieldView& view = views[v];
    const Eigen::Matrix3f ray_from_pixel = Eigen::Matrix3f(view.pixel_from_world.leftCols<3>()).inverse();
    std::uniform_real_distribution<float> x(0, static_cast<float>(view.levels[0].width()));
    std::uniform_real_distribution<float> y(0, static_cast<float>(view.levels[0].height()));
    int found = 0;
    for (int i = 0; i < 20 * rays_per_view && found < rays_per_view; ++i) {
      const Eigen::Vector3f pixel(x(random), y(random), 1);
      const Eigen::Vector3f d = (ray_from_pixel * pixel).normalized();
      constexpr float lowest = 0.15F;
      if (d.z() < lowest) continue;
      const Eigen::Vector3f p = view.centre_in_world + (height - view.centre_in_world.z()) / d.z() * d;
      const Eigen::Vector2d in_plane = p.head<2>().cast<double>();
      if ((in_plane.array() < rectangle.min_m.array()).any() || (in_plane.array() > rectangle.max_m.array()).any())
        continue;
      const ProxyPoint distant = proxy_point(p, d, 0);
      const Eigen::Vector4f seen = view.fetch(level_for_angle(view, distant, angle_rad), pixel.x(), pixel.y());
      constexpr float clear = 0.9F;
      const WantedRay ray{p, d, angle_rad};
      if (seen.w() < clear || near_emitter(emitters, ray)) continue;
      rays.push_back({v, ray, log2_luminance(seen.head<3>() / seen.w())});
      ++found;
    }
  }
  return rays;
}

// Both footprints.
struct Experiment {
  const std::vector<FieldView>& views;
  std::vector<LeftOutRay> part, detail;
  std::vector<Emitter> emitters;
  PlaneRectangle rectangle;

  void row(const std::string& name, const Surroundings& s, const PenaltyOptions& penalty,
           bool visibility = true) const {
    std::vector<ShadedEmitter> unmasked;
    for (const Emitter& emitter : emitters) unmasked.emplace_back().emitter = emitter;
    const EmitterBlender blender(views, s, unmasked, EmitterBlender::Lit::no);
    const ProxyVisibility seen_past(views, s, rectangle);
    const AnswerOptions options{penalty, visibility ? &seen_past : nullptr, &blender, {}};
    print_row(name, score_of(views, s, part, options), score_of(views, s, detail, options));
  }
};

constexpr PenaltyOptions usual{6, 1, 0, 1};

void vary_blending(const Experiment& e, const std::string& name, const Surroundings& s) {
  print_head(name + ", one parameter at a time from k = 6, α = 1, β = 0, γ = 1");
  for (const int k : {1, 2, 3, 4, 6, 8, 12, 16}) e.row(fmt::format("k {}", k), s, {k, 1, 0, 1});
  for (const float border : {0.25F, 0.5F, 2.0F, 4.0F}) e.row(fmt::format("γ {}", border), s, {usual.k, 1, 0, border});
  for (const float resolution : {0.01F, 0.05F, 0.2F})
    e.row(fmt::format("β {} m an octave", resolution), s, {usual.k, 1, resolution, 1});
  e.row("α 0, β 1: resolution alone", s, {usual.k, 0, 1, 1});
  e.row("without visibility", s, usual, false);
}

void mirror_capture(const fs::path& folder) {
  const SessionReader session(folder);
  const Calibration calibration = read_calibration(folder / "calibration.json");
  const std::vector<FieldView> views =
      load_field_views(session, read_response_curve(folder / "response.json"), calibration, {}, {});
  const auto rectangle = covered_rectangle(calibration, session.header().target, 0);
  if (!rectangle) throw std::runtime_error("no view looks through the plane");
  std::vector<FieldView> others;
  for (std::size_t i = 0; i < views.size(); ++i)
    if (i % every != 0) others.push_back(views[i]);
  const std::vector<Emitter> emitters = find_emitters(others);
  const Experiment e{views, left_out_rays(views, *rectangle, emitters, part_rad),
                     left_out_rays(views, *rectangle, emitters, detail_rad), emitters, *rectangle};
  fmt::print("{}: {} views, {} and {} rays\n", folder.string(), views.size(), e.part.size(), e.detail.size());
  print_head("Proxies, k = 6 (plane 15)");
  e.row("plane", {}, {15, 1, 0, 1});
  for (const std::string proxy : {"sphere:inf", "sphere", "box", "auto"}) {
    const ProxyChoice choice = choose_proxy(others, *rectangle, proxy, usual.k, emitters, Team());
    e.row(proxy == "auto" ? proxy : surroundings_name(choice.surroundings), choice.surroundings, usual);
    if (proxy == "auto") vary_blending(e, "auto", choice.surroundings);
    if (proxy == "sphere:inf") vary_blending(e, "distant sphere", choice.surroundings);
  }
}

// ---- a real mirror ----

#if MF_HAVE_OPENCV

// Between spaces, line ends or commas.
std::vector<double> numbers_in(const fs::path& file) {
  std::ifstream in(file);
  std::string text{std::istreambuf_iterator<char>(in), {}};
  std::replace(text.begin(), text.end(), ',', ' ');
  std::istringstream words(text);
  return {std::istream_iterator<double>(words), {}};
}

// A photo as a view: pose from the homography of the board's corners. Seen in a mirror, so the frame's handedness is
// reversed; that all views share it is enough here. Metres.
std::optional<FieldView> board_view(const fs::path& folder, int number, const Eigen::Matrix3d& k,
                                    const std::vector<double>& model) {
  const cv::Mat photo = cv::imread((folder / fmt::format("input{}.jpg", number)).string(), cv::IMREAD_COLOR);
  const std::vector<double> corners = numbers_in(folder / fmt::format("input{}.txt", number));
  const std::size_t count = std::min(corners.size() / 2, model.size() / 3);
  if (photo.empty() || count < 4) return std::nullopt;
  std::vector<Eigen::Vector2d> on_board, in_photo;
  for (std::size_t i = 0; i < count; ++i) {
    on_board.emplace_back(1e-3 * model[3 * i], 1e-3 * model[3 * i + 1]);
    in_photo.emplace_back(corners[2 * i], corners[2 * i + 1]);
  }
  const auto photo_from_board = fit_homography(on_board, in_photo);
  if (!photo_from_board) return std::nullopt;
  Eigen::Matrix3d b = k.inverse() * photo_from_board->matrix;
  b *= 2 / (b.col(0).norm() + b.col(1).norm());
  if (b(2, 2) < 0) b = -b;
  Eigen::Matrix<double, 3, 4> pose;
  pose << b.col(0), b.col(1), -b.col(0).cross(b.col(1)), b.col(2);
  FieldView view;
  view.pixel_from_world = (k * pose).cast<float>();
  view.centre_in_world = (-pose.leftCols<3>().inverse() * pose.col(3)).cast<float>();
  view.focal_px = static_cast<float>(k(0, 0));
  std::vector<Eigen::Vector4f> texels(static_cast<std::size_t>(photo.rows) * static_cast<std::size_t>(photo.cols));
  for (int y = 0; y < photo.rows; ++y)
    for (int x = 0; x < photo.cols; ++x) {
      const cv::Vec3b bgr = photo.at<cv::Vec3b>(y, x);
      const auto linear = [](unsigned char code) { return std::pow(static_cast<float>(code) / 255, 2.2F); };
      const float edge = static_cast<float>(std::min({x, y, photo.cols - 1 - x, photo.rows - 1 - y})) / 24;
      const float a = std::clamp(edge, 0.0F, 1.0F);
      texels[static_cast<std::size_t>(y) * static_cast<std::size_t>(photo.cols) + static_cast<std::size_t>(x)]
          << a * Eigen::Vector3f(linear(bgr[2]), linear(bgr[1]), linear(bgr[0])),
          a;
    }
  view.levels = make_levels(photo.cols, photo.rows, texels);
  return view;
}

// Rays to random points of the board, from each view's own centre; and each view scaled to the same median there.
std::vector<LeftOutRay> board_rays(std::vector<FieldView>& views, const Eigen::Vector2f& size_m, float patch_m) {
  std::vector<LeftOutRay> rays;
  for (std::uint32_t v = 0; v < views.size(); ++v) {
    std::mt19937 random(7);  // the same points in every view
    std::uniform_real_distribution<float> share(0, 1);
    std::vector<LeftOutRay> own;
    for (int i = 0; i < 4000; ++i) {
      const Eigen::Vector3f x(share(random) * size_m.x(), share(random) * size_m.y(), 0);
      const Eigen::Vector3f to = x - views[v].centre_in_world;
      const WantedRay ray{views[v].centre_in_world, to.normalized(), patch_m / to.norm()};
      const ProxyPoint point = proxy_point(ray.p, ray.direction, 1 / to.norm());
      const Eigen::Vector3f pixel = pixel_of(views[v], point);
      const Eigen::Vector4f seen =
          views[v].fetch(level_for_angle(views[v], point, ray.angle_rad), pixel.x() / pixel.z(), pixel.y() / pixel.z());
      if (pixel.z() > 0 && seen.w() > 0.9F) own.push_back({v, ray, log2_luminance(seen.head<3>() / seen.w())});
    }
    if (own.empty()) continue;
    const auto middle = own.begin() + static_cast<std::ptrdiff_t>(own.size() / 2);
    std::nth_element(own.begin(), middle, own.end(),
                     [](const LeftOutRay& a, const LeftOutRay& b) { return a.log2_seen < b.log2_seen; });
    const float median = middle->log2_seen, gain = std::exp2(-median);
    for (PremultipliedImage& level : views[v].levels)
      for (int y = 0; y < level.height(); ++y)
        for (int x = 0; x < level.width(); ++x) {
          Eigen::Vector4f texel = level.at(x, y);
          texel.head<3>() *= gain;
          level.set(x, y, texel);
        }
    for (LeftOutRay& ray : own) {
      ray.log2_seen -= median;
      rays.push_back(ray);
    }
  }
  return rays;
}

void real_mirror(const fs::path& folder) {
  const std::vector<double> k_rows = numbers_in(folder / "camera.txt"), model = numbers_in(folder / "model.txt");
  if (k_rows.size() < 9 || model.size() < 12) return fmt::print("\nno real mirror at {}\n", folder.string());
  Eigen::Matrix3d k;
  for (int i = 0; i < 9; ++i) k(i / 3, i % 3) = k_rows[static_cast<std::size_t>(i)];
  std::vector<FieldView> views;
  for (int number = 1; number <= 5; ++number)
    if (auto view = board_view(folder, number, k, model)) views.push_back(std::move(*view));
  Eigen::Vector2f size = Eigen::Vector2f::Zero();
  for (std::size_t i = 0; i + 2 < model.size(); i += 3)
    size = size.cwiseMax(1e-3F * Eigen::Vector2f(static_cast<float>(model[i]), static_cast<float>(model[i + 1])));
  TriangleMesh board;
  const auto corner = [&](float x, float y) { board.positions.emplace_back(x * size.x(), y * size.y(), 0.0F); };
  corner(-1, -1), corner(2, -1), corner(2, 2), corner(-1, 2);
  board.triangles = {{0, 1, 2}, {0, 2, 3}};
  const Surroundings s = mesh_surroundings({0, 0, -1}, std::make_shared<const RayScene>(board), "board");
  Experiment e{views, {}, {}, {}, {}};
  e.part = board_rays(views, size, 0.005F);    // medians are made alike here
  e.detail = board_rays(views, size, 0.001F);  // and are so already
  fmt::print("\n{}: {} views, {} rays; footprints of 5 and 1 mm on the board\n", folder.string(), views.size(),
             e.part.size());
  print_head("A real mirror, from k = 4, γ = 1");
  for (const int count : {1, 2, 3, 4}) e.row(fmt::format("k {}", count), s, {count, 1, 0, 1});
  for (const float border : {0.5F, 2.0F}) e.row(fmt::format("γ {}", border), s, {4, 1, 0, border});
  for (const float resolution : {0.01F, 0.1F})
    e.row(fmt::format("β {} m an octave", resolution), s, {4, 1, resolution, 1});
}

#else

void real_mirror(const fs::path&) {
  fmt::print("\nthe real mirror's photos need OpenCV's imgcodecs, which is not installed\n");
}

#endif

// The desk capture, imported and calibrated.
void desk(const fs::path& data) {
  const test::TemporaryFolder folder;
  const std::string session = folder / "session";
  for (const std::vector<std::string>& command : std::vector<std::vector<std::string>>{
           {"import", (data / "desk").string(), "-o", session}, {"photometry", session}, {"calibrate", session}}) {
    std::vector<std::string> arguments{MF_BINARY_DIR "/mirrorfield"};
    arguments.insert(arguments.end(), command.begin(), command.end());
    if (test::run_command(arguments).exit_code != 0) throw std::runtime_error("the desk capture cannot be calibrated");
  }
  mirror_capture(session);
}

}  // namespace
}  // namespace mf

int main(int argc, char** argv) {
  try {
    const std::filesystem::path data = MF_SHARED_DATA;
    if (argc > 1)
      mf::mirror_capture(argv[1]);
    else
      mf::desk(data);
    mf::real_mirror(data / "mirror_board");
    return 0;
  } catch (const std::exception& e) {
    fmt::print(stderr, "bench_leave_one_out: {}\n", e.what());
    return 1;
  }
}
