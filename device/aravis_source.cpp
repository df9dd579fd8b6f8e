// SPDX-License-Identifier: Apache-2.0
#include "device/aravis_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <span>

#include "common/check.h"
#include "common/error.h"
#include "device/aravis_features.h"
#include "device/aravis_handles.h"
#include "device/clock.h"
#include "device/gige_control.h"
#include "device/pixel_packing.h"

namespace mf {

namespace {

// Aravis notes CLOCK_REALTIME when a frame's last packet comes; the frame may have waited since.
FrameArrival arrival_of(ArvBuffer* buffer) {
  const std::int64_t realtime_now = clock_ns(CLOCK_REALTIME), monotonic_now = clock_ns(CLOCK_MONOTONIC);
  const auto noted = static_cast<std::int64_t>(arv_buffer_get_system_timestamp(buffer));
  const std::int64_t waited = noted > 0 ? std::max<std::int64_t>(realtime_now - noted, 0) : 0;
  return {static_cast<std::int64_t>(arv_buffer_get_frame_id(buffer)),
          static_cast<std::int64_t>(arv_buffer_get_timestamp(buffer)), monotonic_now - waited, realtime_now - waited};
}

class AravisSource final : public CameraSource {
 public:
  explicit AravisSource(const CameraSettings& settings);
  ~AravisSource() override;

  [[nodiscard]] const CameraDescription& description() const override { return description_; }
  void start() override;
  [[nodiscard]] Received receive(CameraFrame& into, std::chrono::milliseconds at_most) override;
  void set_exposure_s(double exposure_s) override;
  [[nodiscard]] FeatureAccess& features() override { return *features_; }

 private:
  static void on_control_lost(ArvDevice*, void* lost) { static_cast<std::atomic<bool>*>(lost)->store(true); }
  static void on_stream_event(void*, ArvStreamCallbackType, ArvBuffer*);
  void apply(const CameraSettings&);
  void describe();
  void open_stream(const CameraSettings&);
  [[nodiscard]] bool unpack_into(ArvBuffer*, CameraFrame&) const;

