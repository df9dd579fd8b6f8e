// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/sensor_response.h"
#include "device/pixel_packing.h"

namespace mf::sim {

struct GigeCameraOptions;

// Addresses of GigE Vision's bootstrap registers (1.2, §27), and of our own features.
namespace gige {
inline constexpr std::uint32_t heartbeat_timeout_ms = 0x0938;
inline constexpr std::uint32_t timestamp_frequency_low = 0x0940;
inline constexpr std::uint32_t timestamp_control = 0x0944;
inline constexpr std::uint32_t timestamp_high = 0x0948;
inline constexpr std::uint32_t timestamp_low = 0x094C;
inline constexpr std::uint32_t control_privilege = 0x0A00;
inline constexpr std::uint32_t stream_port = 0x0D00;
inline constexpr std::uint32_t stream_packet_size = 0x0D04;
inline constexpr std::uint32_t stream_destination = 0x0D18;
inline constexpr std::uint32_t acquisition = 0x2000;  // 1: running
inline constexpr std::uint32_t acquisition_mode = 0x2004;
inline constexpr std::uint32_t width = 0x2008;
inline constexpr std::uint32_t height = 0x200C;
inline constexpr std::uint32_t pixel_format = 0x2010;
inline constexpr std::uint32_t payload_size = 0x2014;
inline constexpr std::uint32_t trigger_mode = 0x2018;
inline constexpr std::uint32_t exposure_us = 0x2020;    // IEEE double
inline constexpr std::uint32_t gain_db = 0x2028;        // IEEE double
inline constexpr std::uint32_t frame_rate_hz = 0x2030;  // IEEE double

inline constexpr std::uint32_t linlog_mode = 0x2040;     // 0 off, 1 user-defined
inline constexpr std::uint32_t linlog_value_1 = 0x2044;  // 0 to 200, also value 2
inline constexpr std::uint32_t linlog_value_2 = 0x2048;
inline constexpr std::uint32_t linlog_time_1 = 0x204C;  // 0 to 1000 of the exposure time, also time 2
inline constexpr std::uint32_t linlog_time_2 = 0x2050;
inline constexpr std::uint32_t slope_mode = 0x2060;      // 0 off, 1 manual
inline constexpr std::uint32_t slope_count = 0x2064;     // knees, 1 to most_slope_knees
inline constexpr std::uint32_t slope_selector = 0x2068;  // 1 to most_slope_knees
inline constexpr std::uint32_t slope_times = 0x2080;     // IEEE doubles, one a knee: % of the exposure
inline constexpr std::uint32_t slope_levels = 0x20A0;    // IEEE doubles, one a knee: % of saturation
inline constexpr int most_slope_knees = 3;
inline constexpr std::uint32_t ptp_enable = 0x2100;
inline constexpr std::uint32_t ptp_status = 0x2104;  // 0 disabled, 9 slave, after IEEE 1588's states
inline constexpr std::uint32_t ptp_latch = 0x2108;
inline constexpr std::uint32_t ptp_offset_ns = 0x2110;  // 64 bits, signed; as latched
inline constexpr std::uint32_t chunk_mode = 0x2120;
}  // namespace gige

// The picture's identity, then timestamp and exposure time: what a frame ends with when chunks are on (big-endian).
namespace gige_chunk {
inline constexpr std::uint32_t image = 0x0000;
inline constexpr std::uint32_t timestamp = 0x1001;     // 64 bits, ns
inline constexpr std::uint32_t exposure_us = 0x1002;   // IEEE double
inline constexpr std::uint32_t bytes = 3 * 8 + 8 + 8;  // of all of them, image apart
}  // namespace gige_chunk

// The camera's memory as a client sees it: bootstrap registers, our features, and the GenICam description. Big-endian.
class GigeRegisters {
 public:
  explicit GigeRegisters(const GigeCameraOptions&);

  // Nothing outside the memory.
  [[nodiscard]] std::optional<std::uint32_t> read(std::uint32_t address) const;
  [[nodiscard]] std::optional<std::span<const std::uint8_t>> read(std::uint32_t address, std::size_t size) const;
  // False outside the memory and for what a client may not write.
  [[nodiscard]] bool write(std::uint32_t address, std::span<const std::uint8_t> bytes);

  // The response that is set; linear where what is set is no response.
  [[nodiscard]] SensorResponse response() const;
  [[nodiscard]] WireFormat format() const;
  [[nodiscard]] std::size_t picture_bytes() const;  // of one frame in that format, chunks apart

  void set(std::uint32_t address, std::uint32_t value);
  void set(std::uint32_t address, double value);
  [[nodiscard]] double real(std::uint32_t address) const;

 private:
  void set_bootstrap(const GigeCameraOptions&);
  void set_features(const GigeCameraOptions&);
  void set_text(std::uint32_t address, std::size_t room, const std::string& text);
  [[nodiscard]] bool takes(std::uint32_t address, std::uint32_t value) const;
  void limit_reals();
  std::vector<WireFormat> formats_;
  std::vector<std::uint8_t> memory_;
};

// The GenICam description that GigeRegisters holds.
[[nodiscard]] std::string gige_description(const GigeCameraOptions&);

}  // namespace mf::sim
