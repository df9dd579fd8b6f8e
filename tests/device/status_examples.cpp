// SPDX-License-Identifier: Apache-2.0
#include "tests/device/status_examples.h"

#include <png.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "device/rig_status_json.h"

namespace mf::test {

namespace {

ImageU8 drawn_picture() {
  ImageU8 grey(640, 480, 1);
  for (int y = 0; y < grey.height; ++y)
    for (int x = 0; x < grey.width; ++x)
      grey.at(x, y) = static_cast<std::uint8_t>(60 + x / 8 + (x / 40 + y / 40) % 2 * 50);
  return grey;
}

std::vector<TagDetection> drawn_tags() {
  std::vector<TagDetection> tags;
  for (int i = 0; i < 8; ++i) {
    const double x = 80 + 60.0 * i, y = i % 2 == 0 ? 60 : 400;
    tags.push_back({i, {{{x, y + 40}, {x + 42, y + 38}, {x + 40, y}, {x, y + 2}}}, 0, 55.5});
  }
  return tags;
}

std::vector<TagDetection> found_tags(const ImageU8& frame) {
  ImageF linear(frame.width, frame.height, 1);
  for (std::size_t i = 0; i < frame.data.size(); ++i) {
    const float level = static_cast<float>(frame.data[i]) / 255.0F;
    linear.data[i] = level * level;
  }
  return TagDetector(TagDetectorOptions{}).detect(linear);
}

// Rings of patches of about the same solid angle.
CoverageStatus half_covered() {
  CoverageStatus coverage;
  constexpr int rings = 6;
  for (int ring = 0; ring < rings; ++ring) {
    const double elevation = 90.0 * (ring + 0.5) / rings;
    const int around = std::max(1, static_cast<int>(std::lround(24 * std::cos(elevation * std::numbers::pi / 180))));
    for (int i = 0; i < around; ++i) {
      CoveragePatch patch{360.0 * (i + 0.5) / around, elevation, 1, 0};
      const double off_lamp = std::abs(patch.azimuth_deg - 250) + std::abs(elevation - 52);
      if (off_lamp < 20) patch.weight = 20;
      const double turned = std::remainder(patch.azimuth_deg - 100, 360);  // from what was seen first
      patch.covered = std::clamp(1.4 - std::abs(turned) / 120 + elevation / 300, 0.0, 1.0);
      coverage.patches.push_back(patch);
    }
  }
  double all = 0;
  for (const CoveragePatch& p : coverage.patches) all += p.weight;
  for (CoveragePatch& p : coverage.patches) {
    p.weight /= all;
    coverage.covered += p.weight * p.covered;
  }
  coverage.advice = CaptureAdvice{250, 52, "tilt the mirror's left edge down"};
  return coverage;
}

}  // namespace

RigStatus recording_status(const ImageU8& frame) {
  RigStatus s;
  s.state = RigState::recording;
  s.session = "/var/lib/mirrorfield/20260412-101530";
  s.seconds = 72.4;
  s.durable_frames = 2671;
  s.lost_frames = 3;
  s.gaps = 2;
  s.queued = 4;
  s.queue_frames = 48;
  s.frame_rate_hz = 36.9;
  s.free_bytes = 31'250'000'000;
  s.temperature_c = 51.5;
  s.camera = "Photonfocus MV1-D1312 1207";
  s.exposure_s = 0.004;
  RigPreview preview;
  preview.grey = frame.empty() ? drawn_picture() : frame;
  preview.tags = frame.empty() ? drawn_tags() : found_tags(frame);
  preview.posed = preview.tags.size() >= 4;
  s.preview = shrunk_preview(preview, 256);
  s.coverage = half_covered();
  return s;
}

ImageU8 grey_picture(const std::string& png_file) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_file(&png, png_file.c_str()) == 0) return {};
  png.format = PNG_FORMAT_LINEAR_Y;
  const int width = static_cast<int>(png.width), height = static_cast<int>(png.height);
  ImageU16 codes(width, height, 1);
  if (png_image_finish_read(&png, nullptr, codes.data.data(), 0, nullptr) == 0) return {};
  std::vector<std::uint16_t> sorted = codes.data;
  const auto bright = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() * 998 / 1000);
  std::nth_element(sorted.begin(), bright, sorted.end());
  ImageU8 grey(width, height, 1);
  for (std::size_t i = 0; i < codes.data.size(); ++i) {
    const double level = std::min(1.0, static_cast<double>(codes.data[i]) / std::max<double>(*bright, 1));
    grey.data[i] = static_cast<std::uint8_t>(std::lround(255 * std::sqrt(level)));
  }
  return grey;
}

}  // namespace mf::test
