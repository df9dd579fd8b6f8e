// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <string_view>
#include <utility>
#include <vector>

#include "hw-sim/gige_camera.h"
#include "hw-sim/gige_registers.h"

namespace mf::sim {

namespace {

std::string integer_node(const std::string& name, std::uint32_t address, const char* access) {
  return fmt::format(
      "<IntReg Name=\"{}\" "
      "NameSpace=\"Standard\"><Address>0x{:x}</Address><Length>4</Length><AccessMode>{}</AccessMode>"
      "<pPort>Device</pPort><Sign>Unsigned</Sign><Endianess>BigEndian</Endianess></IntReg>\n",
      name, address, access);
}

std::string real_node(const std::string& name, std::uint32_t address, double low, double high) {
  return fmt::format(
      "<Float Name=\"{0}\" NameSpace=\"Standard\"><pValue>{0}Reg</pValue><Min>{2}</Min><Max>{3}</Max></Float>\n"
      "<FloatReg Name=\"{0}Reg\" NameSpace=\"Custom\"><Address>0x{1:x}</Address><Length>8</Length>"
      "<AccessMode>RW</AccessMode><pPort>Device</pPort><Endianess>BigEndian</Endianess></FloatReg>\n",
      name, address, low, high);
}

std::string text_node(const std::string& name, std::uint32_t address, int length) {
  return fmt::format(
      "<StringReg Name=\"{}\" NameSpace=\"Standard\"><Address>0x{:x}</Address><Length>{}</Length>"
      "<AccessMode>RO</AccessMode><pPort>Device</pPort></StringReg>\n",
      name, address, length);
}

// One of several real numbers, that `selector` (from 1) chooses.
std::string selected_real(const std::string& name, std::uint32_t address, const std::string& selector) {
  return fmt::format(
      "<Float Name=\"{0}\" NameSpace=\"Standard\"><pValue>{0}Reg</pValue><Min>0</Min><Max>100</Max><Unit>%</Unit>"
      "</Float>\n<FloatReg Name=\"{0}Reg\" NameSpace=\"Custom\"><Address>0x{1:x}</Address>"
      "<pIndex Offset=\"8\">{2}</pIndex><Length>8</Length><AccessMode>RW</AccessMode><pPort>Device</pPort>"
      "<Endianess>BigEndian</Endianess></FloatReg>\n",
      name, address - 8, selector);
}

using Entries = std::vector<std::pair<std::string_view, std::uint32_t>>;
std::string choice_node(const std::string& name, const Entries& entries, std::uint32_t address,
                        const char* access = "RW") {
  std::string xml = fmt::format("<Enumeration Name=\"{}\" NameSpace=\"Standard\">", name);
  for (const auto& [entry, value] : entries)
    xml += fmt::format("<EnumEntry Name=\"{}\" NameSpace=\"Standard\"><Value>{}</Value></EnumEntry>", entry, value);
  return xml + fmt::format("<pValue>{}Reg</pValue></Enumeration>\n", name) +
         integer_node(name + "Reg", address, access);
}

std::string boolean_node(const std::string& name, std::uint32_t address) {
  return fmt::format("<Boolean Name=\"{0}\" NameSpace=\"Standard\"><pValue>{0}Reg</pValue></Boolean>\n", name) +
         integer_node(name + "Reg", address, "RW");
}

std::string command_node(const std::string& name, const std::string& target, int value) {
  return fmt::format(
      "<Command Name=\"{}\" NameSpace=\"Standard\"><pValue>{}</pValue><CommandValue>{}</CommandValue></Command>\n",
      name, target, value);
}

std::string response_nodes() {
  std::string xml = choice_node("LinLog_Mode", {{"Off", 0}, {"UserDefined", 1}}, gige::linlog_mode);
  for (const auto& [name, address] : {std::pair{"LinLog_Value1", gige::linlog_value_1},
                                      {"LinLog_Value2", gige::linlog_value_2},
                                      {"LinLog_Time1", gige::linlog_time_1},
                                      {"LinLog_Time2", gige::linlog_time_2}})
    xml += integer_node(name, address, "RW");
  xml += choice_node("MultiSlopeMode", {{"Off", 0}, {"Manual", 1}}, gige::slope_mode);
  xml += integer_node("MultiSlopeKneePointCount", gige::slope_count, "RW");
  xml += integer_node("MultiSlopeKneePointSelector", gige::slope_selector, "RW");
  xml += selected_real("MultiSlopeExposureLimit", gige::slope_times, "MultiSlopeKneePointSelector");
  return xml + selected_real("MultiSlopeSaturationThreshold", gige::slope_levels, "MultiSlopeKneePointSelector");
}

std::string clock_nodes() {
  return boolean_node("PtpEnable", gige::ptp_enable) +
         choice_node("PtpStatus", {{"Disabled", 3}, {"Slave", 9}}, gige::ptp_status, "RO") +
         command_node("PtpDataSetLatch", "PtpLatchReg", 1) + integer_node("PtpLatchReg", gige::ptp_latch, "RW") +
         fmt::format(
             "<IntReg Name=\"PtpOffsetFromMaster\" NameSpace=\"Standard\"><Address>0x{:x}</Address>"
             "<Length>8</Length><AccessMode>RO</AccessMode><pPort>Device</pPort><Sign>Signed</Sign>"
             "<Endianess>BigEndian</Endianess></IntReg>\n",
             gige::ptp_offset_ns);
}

std::string chunk_nodes() {
  return boolean_node("ChunkModeActive", gige::chunk_mode) +
         fmt::format(
             "<Port Name=\"TimestampPort\"><ChunkID>{:x}</ChunkID></Port>\n"
             "<IntReg Name=\"ChunkTimestamp\" NameSpace=\"Standard\"><Address>0</Address><Length>8</Length>"
             "<AccessMode>RO</AccessMode><pPort>TimestampPort</pPort><Sign>Unsigned</Sign>"
             "<Endianess>BigEndian</Endianess></IntReg>\n"
             "<Port Name=\"ExposurePort\"><ChunkID>{:x}</ChunkID></Port>\n"
             "<FloatReg Name=\"ChunkExposureTime\" NameSpace=\"Standard\"><Address>0</Address>"
             "<Length>8</Length><AccessMode>RO</AccessMode><pPort>ExposurePort</pPort>"
             "<Endianess>BigEndian</Endianess></FloatReg>\n",
             gige_chunk::timestamp, gige_chunk::exposure_us);
}

std::string acquisition_nodes(const GigeCameraOptions& o) {
  Entries formats{{o.format.name, o.format.pfnc}};
  for (const WireFormat& format : o.more_formats) formats.emplace_back(format.name, format.pfnc);
  return text_node("DeviceVendorName", 0x48, 32) + text_node("DeviceModelName", 0x68, 32) +
         text_node("DeviceID", 0xD8, 16) + integer_node("Width", gige::width, "RO") +
         integer_node("Height", gige::height, "RO") + integer_node("PayloadSize", gige::payload_size, "RO") +
         choice_node("PixelFormat", formats, gige::pixel_format) +
         choice_node("AcquisitionMode", {{"Continuous", 0}}, gige::acquisition_mode) +
         choice_node("TriggerMode", {{"Off", 0}}, gige::trigger_mode) +
         command_node("AcquisitionStart", "AcquisitionReg", 1) + command_node("AcquisitionStop", "AcquisitionReg", 0) +
         integer_node("AcquisitionReg", gige::acquisition, "RW") +
         real_node("ExposureTime", gige::exposure_us, 1, 1e7) + real_node("Gain", gige::gain_db, 0, 24) +
         real_node("AcquisitionFrameRate", gige::frame_rate_hz, 0.1, 1000);
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
  for (const char* feature : {"DeviceVendorName",
                              "DeviceModelName",
                              "DeviceID",
                              "Width",
                              "Height",
                              "PixelFormat",
                              "PayloadSize",
                              "AcquisitionMode",
                              "AcquisitionStart",
                              "AcquisitionStop",
                              "TriggerMode",
                              "ExposureTime",
                              "Gain",
                              "AcquisitionFrameRate",
                              "LinLog_Mode",
                              "LinLog_Value1",
                              "LinLog_Value2",
                              "LinLog_Time1",
                              "LinLog_Time2",
                              "MultiSlopeMode",
                              "MultiSlopeKneePointCount",
                              "MultiSlopeKneePointSelector",
                              "MultiSlopeExposureLimit",
                              "MultiSlopeSaturationThreshold",
                              "PtpEnable",
                              "PtpStatus",
                              "PtpDataSetLatch",
                              "PtpOffsetFromMaster",
                              "ChunkModeActive",
                              "ChunkTimestamp",
                              "ChunkExposureTime"})
    xml += fmt::format("<pFeature>{}</pFeature>", feature);
  xml += "</Category>\n" + acquisition_nodes(o);
  if (o.programmable_response) xml += response_nodes();
  xml += clock_nodes() + chunk_nodes();
  return xml + "<Port Name=\"Device\" NameSpace=\"Standard\"/>\n</RegisterDescription>\n";
}

}  // namespace mf::sim
