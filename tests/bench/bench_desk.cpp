// SPDX-License-Identifier: Apache-2.0
//
// What each proxy is worth on the path-traced desk capture: one session, the same poses and response, the same errors
// against truth; both back ends on the same composite; and previews straight from the session. The capture must lie
// beside the checkout. `plane` is the baseline: the paper's way (Ihrke et al. 2008). And how little the light depends
// on the number of directions. A calibrated session of the capture may be named after the flags; else it is made first.
#include <benchmark/benchmark.h>

#include <chrono>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "common/seconds_since.h"
#include "host/io/exr.h"
#include "tests/host/desk/desk_truth.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_folder.h"

namespace mf {
namespace {

namespace fs = std::filesystem;

test::CommandOutcome mirrorfield(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), MF_BINARY_DIR "/mirrorfield");
  return test::run_command(arguments);
}

// The calibrated session and one light field a proxy, made when first asked for.
class Desk {
 public:
  explicit Desk(const std::string& session) {
    ready_ = fs::exists(test::desk_folder());
    if (!session.empty()) {
      session_ = session;
      return;
    }
    ready_ = ready_ && mirrorfield({"import", test::desk_folder().string(), "-o", session_}).exit_code == 0 &&
             mirrorfield({"photometry", session_}).exit_code == 0 &&
             mirrorfield({"calibrate", session_}).exit_code == 0;
  }
  [[nodiscard]] bool ready() const { return ready_; }
  [[nodiscard]] const std::string& session() const { return session_; }

  // Path of the field; empty on failure.
  [[nodiscard]] std::string field(const std::string& proxy, int directions = 2476, int size = 128) {
    std::string file = folder_ / (proxy + std::to_string(directions) + "x" + std::to_string(size) + ".lf.exr");
    if (fs::exists(file)) return file;
    const bool made = mirrorfield({"resample", session_, "-o", file, "--height", "0", "--directions",
                                   std::to_string(directions), "--size", std::to_string(size), "--proxy", proxy})
                          .exit_code == 0;
    return made ? file : std::string();
  }

  [[nodiscard]] ImageF probe(const std::string& field) {
    const std::string file = folder_ / "probe.exr";
    (void)mirrorfield({"probe", field, "--at", "0", "0", "0.1", "--for", "blender", "-o", file});
    return read_exr(file);
  }
  [[nodiscard]] ImageF composite(const std::string& field, int view, const std::string& backend) {
    const fs::path truth = test::desk_folder() / "truth";
    const std::string file = folder_ / "composite.exr";
    const std::string plate = truth / plate_name(view);
    (void)mirrorfield({"composite", field, truth / "suzanne.obj", "--plate", plate, "--cameras", truth / "views.json",
                       "--view", std::to_string(view), "--albedo", "0.7", "--backend", backend, "-o", file});
    return read_exr(file);
  }
  static std::string plate_name(int view) { return "plate" + std::to_string(view) + ".exr"; }

 private:
  test::TemporaryFolder folder_;
  std::string session_ = folder_ / "session";
  bool ready_ = false;
};

std::string& given_session() {
  static std::string session;
  return session;
}

Desk& desk() {
  static Desk desk(given_session());
  return desk;
}

double psnr_of_view(const ImageF& picture, int view) {
  const fs::path truth = test::desk_folder() / "truth";
  return test::composite_psnr(picture, read_exr(truth / ("suzanne" + std::to_string(view) + ".exr")),
                              read_exr(truth / Desk::plate_name(view)));
}

