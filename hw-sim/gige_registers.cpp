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

std::string integer(const std::string& name, std::uint32_t address, const char* access) {
  return fmt::format(
      "<IntReg Name=\"{}\" "
      "NameSpace=\"Standard\"><Address>0x{:x}</Address><Length>4</Length><AccessMode>{}</AccessMode>"
      "<pPort>Device</pPort><Sign>Unsigned</Sign><Endianess>BigEndian</Endianess></IntReg>\n",
      name, address, access);
}

std::string real(const std::string& name, std::uint32_t address, double low, double high) {
  return fmt::format(
      "<Float Name=\"{0}\" NameSpace=\"Standard\"><pValue>{0}Reg</pValue><Min>{2}</Min><Max>{3}</Max></Float>\n"
      "<FloatReg Name=\"{0}Reg\" NameSpace=\"Custom\"><Address>0x{1:x}</Address><Length>8</Length>"
      "<AccessMode>RW</AccessMode><pPort>Device</pPort><Endianess>BigEndian</Endianess></FloatReg>\n",
      name, address, low, high);
}

std::string text(const std::string& name, std::uint32_t address, int length) {
  return fmt::format(
      "<StringReg Name=\"{}\" NameSpace=\"Standard\"><Address>0x{:x}</Address><Length>{}</Length>"
      "<AccessMode>RO</AccessMode><pPort>Device</pPort></StringReg>\n",
      name, address, length);
}

std::string choice(const std::string& name, const std::string& entry, std::uint32_t value, std::uint32_t address) {
  return fmt::format(
             "<Enumeration Name=\"{0}\" NameSpace=\"Standard\"><EnumEntry Name=\"{1}\" NameSpace=\"Standard\">"
             "<Value>{2}</Value></EnumEntry><pValue>{0}Reg</pValue></Enumeration>\n",
             name, entry, value) +
         integer(name + "Reg", address, "RW");
}

}  // namespace

std::string gige_description(const GigeCameraOptions& o) {
  std::string xml =
      "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
      "<RegisterDescription ModelName=\"Simulated\" VendorName=\"Mirrorfield\" StandardNameSpace=\"None\" "
      "SchemaMajorVersion=\"1\" SchemaMinorVersion=\"0\" SchemaSubMinorVersion=\"1\" MajorVersion=\"1\" "
      "MinorVersion=\"0\" SubMinorVersion=\"0\" ToolTip=\"\" ProductGuid=\"0\" VersionGuid=\"0\" "
      "xmlns=\"http://www.genicam.org/GenApi/Version_1_0\">\n"
      "<Category Name=\"Root\" NameSpace=\"Standard\">";
  for (const char* feature : {"DeviceVendorName", "DeviceModelName", "DeviceID", "Width", "Height", "PixelFormat",
                              "PayloadSize", "AcquisitionMode", "AcquisitionStart", "AcquisitionStop", "TriggerMode",
                              "ExposureTime", "Gain", "AcquisitionFrameRate"})
    xml += fmt::format("<pFeature>{}</pFeature>", feature);
  xml += "</Category>\n";
  xml += text("DeviceVendorName", 0x48, 32) + text("DeviceModelName", 0x68, 32) + text("DeviceID", 0xD8, 16);
  xml += integer("Width", gige::width, "RO") + integer("Height", gige::height, "RO");
  xml += integer("PayloadSize", gige::payload_size, "RO");
  xml += choice("PixelFormat", std::string(o.format.name), o.format.pfnc, gige::pixel_format);
  xml += choice("AcquisitionMode", "Continuous", 0, gige::acquisition_mode);
  xml += choice("TriggerMode", "Off", 0, gige::trigger_mode);
  for (const auto& [name, value] : {std::pair{"AcquisitionStart", 1}, std::pair{"AcquisitionStop", 0}})
    xml += fmt::format(
        "<Command Name=\"{}\" NameSpace=\"Standard\"><pValue>AcquisitionReg</pValue><CommandValue>{}</CommandValue>"
        "</Command>\n",
        name, value);
  xml += integer("AcquisitionReg", gige::acquisition, "RW");
  xml += real("ExposureTime", gige::exposure_us, 1, 1e7) + real("Gain", gige::gain_db, 0, 24);
  xml += real("AcquisitionFrameRate", gige::frame_rate_hz, 0.1, 1000);
  return xml + "<Port Name=\"Device\" NameSpace=\"Standard\"/>\n</RegisterDescription>\n";
}

GigeRegisters::GigeRegisters(const GigeCameraOptions& o) {
  const std::string xml = gige_description(o);
  memory_.resize(description_at + (xml.size() + 3) / 4 * 4);
  std::copy(xml.begin(), xml.end(), memory_.begin() + description_at);
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
  set_text(0x0200, 512, fmt::format("Local:mirrorfield.xml;{:x};{:x}", description_at, xml.size()));
  set(0x0600, 1U);           // network interfaces
  set(0x0904, 1U);           // stream channels
  set(0x0934, 0x00000007U);  // can concatenate, write memory, resend packets
  set(gige::heartbeat_timeout_ms, 3000U);
  set(gige::timestamp_frequency_low, 1'000'000'000U);
  set(gige::stream_packet_size, 1400U);
  set(gige::width, static_cast<std::uint32_t>(o.width));
  set(gige::height, static_cast<std::uint32_t>(o.height));
  set(gige::pixel_format, o.format.pfnc);
  set(gige::payload_size, static_cast<std::uint32_t>(o.format.bytes_for(static_cast<std::size_t>(o.width) *
                                                                        static_cast<std::size_t>(o.height))));
  set(gige::exposure_us, 1e6 * o.exposure_s);
  set(gige::frame_rate_hz, o.frame_rate_hz);
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
  const bool fixed = address >= gige::width && address <= gige::payload_size;
  if (!(bootstrap || feature)) return false;
  // The only value that there is may be written.
  if (fixed) return std::equal(bytes.begin(), bytes.end(), memory_.begin() + address);
  std::copy(bytes.begin(), bytes.end(), memory_.begin() + address);
  return true;
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
