// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

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
}  // namespace gige

// The camera's memory as a client sees it: bootstrap registers, our features, and the GenICam description. Big-endian.
class GigeRegisters {
 public:
  explicit GigeRegisters(const GigeCameraOptions&);

  // Nothing outside the memory.
  [[nodiscard]] std::optional<std::uint32_t> read(std::uint32_t address) const;
  [[nodiscard]] std::optional<std::span<const std::uint8_t>> read(std::uint32_t address, std::size_t size) const;
  // False outside the memory and for what a client may not write.
  [[nodiscard]] bool write(std::uint32_t address, std::span<const std::uint8_t> bytes);

  void set(std::uint32_t address, std::uint32_t value);
  void set(std::uint32_t address, double value);
  [[nodiscard]] double real(std::uint32_t address) const;

 private:
  void set_text(std::uint32_t address, std::size_t room, const std::string& text);
  std::vector<std::uint8_t> memory_;
};

// The GenICam description that GigeRegisters holds.
[[nodiscard]] std::string gige_description(const GigeCameraOptions&);

}  // namespace mf::sim
