// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/probe.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "host/cli/command.h"
#include "host/io/exr.h"
#include "host/light_field/provenance.h"

namespace mf {

namespace {

struct ProbeArguments {
  std::filesystem::path field;
  std::filesystem::path output;
  std::filesystem::path confidence;
  std::vector<double> at;
  std::string consumer = "openexr";
  int width = 1024;
  std::filesystem::path provenance;
  std::vector<double> why;
  bool json = false;
};

// Which frames lit the ray, by the provenance that `resample` wrote beside the field.
struct Why {
  nlohmann::json json;
  std::string text;
};

Why explain(const ProbeArguments& a, const LightField& field, const Eigen::Vector3d& at) {
  if (a.provenance.empty())
    throw InputError("probe", "--why", "needs --provenance FILE, which 'mirrorfield resample --provenance' writes");
  const Eigen::Vector3d towards(a.why[0], a.why[1], a.why[2]);
  if (!towards.allFinite() || towards.norm() <= 0)
    throw InputError("probe", "--why", "needs three finite numbers, a direction in the world");
  const Provenance provenance = read_provenance(a.provenance);
  const std::size_t blocks = field.directions.size() * static_cast<std::size_t>(provenance.side * provenance.side);
  if (provenance.emitter.size() != blocks)
    throw InputError(a.provenance.string(), "", "belongs to another field: resample again with --provenance");
  const FieldSampler sampler(field);
  const auto ray = sampler.field_ray(at, towards.normalized());
  if (!ray)
    throw InputError("probe", "--why", "looks along or below the plane: no light of the field comes from there");
  const DirectionWeights near = sampler.locator().locate(ray->direction);
  const auto nearest =
      static_cast<std::size_t>(std::max_element(near.weight.begin(), near.weight.end()) - near.weight.begin());
  const std::size_t direction = near.index[nearest];
  const std::size_t block = provenance.block_at(field.plane, field.resolution, direction, ray->p_in_plane);
  Why why{{{"direction", direction}, {"emitter", nullptr}, {"frames", nlohmann::json::array()}}, ""};
  if (provenance.emitter[block] > 0) {
    why.json["emitter"] = provenance.emitter[block] - 1;
    why.text += fmt::format("near emitter {}: its outline and mask, which all views drew, come first\n",
                            provenance.emitter[block] - 1);
  }
  for (const Provenance::Share& share : provenance.of_block(block)) {
    if (share.weight <= 0) continue;
    why.json["frames"].push_back({{"name", provenance.frames[share.frame]}, {"weight", share.weight}});
    why.text += fmt::format("{:5.1f} %  {}\n", 100 * static_cast<double>(share.weight), provenance.frames[share.frame]);
  }
  if (why.json["frames"].empty()) why.text += "no frame saw it\n";
  return why;
}

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

// A light field tells what arrives near its plane: far from it is a slip of the unit or of the frame.
void check_near_plane(const Eigen::Vector3d& at, const PlaneRectangle& plane) {
  constexpr double reach = 10;  // diagonals of the rectangle
  const Eigen::Vector3d p = plane.world_from_plane.inverse() * at;
  const Eigen::Vector2d inside = p.head<2>().cwiseMax(plane.min_m).cwiseMin(plane.max_m);
  const double distance_m = std::hypot((p.head<2>() - inside).norm(), p.z());
  if (distance_m > reach * plane.size_m().norm())
    throw InputError(
        "probe", "--at",
        fmt::format("is {:.3g} m from the light field's plane, {:.2f} × {:.2f} m at height {:.3g} m: give "
                    "a point near it, world metres",
                    distance_m, plane.size_m().x(), plane.size_m().y(), plane.world_from_plane.translation.z()));
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
  check_exr_output("probe", "--output", a.output);
  if (!a.confidence.empty()) check_exr_output("probe", "--confidence", a.confidence);
  if (std::filesystem::is_directory(a.field))
    throw InputError(a.field.string(), "", "is a folder: make it a light field first, with `mirrorfield resample`");
  const LightField field = read_light_field(a.field);
  check_near_plane(at, field.plane);
  Why why;
  if (!a.why.empty()) why = explain(a, field, at);
  const Probe probe = make_probe(field, at, *convention, a.width);
  const ProbeFigures figures = measure(probe, *convention);
  constexpr double least_seen = 0.005;  // reads 0 %
  if (figures.seen_share < least_seen)
    throw InputError("probe", "--at",
                     fmt::format("no view saw what arrives there: give a point over the rectangle {:.2f} {:.2f} {:.2f} "
                                 "{:.2f} at height {:.3g}, world metres",
                                 field.plane.min_m.x(), field.plane.min_m.y(), field.plane.max_m.x(),
                                 field.plane.max_m.y(), field.plane.world_from_plane.translation.z()));
  ExrOptions options;
  options.latlong = *convention == LatLongConvention::openexr;  // the attribute promises OpenEXR's orientation
  options.attributes = {{"mfConsumer", a.consumer}, {"mfAt", fmt::format("{} {} {}", at.x(), at.y(), at.z())}};
  write_exr(a.output, probe.radiance, options);
  if (!a.confidence.empty()) write_exr(a.confidence, probe.confidence, options);
  nlohmann::json summary{
      {"irradiance", figures.irradiance}, {"seen_share", figures.seen_share}, {"width", a.width}, {"for", a.consumer}};
  if (!a.why.empty()) summary["why"] = why.json;
  print_summary(
      a.json, summary,
      fmt::format("irradiance on the ground {:.4g} {:.4g} {:.4g}, {:.0f} % of the upper hemisphere seen\n{}{}\n",
                  figures.irradiance[0], figures.irradiance[1], figures.irradiance[2], 100 * figures.seen_share,
                  why.text, a.output.string()));
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
  command.values("--why", 3, a->why, "x y z of a direction (world): which frames lit the ray from there");
  command.option("--provenance", a->provenance, "what 'resample --provenance' wrote, for --why");
  add_json_flag(command, a->json);
  command.on_run([a] { run(*a); });
}

}  // namespace mf
