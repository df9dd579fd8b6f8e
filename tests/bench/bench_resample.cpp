// SPDX-License-Identifier: Apache-2.0
//
// Resampling at the size of Ihrke et al. 2008: 2200 frames of 1024² into about 9000 directions × 128². The session is
// made once, beside the program, and kept (3 GB). `mirrorfield resample` runs as its own process, so that its peak
// memory and its processor time are its own; processor time is what compares on a shared machine.
//
//   bench_resample [frames [directions]]
//
// The reference projects each ray into every view and ranks them all (tests/host/light_field/reference_tiles.h). It
// runs on a slice of texels in one thread and is extrapolated linearly; ours is the blending's processor time for all
// texels.
#include <fmt/format.h>
#include <sys/resource.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <numeric>
#include <random>

#include "common/session.h"
#include "host/light_field/resample.h"
#include "tests/bench/made_capture.h"
#include "tests/host/light_field/reference_tiles.h"
#include "tests/support/run_command.h"

namespace mf {
namespace {

namespace fs = std::filesystem;

constexpr int size = 128;
constexpr double shared_blocks = 64;  // texels of a slice's tile that the reference computes

double processor_s(int who) {
  rusage usage{};
  getrusage(who, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

struct Run {
  nlohmann::json summary;
  double wall_s = 0;
  double processor_s = 0;
};

Run resample_command(const fs::path& session, const std::string& proxy, int directions,
                     const std::vector<std::string>& launcher = {}, const std::vector<std::string>& more = {}) {
  std::vector<std::string> arguments = launcher;
  for (const std::string& a :
       {std::string(MF_BINARY_DIR "/mirrorfield"), std::string("resample"), session.string(), std::string("-o"),
        (session.parent_path() / "bench.lf.exr").string(), std::string("--directions"), std::to_string(directions),
        std::string("--size"), std::to_string(size), std::string("--proxy"), proxy, std::string("--json")})
    arguments.push_back(a);
  arguments.insert(arguments.end(), more.begin(), more.end());
  const double before = processor_s(RUSAGE_CHILDREN), start = now_s();
  const test::CommandOutcome outcome = test::run_command(arguments);
  Run run{nlohmann::json::parse(outcome.out, nullptr, false), now_s() - start, processor_s(RUSAGE_CHILDREN) - before};
  if (outcome.exit_code != 0) fmt::print("failed: {}\n", outcome.err);
  return run;
}

void print(const std::string& name, const Run& run) {
  if (run.summary.is_discarded()) return;
  fmt::print("{:28} {:6.1f} s wall, {:6.1f} s processor, peak {:.2f} GB; {}\n", name, run.wall_s, run.processor_s,
             run.summary.value("peak_memory_bytes", 0.0) / 1e9, run.summary["seconds"].dump());
  std::fflush(stdout);
}

// Ours against the reference on random texels of random directions.
void compare(const std::vector<FieldView>& views, const PlaneRectangle& rectangle, const std::string& proxy,
             int directions, int slice) {
  ResampleOptions options;
  options.proxy = proxy;
  options.directions = directions;
  options.size = size;
  Resampling resampling(views, rectangle, options, Team(), {});
  const LightField& field = resampling.field();
  const int k = proxy == "plane" ? 15 : 6;
  testing::ReferenceTiles reference(views, field, k);
  std::mt19937 random(3);
  std::uniform_int_distribution<std::size_t> any_direction(resampling.directions_at_once() - 1,
                                                           field.directions.size() - 1);
  std::uniform_int_distribution<int> any_texel(0, size - 1);
  // As many successive directions at once as the command makes; the last of them is compared.
  std::vector<std::size_t> directions_made(resampling.directions_at_once()), guessed(directions_made.size());
  std::vector<Eigen::Vector4f> made(directions_made.size() * field.texel_count());
  const Eigen::Vector4f* const tile = made.data() + (directions_made.size() - 1) * field.texel_count();
  double ours_s = 0, reference_s = 0, difference = 0, total = 0;
  int texels = 0, tiles = 0;
  while (tiles < slice) {
    const std::size_t direction = any_direction(random);
    // Rays at an emitter follow other rules, which the reference does not know.
    const Eigen::Vector3f d = field.directions.directions[direction];
    bool emitter = false;
    for (const ShadedEmitter& e : field.emitters)
      emitter =
          emitter || (e.emitter.position - resampling.field().surroundings.centre_in_world).normalized().dot(d) > 0.85F;
    if (emitter) continue;
    ++tiles;
    std::iota(directions_made.begin(), directions_made.end(), direction + 1 - directions_made.size());
    double start = processor_s(RUSAGE_THREAD);
    resampling.fill(directions_made, made.data(), guessed);
    ours_s += (processor_s(RUSAGE_THREAD) - start) / static_cast<double>(directions_made.size());
    start = processor_s(RUSAGE_THREAD);
    for (int i = 0; i < shared_blocks; ++i, ++texels) {
      const int x = any_texel(random), y = any_texel(random);
      const Eigen::Vector4f expected = reference.texel(direction, x, y);
      if (expected.w() <= 0) continue;  // nobody saw it: ours is the hole filler's guess, marked as such
      const Eigen::Vector4f& actual = tile[static_cast<std::size_t>(y * size + x)];
      difference += static_cast<double>((actual - expected).head<3>().squaredNorm());
      total += static_cast<double>(expected.head<3>().squaredNorm());
    }
    reference_s += processor_s(RUSAGE_THREAD) - start;
  }
  const double ours_per_texel = ours_s / (tiles * static_cast<double>(field.texel_count()));
  fmt::print(
      "{:10} {} tiles: ours {:.2f} ms a tile ({:.0f} tiles/s a core), reference {:.1f} us a texel "
      "(extrapolated to all: {:.0f} s): {:.0f} times; RMS difference {:.3f} %\n",
      proxy, tiles, 1e3 * ours_s / tiles, tiles / ours_s, 1e6 * reference_s / texels,
      reference_s / texels * static_cast<double>(field.texel_count() * field.directions.size()),
      reference_s / texels / ours_per_texel, 100 * std::sqrt(difference / total));
  std::fflush(stdout);
}

void compare_with_reference(const fs::path& session, int directions) {
  const SessionReader reader(session);
  const ResponseCurve response = read_response_curve(session / "response.json");
  const Calibration calibration = read_calibration(session / "calibration.json");
  const auto rectangle = covered_rectangle(calibration, reader.header().target, 0);
  double start = processor_s(RUSAGE_SELF);
  const std::vector<FieldView> views = load_field_views(reader, response, calibration, Team(), {});
  fmt::print("loading: {:.1f} s processor\n", processor_s(RUSAGE_SELF) - start);
  for (const char* proxy : {"plane", "sphere:inf", "auto"}) compare(views, rectangle.value(), proxy, directions, 40);
}

int run(int frames, int directions) {
  const fs::path folder = fs::path(MF_BENCH_DIR) / fmt::format("capture_{}", frames);
  fs::create_directories(folder);
  const fs::path session = folder / "S";
  bench::make_capture(session, {frames, 1024});
  compare_with_reference(session, directions);
  for (const char* proxy : {"plane", "auto"}) {
    print(proxy, resample_command(session, proxy, directions));
    print(fmt::format("{}, half the directions", proxy), resample_command(session, proxy, directions / 2));
  }
  const std::vector<std::string> two{
      "mpirun", "-n", "2", "--oversubscribe", "--mca", "btl", "self,vader", "--mca", "btl_base_warn_component_unused",
      "0"};
  for (const std::string proxy : {"auto", "plane"}) {
    const Run one_rank = resample_command(session, proxy, directions, {}, {"--threads", "1"});
    const Run two_ranks = resample_command(session, proxy, directions, two, {"--threads", "1"});
    print(proxy + ", one thread", one_rank);
    print(proxy + ", two ranks", two_ranks);
    fmt::print("two ranks: {:.2f} times as fast by the clock\n", one_rank.wall_s / two_ranks.wall_s);
  }
  return 0;
}

}  // namespace
}  // namespace mf

int main(int count, char** arguments) {
  const int frames = count > 1 ? std::atoi(arguments[1]) : 2200;
  const int directions = count > 2 ? std::atoi(arguments[2]) : 9000;
  setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 0);
  setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 0);
  return mf::run(frames, directions);
}