void proxy(benchmark::State& state, const std::string& name) {
  if (!desk().ready()) return state.SkipWithError("the desk capture is absent");
  std::string field;
  for (auto _ : state) field = desk().field(name);
  if (field.empty()) return state.SkipWithError("resample failed");
  const test::ProbeError probe =
      test::probe_error(desk().probe(field), read_exr(test::desk_folder() / "truth" / "probe_0_0_0.1.exr"));
  const LightField read = read_light_field(field);
  const test::TableError table = test::table_error(read);
  state.SetLabel(surroundings_name(read.surroundings));
  state.counters["lamp_mm"] = 1000 * test::lamp_error_m(read);
  state.counters["probe_stop"] = probe.median_abs_stop;
  state.counters["probe_irradiance"] = probe.irradiance_ratio;
  state.counters["lamp_deg"] = probe.lamp_deg;
  state.counters["table_correlation"] = table.correlation;
  state.counters["table_rms"] = table.relative_rms;
  state.counters["table_mean"] = table.mean_ratio;
  for (const int view : {0, 1})
    state.counters["psnr" + std::to_string(view)] = psnr_of_view(desk().composite(field, view, "cpu"), view);
}
BENCHMARK_CAPTURE(proxy, plane, "plane")->Unit(benchmark::kSecond)->Iterations(1);
BENCHMARK_CAPTURE(proxy, distant_sphere, "sphere:inf")->Unit(benchmark::kSecond)->Iterations(1);
BENCHMARK_CAPTURE(proxy, best_sphere, "sphere")->Unit(benchmark::kSecond)->Iterations(1);
BENCHMARK_CAPTURE(proxy, box, "box")->Unit(benchmark::kSecond)->Iterations(1);
BENCHMARK_CAPTURE(proxy, automatic, "auto")->Unit(benchmark::kSecond)->Iterations(1);

// Irradiance on the bare plane, mean over the rectangle, green.
double mean_irradiance(const LightField& field) {
  const ImageF map = plane_irradiance(field);
  double sum = 0;
  for (std::size_t i = 1; i < map.data.size(); i += 3) sum += static_cast<double>(map.data[i]);
  return 3 * sum / static_cast<double>(map.data.size());
}

// What the plane receives, relative to the default set of 2476 directions.
void directions(benchmark::State& state) {
  if (!desk().ready()) return state.SkipWithError("the desk capture is absent");
  constexpr int size = 64;
  std::string field;
  for (auto _ : state) field = desk().field("auto", static_cast<int>(state.range(0)), size);
  if (field.empty()) return state.SkipWithError("resample failed");
  const LightField read = read_light_field(field);
  const LightField usual = read_light_field(desk().field("auto", 2476, size));
  const ImageF truth = read_exr(test::desk_folder() / "truth" / "probe_0_0_0.1.exr");
  state.counters["relative_irradiance"] = mean_irradiance(read) / mean_irradiance(usual);
  state.counters["probe_irradiance"] = test::probe_error(desk().probe(field), truth).irradiance_ratio;
  const test::TableError table = test::table_error(read);
  state.counters["table_mean"] = table.mean_ratio;
  state.counters["table_rms"] = table.relative_rms;
}
BENCHMARK(directions)->Arg(500)->Arg(2476)->Arg(9000)->Unit(benchmark::kSecond)->Iterations(1);

// RMS of the difference over the mean, over all but the `worst` share of the pixels that the object changes.
double relative_rms(const ImageF& a, const ImageF& b, const ImageF& plate, double worst) {
  std::vector<double> squares;
  double sum = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) {
    if (std::abs(b.data[i] - plate.data[i]) <= 0.1F * std::max(plate.data[i], 0.05F)) continue;
    squares.push_back(std::pow(static_cast<double>(a.data[i] - b.data[i]), 2));
    sum += static_cast<double>(b.data[i]);
  }
  const double mean = sum / static_cast<double>(squares.size());
  std::sort(squares.begin(), squares.end());
  squares.resize(squares.size() - static_cast<std::size_t>(worst * static_cast<double>(squares.size())));
  double total = 0;
  for (const double s : squares) total += s;
  return std::sqrt(total / static_cast<double>(squares.size())) / mean;
}

void backends(benchmark::State& state) {
  if (!desk().ready()) return state.SkipWithError("the desk capture is absent");
  const std::string field = desk().field("auto");
  double cpu_s = 0, gl_s = 0;
  ImageF cpu, gl;
  for (auto _ : state) {
    auto start = std::chrono::steady_clock::now();
    cpu = desk().composite(field, 0, "cpu");
    cpu_s = seconds_since(start);
    start = std::chrono::steady_clock::now();
    gl = desk().composite(field, 0, "gl");
    gl_s = seconds_since(start);
  }
  const ImageF plate = read_exr(test::desk_folder() / "truth" / Desk::plate_name(0));
  state.counters["cpu_s"] = cpu_s;
  state.counters["gl_s"] = gl_s;
  state.counters["ratio"] = gl_s / cpu_s;
  state.counters["psnr_cpu"] = psnr_of_view(cpu, 0);
  state.counters["psnr_gl"] = psnr_of_view(gl, 0);
  state.counters["rms_all"] = relative_rms(gl, cpu, plate, 0);
  state.counters["rms_off_edges"] = relative_rms(gl, cpu, plate, 0.03);
}
BENCHMARK(backends)->Unit(benchmark::kSecond)->Iterations(1);