  std::string name_;
  GObjectPointer<ArvCamera> camera_;
  GObjectPointer<ArvStream> stream_;        // after the camera, so that it goes first
  std::optional<AravisFeatures> features_;  // once the camera is open
  WireFormat wire_;
  CameraDescription description_;
  std::atomic<bool> lost_ = false;
  bool started_ = false;
  std::optional<GigeControl> control_;  // of a GigE camera; after the camera, which it may be asking
};

AravisSource::AravisSource(const CameraSettings& settings)
    : name_(settings.address.empty() ? "camera" : settings.address) {
  Failure failure(name_, "address");
  camera_.reset(arv_camera_new(settings.address.empty() ? nullptr : settings.address.c_str(), failure));
  failure.raise_if_any("see `mirrorfieldd --list`");
  if (camera_ == nullptr) throw InputError(name_, "address", "no camera answers: see `mirrorfieldd --list`");
  features_.emplace(name_, arv_camera_get_device(camera_.get()));
  description_.steady = hold_steady(*features_);
  apply(settings);
  describe();
  description_.response = apply_response(*features_, settings.response, description_.exposure_s);
  description_.ptp = settings.ptp ? set_ptp(*features_, *settings.ptp) : read_ptp(*features_);
  open_stream(settings);
  g_signal_connect(arv_camera_get_device(camera_.get()), "control-lost", G_CALLBACK(on_control_lost), &lost_);
}

AravisSource::~AravisSource() {
  g_signal_handlers_disconnect_by_data(arv_camera_get_device(camera_.get()), &lost_);
  if (started_ && !lost_) arv_camera_stop_acquisition(camera_.get(), nullptr);
}

void AravisSource::apply(const CameraSettings& s) {
  ArvCamera* camera = camera_.get();
  const auto set = [&](const char* field, const char* remedy, auto&& call) {
    Failure failure(name_, field);
    call(failure);
    failure.raise_if_any(remedy);
  };
  if (s.pixel_format)
    set("pixel_format", "choose one that the camera has",
        [&](GError** error) { arv_camera_set_pixel_format_from_string(camera, s.pixel_format->c_str(), error); });
  if (s.region_px)
    set("region_px", "stay within the sensor and its steps", [&](GError** error) {
      const auto& r = *s.region_px;
      arv_camera_set_region(camera, r[0], r[1], r[2], r[3], error);
    });
  if (s.exposure_s)
    set("exposure_s", "choose another",
        [&](GError** error) { arv_camera_set_exposure_time(camera, *s.exposure_s * 1e6, error); });
  if (s.gain_db)
    set("gain_db", "choose another, or leave it out",
        [&](GError** error) { arv_camera_set_gain(camera, *s.gain_db, error); });
  if (s.frame_rate_hz)
    set("frame_rate_hz", "choose a lower one",
        [&](GError** error) { arv_camera_set_frame_rate(camera, *s.frame_rate_hz, error); });
  if (arv_camera_is_gv_device(camera) != 0) {
    // A broadcast can name another interface than the stream's, and packet sockets then receive nothing.
    arv_camera_gv_set_stream_options(camera, ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
    set("packet_bytes", "choose a smaller one",
        [&](GError** error) { arv_camera_gv_set_packet_size(camera, s.packet_bytes, error); });
  } else if (arv_camera_is_uv_device(camera) != 0) {
    arv_camera_uv_set_usb_mode(camera, ARV_UV_USB_MODE_ASYNC);
  }
}

void AravisSource::describe() {
  ArvCamera* camera = camera_.get();
  Failure failure(name_, "");
  CameraDescription& d = description_;
  d.vendor = text_or_empty(arv_camera_get_vendor_name(camera, nullptr));
  d.model = text_or_empty(arv_camera_get_model_name(camera, nullptr));
  d.serial = text_or_empty(arv_camera_get_device_serial_number(camera, nullptr));
  d.wire_format = text_or_empty(arv_camera_get_pixel_format_as_string(camera, failure));
  failure.raise_if_any("the camera does not tell its pixel format");
  const std::optional<WireFormat> wire = wire_format(d.wire_format);
  if (!wire)
    throw InputError(name_, "pixel_format",
                     fmt::format("{} cannot be recorded: set Mono or Bayer, 8 to 16 bits", d.wire_format));
  wire_ = *wire;
  d.format = wire_.format;
  int x = 0, y = 0;
  arv_camera_get_region(camera, &x, &y, &d.width, &d.height, failure);
  failure.raise_if_any("the camera does not tell its region");
  d.exposure_s = 1e-6 * arv_camera_get_exposure_time(camera, failure);
  failure.raise_if_any("the camera does not tell its exposure time");
  if (arv_camera_is_feature_available(camera, "Gain", nullptr) != 0) d.gain_db = arv_camera_get_gain(camera, nullptr);
  d.frame_rate_hz = arv_camera_get_frame_rate(camera, nullptr);
  std::size_t size = 0;
  if (const char* xml = arv_device_get_genicam_xml(arv_camera_get_device(camera), &size); xml != nullptr)
    d.genicam_xml.assign(xml, size);
}

// The stream's own thread: when it waits for a core, the socket's buffer overflows in a frame's time or two.
void AravisSource::on_stream_event(void*, ArvStreamCallbackType type, ArvBuffer*) {
  constexpr int lowest_realtime = 1, above_others = -10;
  if (type == ARV_STREAM_CALLBACK_TYPE_INIT && arv_make_thread_realtime(lowest_realtime) == 0)
    arv_make_thread_high_priority(above_others);  // neither is given to everybody; without, it works on a quiet machine
}

void AravisSource::open_stream(const CameraSettings& settings) {
  Failure failure(name_, "");
  stream_.reset(arv_camera_create_stream(camera_.get(), on_stream_event, nullptr, failure));
  failure.raise_if_any("another program may have the camera");
  if (stream_ == nullptr) throw InputError(name_, "", "gives no stream: another program may have the camera");
  constexpr unsigned frame_retention_us = 500'000;  // for packets that are asked for again on a busy board
  constexpr double packet_request_ratio = 1;        // a frame may lose all its packets at first, and be asked for again
  if (ARV_IS_GV_STREAM(stream_.get()))
    g_object_set(stream_.get(), "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED, "socket-buffer-size",
                 settings.socket_buffer_bytes, "packet-resend", ARV_GV_STREAM_PACKET_RESEND_ALWAYS, "frame-retention",
                 frame_retention_us, "packet-request-ratio", packet_request_ratio, nullptr);
  const std::size_t payload = arv_camera_get_payload(camera_.get(), failure);
  failure.raise_if_any("the camera does not tell the size of its frames");
  constexpr int stream_buffers = 24;  // two thirds of a second at 37 frames a second
  for (int i = 0; i < stream_buffers; ++i) arv_stream_push_buffer(stream_.get(), arv_buffer_new_allocate(payload));
}

void AravisSource::set_exposure_s(double exposure_s) {
  Failure failure(name_, "exposure_s");
  arv_camera_set_exposure_time(camera_.get(), exposure_s * 1e6, failure);
  failure.raise_if_any("choose another");
  description_.exposure_s = 1e-6 * arv_camera_get_exposure_time(camera_.get(), failure);
  failure.raise_if_any("the camera does not tell its exposure time");
  if (description_.response.scheme != "linear")  // knees may be times
    description_.response = apply_response(*features_, std::nullopt, description_.exposure_s);
}

void AravisSource::start() {
  Failure failure(name_, "");
  arv_camera_set_acquisition_mode(camera_.get(), ARV_ACQUISITION_MODE_CONTINUOUS, nullptr);
  arv_camera_start_acquisition(camera_.get(), failure);
  failure.raise_if_any("the camera does not start");
  started_ = true;
  if (arv_camera_is_gv_device(camera_.get()) == 0) return;
  const double rate_hz = std::max(description_.frame_rate_hz, 0.1);
  const std::chrono::milliseconds patience(250 + static_cast<int>(2000 / rate_hz));  // two frames, and their resending
  control_.emplace(arv_camera_get_device(camera_.get()), patience);
}

bool AravisSource::unpack_into(ArvBuffer* buffer, CameraFrame& into) const {
  if (arv_buffer_get_image_width(buffer) != description_.width ||
      arv_buffer_get_image_height(buffer) != description_.height ||
      arv_buffer_get_image_pixel_format(buffer) != wire_.pfnc)
    return false;
  std::size_t size = 0;
  const auto* bytes = static_cast<const std::uint8_t*>(arv_buffer_get_image_data(buffer, &size));
  if (bytes == nullptr || size < wire_.bytes_for(into.codes.data.size())) return false;
  unpack(wire_, {bytes, size}, into.codes.data);
  return true;
}

Received AravisSource::receive(CameraFrame& into, std::chrono::milliseconds at_most) {
  check(into.codes.width == description_.width && into.codes.height == description_.height,
        "frame has the camera's size");
  const auto us = std::chrono::duration_cast<std::chrono::microseconds>(at_most).count();
  ArvBuffer* buffer = arv_stream_timeout_pop_buffer(stream_.get(), static_cast<guint64>(us));
  if (buffer == nullptr) {
    if (control_ && control_->is_lost()) lost_ = true;
    return lost_ ? Received::lost : Received::nothing;
  }
  if (control_) control_->note_frame();
  into.arrival = arrival_of(buffer);
  const bool complete = arv_buffer_get_status(buffer) == ARV_BUFFER_STATUS_SUCCESS && unpack_into(buffer, into);
  arv_stream_push_buffer(stream_.get(), buffer);
  return complete ? Received::frame : Received::incomplete;
}

}  // namespace

std::unique_ptr<CameraSource> open_aravis_source(const CameraSettings& settings) {
  return std::make_unique<AravisSource>(settings);
}

std::vector<FoundCamera> find_aravis_cameras() {
  arv_update_device_list();
  std::vector<FoundCamera> found;
  for (unsigned i = 0; i < arv_get_n_devices(); ++i)
    found.push_back({text_or_empty(arv_get_device_id(i)), text_or_empty(arv_get_device_vendor(i)),
                     text_or_empty(arv_get_device_model(i)), text_or_empty(arv_get_device_serial_nbr(i)),
                     text_or_empty(arv_get_device_address(i))});
  return found;
}

}  // namespace mf
