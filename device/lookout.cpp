// SPDX-License-Identifier: Apache-2.0
#include "device/lookout.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "common/error.h"
#include "common/json_file.h"

namespace mf {

namespace {

constexpr std::size_t most_sights = 64;  // that wait to be taken: nobody records

}  // namespace

CameraModel read_camera_model(const std::filesystem::path& calibration) {
  const nlohmann::json json = read_json_file(calibration);
  const std::string file = calibration.string();
  CameraModel camera;
  camera.width = json_field<int>(json, "width", file);
  camera.height = json_field<int>(json, "height", file);
  const auto k = json_field<std::vector<std::vector<double>>>(json, "K", file);
  if (k.size() != 3 || k[0].size() != 3 || k[1].size() != 3 || !(k[0][0] > 0) || !(k[1][1] > 0))
    throw InputError(file, "K", "is no camera matrix: calibrate again");
  const auto lens = json_field_or<std::map<std::string, double>>(json, "distortion", file, {});
  const auto term = [&](const char* name) { return lens.contains(name) ? lens.at(name) : 0.0; };
  camera.parameters = {k[0][0], k[1][1], k[0][2], k[1][2], term("k1"), term("k2"), term("p1"), term("p2"), term("k3")};
  return camera;
}

DetectionOptions detection_options(const LookoutOptions& options, const MirrorTarget& target) {
  DetectionOptions detection = options.detection;
  detection.detector.family = target.family;
  for (const PlanarTag& tag : target.tags) detection.follow.ids.push_back(tag.id);
  return detection;
}

Lookout::Lookout(const LookoutOptions& options, const MirrorTarget& target, const std::optional<WorldTarget>& world,
                 const ResponseCurve& response, const PixelFormat& format, int width, int height)
    : target_(target), seer_(options.seeing, target, world, width, height) {
  detection_ = std::make_unique<Detection>(detection_options(options, target), response, format,
                                           [this](DetectedFrame frame) { look(std::move(frame)); });
}

Lookout::~Lookout() = default;

void Lookout::begin_recording() {
  const std::lock_guard lock(mutex_);
  seer_.forget_coverage();
  sights_.clear();
}

std::vector<Sight> Lookout::take_sights() {
  const std::lock_guard lock(mutex_);
  return std::exchange(sights_, {});
}

std::optional<bool> Lookout::mirror_in_view() const {
  const std::lock_guard lock(mutex_);
  return mirror_in_view_;
}

void Lookout::describe(RigStatus& status) const {
  const std::lock_guard lock(mutex_);
  status.preview = preview_;
  status.coverage = seer_.coverage();
}

void Lookout::look(DetectedFrame frame) {
  RigPreview preview{preview_of(frame.luminance), static_cast<double>(frame.reduction), frame.tags, false};
  const std::lock_guard lock(mutex_);
  const std::optional<Rigid3> pose = seer_.add(frame);
  preview.posed = pose.has_value();
  mirror_in_view_ = std::any_of(frame.tags.begin(), frame.tags.end(),
                                [&](const TagDetection& tag) { return target_.find(tag.id) != nullptr; });
  preview_ = std::move(preview);
  if (sights_.size() < most_sights) sights_.push_back({frame.arrival, std::move(frame.tags), pose});
}

}  // namespace mf
