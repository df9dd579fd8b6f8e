// SPDX-License-Identifier: Apache-2.0
#include "device/metering.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <numeric>

#include "common/check.h"
#include "common/error.h"

namespace mf {

namespace {

// A linear pixel is this full at its brightest; noise and a colour's own gain need the rest.
constexpr double linear_peak = 0.85;
// A compressing response is not used to its end: its constants are nominal.
constexpr double compressed_peak = 0.9;

double code_range(const MeteringState& state) {
  return static_cast<double>(state.curve.channels.front().exposure.size() - 1) - state.curve.black_level;
}

// From here on a code only says "at least": noise spreads the saturated ones.
double clipping_code(const MeteringState& state) {
  return state.curve.black_level + 0.985 * (state.curve.saturation_code - state.curve.black_level);
}

// The code that this share of the pixels lies above.
double code_above_which(const std::vector<std::uint32_t>& histogram, double share, double pixels) {
  double above = 0;
  for (std::size_t code = histogram.size(); code-- > 0;) {
    above += histogram[code];
    if (above > share * pixels) return static_cast<double>(code);
  }
  return 0;
}

// What a frame says of the scene; light is in full linear pixels a second.
struct SceneLight {
  double peak = 0, white = 0, black = 0;
  double clipped_share = 0;
};

SceneLight light_of_scene(const LevelCounts& levels, const MeteringState& state, const MeteringOptions& options) {
  const std::vector<std::uint32_t>& histogram = levels.histogram;
  const double pixels = std::accumulate(histogram.begin(), histogram.end(), 0.0);
  check(pixels > 0, "metering looks at a frame with pixels");
  const double clipping = clipping_code(state);
  double clipped = 0;
  for (auto code = static_cast<std::size_t>(std::ceil(clipping)); code < histogram.size(); ++code)
    clipped += histogram[code];
  SceneLight scene;
  scene.clipped_share = clipped / pixels;
  // How far beyond the end clipped light lies can't be seen; the more is clipped, the bolder the guess.
  const double beyond = scene.clipped_share > 0.2 ? 32 : scene.clipped_share > 0.02 ? 8 : 3;
  // Codes that noise alone could make are no light: twice the darkest that could be told from black.
  const double faint = state.curve.black_level + 0.004 * code_range(state);
  const auto light = [&](double code) {
    const double factor = code >= clipping ? beyond : 1;
    return factor * state.curve.exposure_of(0, std::max(code, faint)) / state.exposure_s;
  };
  // Without tags: paper is about as bright as the brighter third of a picture.
  constexpr double brighter_part = 0.35;
  const double peak_share = state.capability.kind == ResponseKind::linear ? options.clipped_share : 0;
  scene.peak = light(code_above_which(histogram, peak_share, pixels));
  scene.white = light(levels.tags ? levels.tags->white : code_above_which(histogram, brighter_part, pixels));
  constexpr double print_contrast = 8;  // white over black of a printed tag, at least
  scene.black = levels.tags ? light(levels.tags->black) : scene.white / print_contrast;
  return scene;
}

// Highlights first; but a frame without tags is no frame at all.
double linear_exposure(const SceneLight& scene, const MeteringOptions& options) {
  const double for_peak = linear_peak / scene.peak;
  constexpr double reserve = 1.3;
  const double for_tags = reserve * options.tag_contrast / std::max(scene.white - scene.black, 0.1 * scene.white);
  return std::max(for_peak, for_tags);
}

MultiSlopeSensor slopes_for(double light, int most_knees, double share_left) {
  const double end = 1 - share_left;
  if (light <= 8 || most_knees < 2) {
    constexpr double level = 0.6;
    return {{{1 - (end - level) / light, level}}};
  }
  // Each slope ends at the square root of the next one's light: equal contrast is lost at both knees.
  const SlopeKnee second{1 - (end - 0.75) / light, 0.75};
  return {{{second.time - (0.75 - 0.5) / std::sqrt(light), 0.5}, second}};
}

LinLogSensor linlog_for(double light) {
  // The strongest value that is needed: bisection on the forward model, whose charge falls with the value.
  double weak = 0, strong = 1;
  for (int i = 0; i < 30; ++i) {
    const double value = 0.5 * (weak + strong);
    (charge_of(LinLogSensor{value, value, 1, 1}, light) > compressed_peak ? weak : strong) = value;
  }
  return {strong, strong, 1, 1};
}

// The weakest response that holds so much light.
ResponseRequest response_for(const ResponseCapability& capability, double light) {
  if (light <= 1.0001 * linear_peak) return LinearSensor{};
  if (capability.kind == ResponseKind::lin_log) return linlog_for(light);
  return slopes_for(std::max(light, 1.2), capability.most_knees, 1 - compressed_peak);
}

bool can_compress(const ResponseCapability& capability) {
  return capability.kind == ResponseKind::multi_slope || capability.kind == ResponseKind::lin_log;
}

double most_light_of(const ResponseCurve& curve) {
  return curve.exposure_of(0, curve.saturation_code);
}

}  // namespace

std::string MeteringOptions::validate() const {
  if (!(least_exposure_s > 0 && least_exposure_s <= most_exposure_s)) return "exposures must be above 0 and rise";
  if (!(clipped_share > 0 && clipped_share < 1)) return "clipped_share must lie between 0 and 1";
  if (!(headroom >= 1)) return "headroom must be 1 or more";
  if (!(tag_white > 0 && tag_white <= 0.45)) return "tag_white must lie above 0, up to 0.45";
  if (!(tag_contrast > 0 && tag_contrast <= 0.3)) return "tag_contrast must lie above 0, up to 0.3";
  if (settle_frames < 0 || !(most_seconds > 0)) return "settle_frames must not be negative, most_seconds above 0";
  return {};
}

LevelCounts level_counts(const ImageU16& codes, const PixelFormat& format, std::span<const TagDetection> tags) {
  LevelCounts levels;
  levels.histogram.resize(static_cast<std::size_t>(format.level_count()));
  for (const std::uint16_t code : codes.data)
    ++levels.histogram[std::min<std::size_t>(code, levels.histogram.size() - 1)];
  std::vector<TagLevels> found;
  for (const TagDetection& tag : tags) {
    Eigen::Vector2d low = tag.corners_px[0], high = low;
    for (const Eigen::Vector2d& corner : tag.corners_px) low = low.cwiseMin(corner), high = high.cwiseMax(corner);
    std::vector<std::uint16_t> inside;
    for (int y = std::max(0, static_cast<int>(low.y())); y < std::min<double>(codes.height, high.y()); ++y)
      for (int x = std::max(0, static_cast<int>(low.x())); x < std::min<double>(codes.width, high.x()); ++x)
        inside.push_back(codes.at(x, y));
    if (inside.size() < 16) continue;
    std::sort(inside.begin(), inside.end());
    found.push_back(
        {static_cast<double>(inside[inside.size() * 9 / 10]), static_cast<double>(inside[inside.size() / 10])});
  }
  if (found.empty()) return levels;
  const auto middle = found.begin() + static_cast<std::ptrdiff_t>(found.size() / 2);
  std::nth_element(found.begin(), middle, found.end(),
                   [](const TagLevels& a, const TagLevels& b) { return a.white - a.black < b.white - b.black; });
  levels.tags = *middle;
  return levels;
}

MeteringStep next_setting(const LevelCounts& levels, const MeteringState& state, const MeteringOptions& options) {
  const SceneLight scene = light_of_scene(levels, state, options);
  MeteringStep step;
  step.clipped_share = scene.clipped_share;
  if (levels.tags) step.tag_contrast = (levels.tags->white - levels.tags->black) / code_range(state);
  const auto bounded = [&](double s) { return std::clamp(s, options.least_exposure_s, options.most_exposure_s); };
  const bool compressing = options.change_response && can_compress(state.capability);
  step.exposure_s = bounded(linear_exposure(scene, options));
  if (compressing) {
    const double brightest = options.headroom * scene.peak;
    const double for_tags = std::min(options.tag_white / scene.white, state.most_light / brightest);
    // Where the plain line holds everything and shows the tags as well, it is the better one.
    step.exposure_s = bounded(std::max(for_tags, linear_peak / brightest));
    step.light = std::min(brightest * step.exposure_s, state.most_light);
    step.response = response_for(state.capability, step.light);
  }
  const bool kept = std::abs(std::log2(step.exposure_s / state.exposure_s)) < 0.2;
  // A response that holds far more than is needed wastes codes.
  const double meant_for = state.curve.exposure_of(0, state.curve.black_level + compressed_peak * code_range(state));
  const bool fits = !compressing || (1.1 * scene.peak * state.exposure_s <= most_light_of(state.curve) &&
                                     scene.clipped_share == 0 && meant_for <= 4 * std::max(step.light, 1.0));
  step.good = kept && fits;
  return step;
}

namespace {

class Metering {
 public:
  Metering(CameraSource& camera, const MeteringOptions& options, const FindTags& find_tags)
      : camera_(camera), options_(options), find_tags_(find_tags), begun_(Clock::now()) {
    const CameraDescription& d = camera.description();
    frame_.codes = ImageU16(d.width, d.height, 1);
    if (d.frame_rate_hz > 0) options_.most_exposure_s = std::min(options_.most_exposure_s, 0.95 / d.frame_rate_hz);
    options_.least_exposure_s = std::min(options_.least_exposure_s, options_.most_exposure_s);
    state_.exposure_s = d.exposure_s;
    result_.response = d.response;
    if (options_.change_response) state_.capability = probe_response(camera.features());
    update();
  }