// Relative RMS over the whole picture, alpha aside.
double difference(const ImageF& a, const ImageF& b) {
  double squares = 0, all = 0;
  for (std::size_t i = 0; i < b.data.size(); ++i) {
    if (i % static_cast<std::size_t>(b.channels) == 3) continue;
    squares += std::pow(static_cast<double>(a.data[i] - b.data[i]), 2);
    all += std::pow(static_cast<double>(b.data[i]), 2);
  }
  return std::sqrt(squares / all);
}

// A picture with `options`, and the seconds of its stages.
struct Picture {
  ImageF image;
  nlohmann::json seconds;
};
Picture render_suzanne(const std::string& command, const std::string& light, std::vector<std::string> options) {
  const fs::path truth = test::desk_folder() / "truth";
  const test::TemporaryFolder folder;
  const std::string file = folder / "picture.exr";
  std::vector<std::string> arguments{command,
                                     light,
                                     truth / "suzanne.obj",
                                     "--cameras",
                                     truth / "views.json",
                                     "--view",
                                     "0",
                                     "--albedo",
                                     "0.7",
                                     "--json",
                                     "-o",
                                     file};
  if (command == "composite") options.insert(options.end(), {"--plate", truth / Desk::plate_name(0)});
  arguments.insert(arguments.end(), options.begin(), options.end());
  const nlohmann::json summary = nlohmann::json::parse(mirrorfield(arguments).out);
  return {read_exr(file), summary.at("seconds_by_stage")};
}

// A preview of 200 directions straight from the session, beside the same through the light field's file. The median of
// five pictures' seconds.
void preview(benchmark::State& state, const std::string& command) {
  if (!desk().ready()) return state.SkipWithError("the desk capture is absent");
  constexpr std::size_t runs = 5;
  const std::vector<std::string> few{"--directions", "200"};
  std::map<std::string, std::vector<double>> seconds;
  Picture straight, through_file, all;
  double resample_s = 0;
  for (auto _ : state) {
    const auto start = std::chrono::steady_clock::now();
    const std::string field = desk().field("auto");
    resample_s = seconds_since(start);
    through_file = render_suzanne(command, field, few);
    all = render_suzanne(command, field, {});
    for (std::size_t i = 0; i < runs; ++i) {
      straight = render_suzanne(command, desk().session(), few);
      for (const auto& [stage, s] : straight.seconds.items()) seconds[stage].push_back(s.get<double>());
    }
  }
  for (auto& [stage, s] : seconds) {
    std::sort(s.begin(), s.end());
    state.counters[stage + "_s"] = s[runs / 2];
  }
  state.counters["preview_s"] = seconds["choosing"][runs / 2] + seconds["resampling"][runs / 2];
  state.counters["resample_to_file_s"] = resample_s;  // 0 when it was there already
  state.counters["read_and_merge_s"] =
      through_file.seconds["reading"].get<double>() + through_file.seconds["merging"].get<double>();
  state.counters["difference"] = difference(straight.image, through_file.image);
  state.counters["of_200_from_all"] = difference(straight.image, all.image);
  if (command == "composite") {
    state.counters["psnr_preview"] = psnr_of_view(straight.image, 0);
    state.counters["psnr_all"] = psnr_of_view(all.image, 0);
  }
}
BENCHMARK_CAPTURE(preview, object, "render")->Unit(benchmark::kSecond)->Iterations(1);
BENCHMARK_CAPTURE(preview, composite, "composite")->Unit(benchmark::kSecond)->Iterations(1);

}  // namespace
}  // namespace mf

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (argc > 1) mf::given_session() = argv[1];
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
