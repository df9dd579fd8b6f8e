// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/probe.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "common/error.h"
#include "host/cli/command.h"
#include "host/io/exr.h"

namespace mf {

namespace {

struct ProbeArguments {
  std::filesystem::path field;
  std::filesystem::path output;
  std::filesystem::path confidence;
  std::vector<double> at;
  std::string consumer = "openexr";
  int width = 1024;
  bool json = false;
};

// Irradiance on an upward-facing plane, and the share of the upper hemisphere that some view saw.
struct ProbeFigures {
  std::array<double, 3> irradiance{};
  double seen_share = 0;
};

ProbeFigures measure(const Probe& probe, LatLongConvention convention) {
  ProbeFigures figures;
  const int w = probe.radiance.width, h = probe.radiance.height;
  double seen = 0, all = 0;
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      const Eigen::Vector3d d = lat_long_direction(convention, w, h, x, y);
      if (d.z() <= 0) continue;
      const double solid_angle = lat_long_solid_angle(convention, w, h, x, y);
      for (int c = 0; c < 3; ++c)
        figures.irradiance[static_cast<std::size_t>(c)] +=
            static_cast<double>(probe.radiance.at(x, y, c)) * d.z() * solid_angle;
      all += solid_angle;
      if (probe.confidence.at(x, y) > 0) seen += solid_angle;
    }
  figures.seen_share = all > 0 ? seen / all : 0;
  return figures;
}

void run(const ProbeArguments& a) {
  const auto convention = parse_lat_long_convention(a.consumer);
  if (!convention)
    throw InputError("probe", "--for",
                     "'" + a.consumer + "' is no consumer known here: use blender, openexr or threejs");
  if (a.width < 4 || a.width > 32768 || a.width % 2 != 0)
    throw InputError("probe", "--width", "must be an even number from 4 to 32768");
  const Eigen::Vector3d at(a.at[0], a.at[1], a.at[2]);
  if (!at.allFinite()) throw InputError("probe", "--at", "needs three finite numbers, world metres");
  const LightField field = read_light_field(a.field);
  const Probe probe = make_probe(field, at, *convention, a.width);
  const ProbeFigures figures = measure(probe, *convention);
  ExrOptions options;
  options.latlong = *convention == LatLongConvention::openexr;  // the attribute promises OpenEXR's orientation
  options.attributes = {{"mfConsumer", a.consumer}, {"mfAt", fmt::format("{} {} {}", at.x(), at.y(), at.z())}};
  write_exr(a.output, probe.radiance, options);
  if (!a.confidence.empty()) write_exr(a.confidence, probe.confidence, options);
  print_summary(
      a.json,
      {{"irradiance", figures.irradiance}, {"seen_share", figures.seen_share}, {"width", a.width}, {"for", a.consumer}},
      fmt::format("irradiance on the ground {:.4g} {:.4g} {:.4g}, {:.0f} % of the upper hemisphere seen\n{}\n",
                  figures.irradiance[0], figures.irradiance[1], figures.irradiance[2], 100 * figures.seen_share,
                  a.output.string()));
}

}  // namespace

void add_probe_command(CommandLine& program) {
  CommandLine command = program.command("probe", "the light at one point as a lat-long picture");
  const auto a = std::make_shared<ProbeArguments>();  // shared: the parser's callback outlives this function
  command.option("field", a->field, "light field (.lf.exr)", Presence::required);
  command.values("--at", 3, a->at, "x y z of the point, world metres", Presence::required);
  command.option("--for", a->consumer, "orientation: blender, openexr (USD, Mitsuba) or threejs");
  command.option("--width", a->width, "pixels across; the height is half of it");
  command.option("-o,--output", a->output, "lat-long EXR to write", Presence::required);
  command.option("--confidence", a->confidence, "also write the confidence (0…1) as an EXR");
  add_json_flag(command, a->json);
  command.on_run([a] { run(*a); });
}

}  // namespace mf
