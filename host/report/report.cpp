// SPDX-License-Identifier: Apache-2.0
#include "host/report/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

#include "common/demosaic.h"
#include "common/virtual_view.h"
#include "host/io/image_file.h"
#include "host/report/charts.h"
#include "host/report/distance_picture.h"
#include "host/report/field_pictures.h"
#include "host/report/html.h"
#include "host/report/page_style.h"

namespace mf {

namespace {

constexpr std::size_t sample_count = 6;

// A part of the page: heading, one line that says how to read it, content.
std::string section(std::string_view heading, std::string_view how_to_read, std::string_view content) {
  return fmt::format("<section><h2>{}</h2><p>{}</p>{}</section>\n", heading, how_to_read, content);
}

std::string figure(const std::string& picture, const std::string& caption) {
  return fmt::format("<figure>{}<figcaption>{}</figcaption></figure>", picture, html_escaped(caption));
}

// `aspect`: width over height as shown.
std::string picture(const ImageU8& image, const std::string& alt, double aspect) {
  return fmt::format(R"(<img alt="{}" style="aspect-ratio:{:.4f}" src="{}">)", html_escaped(alt), aspect,
                     png_data_uri(image));
}

std::string tile(const std::string& value, const std::string& label) {
  return fmt::format("<div class=\"tile\"><b>{}</b><span>{}</span></div>", value, html_escaped(label));
}

std::size_t used_count(const Calibration& calibration) {
  return static_cast<std::size_t>(std::count_if(calibration.frames.begin(), calibration.frames.end(),
                                                [](const MirrorPose& pose) { return pose.used; }));
}

std::string summary(const ReportInput& in) {
  const std::size_t used = used_count(in.calibration);
  const std::size_t all = in.calibration.frames.size();
  const CameraModel& camera = in.calibration.camera;
  const Eigen::Vector2d size = in.field.plane.size_m();
  std::string tiles;
  tiles += tile(fmt::format("{} / {}", used, all), "frames posed");
  tiles += tile(fmt::format("{:.3f} px", in.calibration.rms_px), "reprojection error, RMS");
  tiles += tile(fmt::format("{:.2f} ± {:.2f} px", camera.fx(), in.calibration.camera_sigma[0]), "focal length");
  tiles +=
      tile(fmt::format("{:.0f} %", 100 * covered_share(in.field)), "of the light's directions seen (cosine-weighted)");
  tiles += tile(fmt::format("{} × {}²", in.field.directions.size(), in.field.resolution), "directions × texels");
  tiles += tile(fmt::format("{:.2f} × {:.2f} m", size.x(), size.y()), "plane");
  tiles += tile(surroundings_name(in.field.surroundings), "focused on");
  tiles += tile(in.response.absolute ? "absolute" : "relative", "radiance scale");
  return "<div class=\"tiles\">" + tiles + "</div>\n";
}

// A frame as a picture, the mirror's opening drawn over it.
std::string frame_figure(const ReportInput& in, const SessionFrame& frame, const MirrorPose* pose) {
  const PixelFormat& format = in.session.header().format;
  const ImageF rgb = demosaic(linearize(in.session.read_frame(frame), format, in.response), format.layout);
  const ImageU8 shown = to_srgb8(rgb, rgb.channels == 3 ? display_exposure(rgb) : 1);
  std::string outline;
  if (pose != nullptr)
    if (const auto view = mirror_view(pose->cam_from_mirror, in.session.header().target, in.calibration.camera)) {
      for (const Eigen::Vector2d& p : view->opening_in_img)
        fmt::format_to(std::back_inserter(outline), "{:.1f},{:.1f} ", p.x(), p.y());
      outline = "<polygon points=\"" + outline + "\"/>";
    }
  const std::string svg = fmt::format(
      R"(<svg class="frame" viewBox="0 0 {0} {1}" role="img" aria-label="frame {2}"><image width="{0}" height="{1}" href="{3}"/>{4}</svg>)",
      shown.width, shown.height, html_escaped(frame.info.name), png_data_uri(shown), outline);
  const std::string caption = pose == nullptr ? frame.info.name + ", the scene without the mirror"
                                              : fmt::format("{}, {:.2f} px", frame.info.name, pose->rms_px);
  return figure(svg, caption);
}

std::string sample_frames(const ReportInput& in, const Progress& progress) {
  std::vector<std::size_t> used;
  for (std::size_t i = 0; i < in.calibration.frames.size(); ++i)
    if (in.calibration.frames[i].used) used.push_back(i);
  const std::vector<SessionFrame> frames = in.session.frames(FrameRole::mirror);
  std::string figures;
  const std::size_t count = std::min(sample_count, used.size());
  for (std::size_t s = 0; s < count; ++s) {
    const std::size_t i = used[(2 * s + 1) * used.size() / (2 * count)];
    if (i < frames.size()) figures += frame_figure(in, frames[i], &in.calibration.frames[i]);
    report_progress(progress, "report", static_cast<double>(s + 1) / static_cast<double>(count + 1));
  }
  const std::vector<SessionFrame> scenes = in.session.frames(FrameRole::scene);
  if (!scenes.empty()) figures += frame_figure(in, scenes.front(), nullptr);
  return section("Frames",
                 "Linearized, each with its own exposure for display. The line is the mirror's opening where "
                 "the calibration puts it: it must follow the glass, inside the tags.",
                 "<div class=\"grid\">" + figures + "</div>");
}

std::string response_chart(const ResponseCurve& response) {
  const std::vector<std::string> colours = response.channels.size() == 3
                                               ? std::vector<std::string>{"red", "green", "blue"}
                                               : std::vector<std::string>{"ink"};
  std::vector<ChartSeries> series;
  std::size_t observed = 0;
  std::size_t codes = 0;
  for (std::size_t c = 0; c < std::min(colours.size(), response.channels.size()); ++c) {
    const ResponseChannel& channel = response.channels[c];
    ChartSeries line{colours[c], {}};
    // Some hundred points draw the curve; near the black level every code counts.
    for (std::size_t code = 0; code < channel.exposure.size(); code += code < 512 ? 1 : 16)
      line.points.push_back({static_cast<double>(code), channel.exposure[code]});
    series.push_back(std::move(line));
    observed += static_cast<std::size_t>(std::count(channel.observed.begin(), channel.observed.end(), true));
    codes += channel.observed.size();
  }
  if (codes == 0) return "";
  return section(
      "Response",
      fmt::format("Relative exposure of each code, per channel. Black level {:.1f}, saturated from {:.0f} on; "
                  "{:.0f} % of the codes were observed, the rest is interpolated.",
                  response.black_level, response.saturation_code,
                  100.0 * static_cast<double>(observed) / static_cast<double>(codes)),
      line_chart(series, {"code", "relative exposure", false, true}));
}

std::string error_chart(const Calibration& calibration) {
  std::vector<Bar> bars;
  for (const MirrorPose& pose : calibration.frames)
    bars.push_back({pose.rms_px, pose.used,
                    pose.used ? fmt::format("{}: {:.3f} px, {} corners", pose.name, pose.rms_px, pose.inlier_corners)
                              : pose.name + ": " + pose.why_not});
  return section(
      "Reprojection error",
      "RMS over the corners of each frame, in the order of recording; the dashed line is the whole session's. "
      "Red: a frame that could not be posed.",
      bar_chart(bars, "frame", "pixels", calibration.rms_px));
}

std::string hemisphere(const ReportInput& in) {
  constexpr int size_px = 360;
  const HemisphereDisc disc = draw_hemisphere(in.field, size_px);
  ImageU8 coverage(size_px, size_px, 3, 255);
  for (int y = 0; y < size_px; ++y)
    for (int x = 0; x < size_px; ++x) {
      if (std::hypot(x + 0.5 - size_px / 2.0, y + 0.5 - size_px / 2.0) >= size_px / 2.0) continue;
      // From orange (never seen) to blue (seen from everywhere on the plane): distinct to colour-blind eyes too.
      const float c = std::clamp(disc.confidence.at(x, y), 0.F, 1.F);
      constexpr std::array<float, 3> unseen{230, 159, 0};
      constexpr std::array<float, 3> seen{0, 90, 160};
      for (std::size_t k = 0; k < 3; ++k)
        coverage.at(x, y, static_cast<int>(k)) =
            static_cast<std::uint8_t>(unseen.at(k) + c * (seen.at(k) - unseen.at(k)));
    }
  const ImageU8 light = to_srgb8(disc.radiance, display_exposure(disc.radiance));
  return section(
      "Directions",
      "The hemisphere above the plane: zenith in the middle, horizon at the rim, +x right, +y up, equal areas "
      "for equal solid angles.",
      "<div class=\"grid\">" +
          figure(picture(coverage, "coverage", 1), "Coverage: blue seen from the whole plane, orange from nowhere") +
          figure(picture(light, "light", 1), "The light itself, mean over the plane") + "</div>");
}

std::string focus(const ReportInput& in) {
  const std::string heading = "What the light comes from";
  const std::string name = html_escaped(surroundings_name(in.field.surroundings));
  if (in.field.surroundings.is_plane())
    return section(heading, "The views are focused on the plane itself: no distance was looked for.", "");
  constexpr int size_px = 360;
  return section(heading,
                 "The surface on which the views are focused (" + name +
                     "), as the plane's middle sees it: the disc as above, the scale in metres. Grey: no distance "
                     "stands out, and any serves. Rings: bright sources that were triangulated on their own.",
                 "<div class=\"grid\">" + figure(distance_figure(in.field, size_px), "Distance by direction") +
                     "</div>" + emitter_table(in.field));
}

std::string light(const ReportInput& in) {
  const ImageF map = plane_irradiance(in.field);
  double lowest = INFINITY;
  double highest = 0;
  for (std::size_t i = 1; i < map.data.size(); i += 3) {
    lowest = std::min(lowest, static_cast<double>(map.data[i]));
    highest = std::max(highest, static_cast<double>(map.data[i]));
  }
  const Eigen::Vector3d& at = in.probe_at_in_world;
  const Eigen::Vector2d size = in.field.plane.size_m();
  const std::string probe_caption = fmt::format(
      "The light at ({:.2f}, {:.2f}, {:.2f}) m: what a mirror ball would see. Black: below the plane or never seen",
      at.x(), at.y(), at.z());
  const std::string map_caption =
      fmt::format("Irradiance over the plane, +x right, +y up: green from {:.3g} to {:.3g}", lowest, highest);
  return section("Light", "Shadows of things between the lamps and the plane show in the irradiance.",
                 "<div class=\"grid wide\">" +
                     figure(picture(to_srgb8(in.probe, display_exposure(in.probe)), "probe", 2), probe_caption) +
                     figure(picture(to_srgb8(map, 0.9 / std::max(highest, 1e-12)), "irradiance", size.x() / size.y()),
                            map_caption) +
                     "</div>");
}

std::string unused_frames(const Calibration& calibration) {
  std::string rows;
  for (const MirrorPose& pose : calibration.frames)
    if (!pose.used)
      rows += fmt::format("<tr><td>{}</td><td>{}</td></tr>", html_escaped(pose.name), html_escaped(pose.why_not));
  if (rows.empty()) return section("Frames that were not used", "None: every frame was posed.", "");
  return section("Frames that were not used", "They take no part in the light field; the others are not affected.",
                 "<table><tr><th>frame</th><th>why</th></tr>" + rows + "</table>");
}

std::string figures(const ReportInput& in) {
  const SessionHeader& header = in.session.header();
  const CameraModel& camera = in.calibration.camera;
  const auto row = [](std::string_view name, const std::string& value) {
    return fmt::format("<tr><td>{}</td><td>{}</td></tr>", name, html_escaped(value));
  };
  std::string rows;
  rows += row("frames", fmt::format("{} × {}, {}", header.width, header.height, pixel_format_name(header.format)));
  rows += row("focal length", fmt::format("{:.3f}, {:.3f} px", camera.fx(), camera.fy()));
  rows += row("principal point", fmt::format("{:.2f}, {:.2f} px", camera.cx(), camera.cy()));
  const auto& p = camera.parameters;
  rows +=
      row("distortion k1 k2 p1 p2 k3", fmt::format("{:.4g} {:.4g} {:.4g} {:.4g} {:.4g}", p[4], p[5], p[6], p[7], p[8]));
  if (in.calibration.cam_from_world)
    rows += row("world tags", fmt::format("{:.3f} px RMS", in.calibration.world_rms_px));
  rows += row("mirror", fmt::format("{:.2f} × {:.2f} m, reflectance {:.2f}", header.target.opening_m.x(),
                                    header.target.opening_m.y(), header.mirror_reflectance));
  for (const auto& [stage, seconds] : in.seconds) rows += row(html_escaped(stage), fmt::format("{:.1f} s", seconds));
  return section("Figures", "", "<table>" + rows + "</table>");
}

}  // namespace

std::string report_html(const ReportInput& in, const Progress& progress) {
  std::string page = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width, "
      "initial-scale=1\"><title>{0}</title><style>{1}</style></head><body>\n<h1>{0}</h1>\n",
      html_escaped(in.title), page_style);
  page += summary(in);
  page += light(in);
  page += hemisphere(in);
  page += focus(in);
  page += sample_frames(in, progress);
  page += error_chart(in.calibration);
  page += unused_frames(in.calibration);
  page += response_chart(in.response);
  page += figures(in);
  report_progress(progress, "report", 1);
  return page + "</body></html>\n";
}

}  // namespace mf