  MeteringResult run();

 private:
  using Clock = std::chrono::steady_clock;
  [[nodiscard]] double seconds() const { return std::chrono::duration<double>(Clock::now() - begun_).count(); }
  bool receive_settled();
  bool apply(const MeteringStep&);
  void apply_response_of(const MeteringStep&);
  void update();
  void conclude();

  CameraSource& camera_;
  MeteringOptions options_;
  const FindTags& find_tags_;
  Clock::time_point begun_;
  CameraFrame frame_;
  MeteringState state_;
  MeteringResult result_;
  int frames_to_pass_ = 0;
};

// Takes over what is in force.
void Metering::update() {
  state_.exposure_s = camera_.description().exposure_s;
  state_.curve = approximate_response_curve(result_.response, camera_.description().format, options_.black_level);
}

// The next frame that has the settings in force; false: the time is over, or the camera is lost.
bool Metering::receive_settled() {
  while (seconds() < options_.most_seconds) {
    const Received received = camera_.receive(frame_, std::chrono::milliseconds(100));
    if (received == Received::lost) result_.camera_lost = true;
    if (received == Received::lost) return false;
    if (received == Received::nothing) continue;
    ++result_.frames;
    if (--frames_to_pass_ < 0 && received == Received::frame) return true;
  }
  return false;
}

void Metering::apply_response_of(const MeteringStep& step) {
  const double exposure_s = camera_.description().exposure_s;
  result_.response = apply_response(camera_.features(), step.response, exposure_s);
  if (!std::holds_alternative<UnknownResponse>(result_.response.in_force) || state_.capability.most_knees < 2) return;
  // Rounded by the camera, two knees can fall together; one can't.
  state_.capability.most_knees = 1;
  result_.response = apply_response(camera_.features(), response_for(state_.capability, step.light), exposure_s);
}

// False when nothing changed: the camera is at its end.
bool Metering::apply(const MeteringStep& step) {
  const MeteringState before = state_;
  try {
    camera_.set_exposure_s(step.exposure_s);
  } catch (const InputError& e) {
    result_.remarks.emplace_back(e.what());
  }
  if (step.response) apply_response_of(step);
  update();
  // Less than asked for is all that there is: the exposure has to do the rest.
  if (step.response && step.light > linear_peak && most_light_of(state_.curve) < 0.8 * step.light)
    state_.most_light = std::max(linear_peak, 0.95 * most_light_of(state_.curve));
  frames_to_pass_ = options_.settle_frames;
  const bool same_exposure = std::abs(state_.exposure_s / before.exposure_s - 1) < 0.01;
  return !same_exposure || std::abs(most_light_of(state_.curve) / most_light_of(before.curve) - 1) > 0.01 ||
         state_.most_light != before.most_light;
}

void Metering::conclude() {
  result_.exposure_s = camera_.description().exposure_s;
  result_.seconds = seconds();
  result_.remarks.insert(result_.remarks.end(), result_.response.remarks.begin(), result_.response.remarks.end());
  if (result_.clipped_share > options_.clipped_share)
    result_.remarks.push_back(fmt::format(
        "{:.2g} % of the picture is brighter than the camera can record at {:.3g} ms: close the aperture, or "
        "shade the lamp",
        100 * result_.clipped_share, 1e3 * result_.exposure_s));
  if (result_.tag_contrast && *result_.tag_contrast < options_.tag_contrast)
    result_.remarks.push_back(
        fmt::format("the tags' contrast is {:.2g} % of the codes at {:.3g} ms, below {:.2g} %: more light, or a wider "
                    "aperture",
                    100 * *result_.tag_contrast, 1e3 * result_.exposure_s, 100 * options_.tag_contrast));
  if (!result_.settled && !result_.camera_lost)
    result_.remarks.push_back(fmt::format("metering did not settle within {:.2g} s", options_.most_seconds));
}

MeteringResult Metering::run() {
  if (can_compress(state_.capability)) {
    // Begun wide open, one frame tells of lamps and shadows alike.
    constexpr double wide = 3000;
    MeteringStep first;
    first.exposure_s = std::clamp(state_.exposure_s, options_.least_exposure_s, options_.most_exposure_s);
    first.response = response_for(state_.capability, wide);
    first.light = wide;
    (void)apply(first);
  }
  frames_to_pass_ = options_.settle_frames;
  int good = 0;
  while (!result_.settled && receive_settled()) {
    const std::vector<TagDetection> tags =
        find_tags_ ? find_tags_(frame_.codes, state_.curve) : std::vector<TagDetection>{};
    const MeteringStep step =
        next_setting(level_counts(frame_.codes, camera_.description().format, tags), state_, options_);
    result_.clipped_share = step.clipped_share;
    result_.tag_contrast = step.tag_contrast;
    good = step.good ? good + 1 : 0;
    if (step.good)
      result_.settled = good == 2;
    else
      result_.settled = !apply(step);
  }
  conclude();
  return result_;
}

}  // namespace

MeteringResult meter(CameraSource& camera, const MeteringOptions& options, const FindTags& find_tags) {
  if (const std::string fault = options.validate(); !fault.empty()) throw InputError("metering", "", fault);
  return Metering(camera, options, find_tags).run();
}

}  // namespace mf
