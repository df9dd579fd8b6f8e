// SPDX-License-Identifier: Apache-2.0
#include "hw-sim/gige_registers.h"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "common/check.h"
#include "hw-sim/gige_camera.h"

namespace mf::sim {

namespace {

constexpr std::uint32_t description_at = 0x10000;
constexpr std::uint32_t first_writable_feature = 0x2000;

}  // namespace

GigeRegisters::GigeRegisters(const GigeCameraOptions& o) : formats_(o.more_formats) {
  formats_.insert(formats_.begin(), o.format);
  const std::string xml = gige_description(o);
  memory_.resize(description_at + (xml.size() + 3) / 4 * 4);
  std::copy(xml.begin(), xml.end(), memory_.begin() + description_at);
  set_bootstrap(o);
  set_text(0x0200, 512, fmt::format("Local:mirrorfield.xml;{:x};{:x}", description_at, xml.size()));
  set_features(o);
}

void GigeRegisters::set_bootstrap(const GigeCameraOptions& o) {
  set(0x0000, 0x00010002U);  // GigE Vision 1.2
  set(0x0004, 0x80000001U);  // big-endian, UTF-8
  set(0x000C, 0x4D460001U);  // MAC, lower half
  set(0x0010, 0x80000007U);  // can do persistent IP, DHCP, link-local
  set(0x0014, 0x00000005U);  // does
  in_addr address{};
  check(inet_pton(AF_INET, o.address.c_str(), &address) == 1, "the camera's address was tried before");
  set(0x0024, ntohl(address.s_addr));
  set(0x0034, 0xFF000000U);
  set_text(0x0048, 32, "Mirrorfield");
  set_text(0x0068, 32, "Simulated");
  set_text(0x0088, 32, "1");
  set_text(0x00D8, 16, o.serial);
  set(0x0600, 1U);           // network interfaces
  set(0x0904, 1U);           // stream channels
  set(0x0934, 0x00000007U);  // can concatenate, write memory, resend packets
  set(gige::heartbeat_timeout_ms, 3000U);
  set(gige::timestamp_frequency_low, 1'000'000'000U);
  set(gige::stream_packet_size, 1400U);
}

void GigeRegisters::set_features(const GigeCameraOptions& o) {
  set(gige::width, static_cast<std::uint32_t>(o.width));
  set(gige::height, static_cast<std::uint32_t>(o.height));
  set(gige::pixel_format, o.format.pfnc);
  set(gige::payload_size, static_cast<std::uint32_t>(picture_bytes()));
  set(gige::exposure_us, 1e6 * o.exposure_s);
  set(gige::frame_rate_hz, o.frame_rate_hz);
  set(gige::linlog_time_1, 1000U);
  set(gige::linlog_time_2, 1000U);
  set(gige::slope_count, 1U);
  set(gige::slope_selector, 1U);
  for (std::uint32_t knee = 0; knee < gige::most_slope_knees; ++knee) {
    set(gige::slope_times + 8 * knee, 100.0);
    set(gige::slope_levels + 8 * knee, 100.0);
  }
}

std::optional<std::span<const std::uint8_t>> GigeRegisters::read(std::uint32_t address, std::size_t size) const {
  if (address > memory_.size() || size > memory_.size() - address) return std::nullopt;
  return std::span(memory_).subspan(address, size);
}

std::optional<std::uint32_t> GigeRegisters::read(std::uint32_t address) const {
  const auto bytes = read(address, 4);
  if (!bytes) return std::nullopt;
  const auto& b = *bytes;
  return std::uint32_t{b[0]} << 24 | std::uint32_t{b[1]} << 16 | std::uint32_t{b[2]} << 8 | std::uint32_t{b[3]};
}

bool GigeRegisters::write(std::uint32_t address, std::span<const std::uint8_t> bytes) {
  const bool bootstrap = address >= gige::heartbeat_timeout_ms && address + bytes.size() <= 0x1000;
  const bool feature = address >= first_writable_feature && address + bytes.size() <= description_at;
  if (!(bootstrap || feature)) return false;
  if (bytes.size() == 4 && !takes(address, std::uint32_t{bytes[0]} << 24 | std::uint32_t{bytes[1]} << 16 |
                                               std::uint32_t{bytes[2]} << 8 | std::uint32_t{bytes[3]}))
    return false;
  std::copy(bytes.begin(), bytes.end(), memory_.begin() + address);
  limit_reals();
  const std::size_t chunks = read(gige::chunk_mode) == 1U ? gige_chunk::bytes : 0;
  set(gige::payload_size, static_cast<std::uint32_t>(picture_bytes() + chunks));
  return true;
}

// Integers beyond their limits are refused; real numbers are brought to theirs. Cameras do either.
bool GigeRegisters::takes(std::uint32_t address, std::uint32_t value) const {
  switch (address) {
    case gige::width:
    case gige::height:
    case gige::payload_size:
      return value == read(address);
    case gige::pixel_format:
      return std::any_of(formats_.begin(), formats_.end(), [&](const WireFormat& f) { return f.pfnc == value; });
    case gige::linlog_value_1:
    case gige::linlog_value_2:
      return value <= 200;
    case gige::linlog_time_1:
    case gige::linlog_time_2:
      return value <= 1000;
    case gige::slope_count:
    case gige::slope_selector:
      return value >= 1 && value <= gige::most_slope_knees;
    case gige::linlog_mode:
    case gige::slope_mode:
    case gige::ptp_enable:
    case gige::chunk_mode:
      return value <= 1;
    case gige::ptp_status:
    case gige::ptp_offset_ns:
    case gige::ptp_offset_ns + 4:
      return false;
    default:
      return true;
  }
}

void GigeRegisters::limit_reals() {
  const auto limit = [&](std::uint32_t address, double low, double high) {
    const double value = real(address);
    if (!(value >= low && value <= high)) set(address, value > high ? high : low);
  };
  limit(gige::exposure_us, 1, 1e7);
  limit(gige::gain_db, 0, 24);
  limit(gige::frame_rate_hz, 0.1, 1000);
  for (std::uint32_t knee = 0; knee < gige::most_slope_knees; ++knee) {
    limit(gige::slope_times + 8 * knee, 0, 100);
    limit(gige::slope_levels + 8 * knee, 0, 100);
  }
}

SensorResponse GigeRegisters::response() const {
  SensorResponse response;
  if (read(gige::linlog_mode) == 1U) {
    const auto share = [&](std::uint32_t address, double whole) { return read(address).value_or(0) / whole; };
    response = LinLogSensor{share(gige::linlog_value_1, 200), share(gige::linlog_value_2, 200),
                            share(gige::linlog_time_1, 1000), share(gige::linlog_time_2, 1000)};
  } else if (read(gige::slope_mode) == 1U) {
    MultiSlopeSensor slopes;
    for (std::uint32_t knee = 0; knee < read(gige::slope_count); ++knee)
      slopes.knees.push_back({real(gige::slope_times + 8 * knee) / 100, real(gige::slope_levels + 8 * knee) / 100});
    response = slopes;
  }
  return fault_of(response).empty() ? response : SensorResponse{};
}

WireFormat GigeRegisters::format() const {
  return *std::find_if(formats_.begin(), formats_.end(),
                       [&](const WireFormat& f) { return f.pfnc == read(gige::pixel_format); });
}

std::size_t GigeRegisters::picture_bytes() const {
  return format().bytes_for(std::size_t{read(gige::width).value_or(0)} * read(gige::height).value_or(0));
}

void GigeRegisters::set(std::uint32_t address, std::uint32_t value) {
  for (std::uint32_t i = 0; i < 4; ++i) memory_[address + i] = static_cast<std::uint8_t>(value >> (24 - 8 * i));
}

void GigeRegisters::set(std::uint32_t address, double value) {
  const auto bits = std::bit_cast<std::uint64_t>(value);
  set(address, static_cast<std::uint32_t>(bits >> 32));
  set(address + 4, static_cast<std::uint32_t>(bits));
}

double GigeRegisters::real(std::uint32_t address) const {
  return std::bit_cast<double>(std::uint64_t{read(address).value_or(0)} << 32 | read(address + 4).value_or(0));
}

void GigeRegisters::set_text(std::uint32_t address, std::size_t room, const std::string& text) {
  check(text.size() < room, "a register's text fits");
  std::copy(text.begin(), text.end(), memory_.begin() + address);
}

}  // namespace mf::sim
