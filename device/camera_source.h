// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <optional>
#include <string>

#include "common/frame.h"
#include "common/image.h"
#include "common/session.h"
#include "device/camera_features.h"
#include "device/ptp.h"
#include "device/response_table.h"
#include "device/steady_settings.h"

namespace mf {

// What the operator asks of a camera. What is left open stays as the camera has it.
struct CameraSettings {
  // IP address, /dev/videoN, or the name that `mirrorfieldd --list` shows; empty: the first camera found
  std::string address;
  std::optional<std::string> pixel_format;      // as GenICam names it: BayerRG12, Mono12p ...
  std::optional<std::array<int, 4>> region_px;  // x, y, width, height
  std::optional<double> exposure_s;
  std::optional<double> gain_db;
  std::optional<double> gain_step_db;  // V4L2: what one step of the gain control is, which V4L2 does not tell
  std::optional<double> frame_rate_hz;
  std::optional<ResponseRequest> response;
  std::optional<bool> ptp;                     // whether the camera's clock follows the network's master (IEEE 1588)
  int packet_bytes = 1400;                     // GigE: fits every network; 8000 where jumbo frames pass
  int socket_buffer_bytes = 16 * 1024 * 1024;  // GigE: net.core.rmem_max must allow it
};

// What the camera is and how it is set, all of it read back.
struct CameraDescription {
  std::string vendor, model, serial;
  PixelFormat format;
  std::string wire_format;  // the pixel format's name on the wire
  int width = 0, height = 0;
  double exposure_s = 0;
  double gain_db = 0;
  double frame_rate_hz = 0;  // 0: unknown
  ResponseSetting response;
  SteadySettings steady;
  PtpReport ptp;
  std::string genicam_xml;  // empty when there is none
};

// A camera that answers, or a device that is there.
struct FoundCamera {
  std::string name;  // for CameraSettings::address
  std::string vendor, model, serial, address;
};

struct CameraFrame {
  ImageU16 codes;  // of the description's size; the caller allocates once, and again and again uses the same
  FrameArrival arrival;
};

enum class Received {
  frame,       // complete
  incomplete,  // the camera took it, but parts were lost on the way: arrival is set, codes are not
  nothing,     // within the time allowed
  lost,        // the camera is gone: destroy this source and open another
};

// The hardware seam: one open camera that takes frames by itself. Everything throws InputError naming the camera and
// what to do. One thread at a time.
class CameraSource {
 public:
  CameraSource() = default;
  CameraSource(const CameraSource&) = delete;
  CameraSource& operator=(const CameraSource&) = delete;
  virtual ~CameraSource() = default;

  [[nodiscard]] virtual const CameraDescription& description() const = 0;
  virtual void start() = 0;
  [[nodiscard]] virtual Received receive(CameraFrame& into, std::chrono::milliseconds at_most) = 0;
  // While it runs, too: frames that are on their way still have the old one. Read back into description().
  virtual void set_exposure_s(double) = 0;
  [[nodiscard]] virtual FeatureAccess& features() = 0;
};

}  // namespace mf
