// SPDX-License-Identifier: Apache-2.0
#include "device/v4l2_source.h"

#include <linux/videodev2.h>

#include <algorithm>

#include "common/check.h"
#include "common/error.h"
#include "device/clock.h"
#include "device/v4l2_controls.h"
#include "device/v4l2_exposure.h"
#include "device/v4l2_identity.h"
#include "device/v4l2_picture.h"
#include "device/v4l2_stream.h"

namespace mf {

namespace {

std::int64_t timestamp_ns(const v4l2_buffer& buffer) {
  return std::int64_t{buffer.timestamp.tv_sec} * 1'000'000'000 + std::int64_t{buffer.timestamp.tv_usec} * 1000;
}

// How long the frame has waited for us: known when the driver notes a frame's end on our clock.
std::int64_t waited_ns(const v4l2_buffer& buffer, std::int64_t monotonic_now) {
  const bool our_clock = (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  const bool at_end = (buffer.flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_EOF;
  return our_clock && at_end ? std::max<std::int64_t>(monotonic_now - timestamp_ns(buffer), 0) : 0;
}

FrameArrival arrival_of(const v4l2_buffer& buffer) {
  const std::int64_t realtime = clock_ns(CLOCK_REALTIME), monotonic = clock_ns(CLOCK_MONOTONIC);
  const std::int64_t waited = waited_ns(buffer, monotonic);
  return {std::int64_t{buffer.sequence} + 1, timestamp_ns(buffer), monotonic - waited, realtime - waited};
}

void unpack_rows(const V4l2Picture& picture, std::span<const std::uint8_t> bytes, ImageU16& codes) {
  for (int y = 0; y < picture.height; ++y)
    unpack(picture.format.wire, bytes.subspan(static_cast<std::size_t>(y) * picture.bytes_per_line), codes.row(y));
}

std::string node_of(const CameraSettings& settings) {
  if (!settings.address.empty()) return settings.address;
  const std::vector<FoundCamera> found = find_v4l2_cameras();
  if (found.empty())
    throw InputError("camera", "address", "no V4L2 camera is there: plug one in, or see `mirrorfieldd --list`");
  return found.front().address;
}

class V4l2Source final : public CameraSource {
 public:
  explicit V4l2Source(const CameraSettings&);

  [[nodiscard]] const CameraDescription& description() const override { return description_; }
  void start() override { stream_->start(); }
  [[nodiscard]] Received receive(CameraFrame& into, std::chrono::milliseconds at_most) override;
  void set_exposure_s(double exposure_s) override;
  [[nodiscard]] FeatureAccess& features() override { return controls_; }

 private:
  void describe(const FoundCamera&, const CameraSettings&);

  V4l2Device device_;
  V4l2Controls controls_;
  V4l2Picture picture_;
  CameraDescription description_;
  std::optional<V4l2Stream> stream_;
};

V4l2Source::V4l2Source(const CameraSettings& settings) : device_(node_of(settings)), controls_(device_) {
  const FoundCamera identity = identify_v4l2_camera(device_);
  description_.steady = hold_steady(controls_);
  picture_ = set_v4l2_picture(device_, settings);
  if (settings.frame_rate_hz) set_v4l2_frame_rate(device_, *settings.frame_rate_hz);
  if (settings.exposure_s) set_v4l2_exposure(controls_, device_.node(), *settings.exposure_s, picture_.width);
  if (settings.gain_db) set_v4l2_gain(controls_, device_.node(), *settings.gain_db, settings.gain_step_db);
  describe(identity, settings);
  description_.response = apply_response(controls_, settings.response, description_.exposure_s);
  stream_.emplace(device_);
}

void V4l2Source::describe(const FoundCamera& identity, const CameraSettings& settings) {
  CameraDescription& d = description_;
  d.vendor = identity.vendor;
  d.model = identity.model;
  d.serial = identity.serial;
  d.format = picture_.format.wire.format;
  d.wire_format = fourcc_name(picture_.format.fourcc);
  d.width = picture_.width;
  d.height = picture_.height;
  d.exposure_s = v4l2_exposure_s(controls_, device_.node(), picture_.width);
  d.gain_db = v4l2_gain_db(controls_, settings.gain_step_db);
  d.frame_rate_hz = v4l2_frame_rate_hz(device_);
}

void V4l2Source::set_exposure_s(double exposure_s) {
  set_v4l2_exposure(controls_, device_.node(), exposure_s, picture_.width);
  description_.exposure_s = v4l2_exposure_s(controls_, device_.node(), picture_.width);
}

Received V4l2Source::receive(CameraFrame& into, std::chrono::milliseconds at_most) {
  check(into.codes.width == picture_.width && into.codes.height == picture_.height, "frame has the camera's size");
  const V4l2Stream::Wait waited = stream_->wait(at_most);
  if (waited == V4l2Stream::Wait::lost) return Received::lost;
  if (waited == V4l2Stream::Wait::nothing) return Received::nothing;
  const v4l2_buffer& buffer = stream_->filled();
  into.arrival = arrival_of(buffer);
  const std::span<const std::uint8_t> bytes = stream_->bytes();
  const bool complete = (buffer.flags & V4L2_BUF_FLAG_ERROR) == 0 && bytes.size() >= picture_.bytes();
  if (complete) unpack_rows(picture_, bytes, into.codes);
  stream_->release();
  return complete ? Received::frame : Received::incomplete;
}

}  // namespace

std::unique_ptr<CameraSource> open_v4l2_source(const CameraSettings& settings) {
  return std::make_unique<V4l2Source>(settings);
}

std::vector<FoundCamera> find_v4l2_cameras() {
  std::vector<FoundCamera> found;
  for (const std::string& node : v4l2_nodes()) {
    try {
      const V4l2Device device(node);
      const FoundCamera camera = identify_v4l2_camera(device);
      if (!v4l2_formats_of(device).empty()) found.push_back(camera);
    } catch (const InputError&) {  // not ours to open, or no camera: opening it by name tells why
    }
  }
  return found;
}

}  // namespace mf
