// SPDX-License-Identifier: Apache-2.0
// A camera's own description, which comes over the network: read by Aravis, probed, set and read back by the tables.
// The first byte of an input is what the camera's memory is filled with.
#include <arv.h>

#include <stdexcept>
#include <string_view>

#include "common/error.h"
#include "device/aravis_features.h"
#include "device/ptp.h"
#include "device/response_table.h"
#include "device/steady_settings.h"
#include "tests/device/xml_device.h"
#include "tests/fuzz/fuzz_target.h"

namespace mf::fuzz {
namespace {

void require_one_line(std::string_view text) {
  if (text.empty() || text.find('\n') != std::string_view::npos)
    throw std::logic_error("not one line: " + std::string(text));
}

void require_lines(const std::vector<std::string>& remarks) {
  for (const std::string& remark : remarks) require_one_line(remark);
}

void try_response(FeatureAccess& features, const std::optional<ResponseRequest>& request) {
  try {
    const ResponseSetting setting = apply_response(features, request, 0.01);
    require_lines(setting.remarks);
    if (const auto curve = response_curve_of(setting, {PixelLayout::mono, 8}, 4); curve && curve->channels.size() != 1)
      throw std::logic_error("a curve has its channels");
  } catch (const InputError& e) {
    require_one_line(e.what());
  }
}

void run(std::span<const std::uint8_t> input) {
  if (input.empty()) return;
  static const bool quiet = [] {  // Aravis' and libxml's own words on bad descriptions
    g_log_set_default_handler([](const char*, GLogLevelFlags, const char*, void*) {}, nullptr);
    return true;
  }();
  (void)quiet;
  const std::string_view xml(reinterpret_cast<const char*>(input.data()) + 1, input.size() - 1);
  const test::XmlDevice device(xml, input[0]);
  if (device.get() == nullptr) return;
  AravisFeatures features("camera", device.get());
  (void)probe_response(features);
  require_lines(hold_steady(features).remarks);
  require_lines(set_ptp(features, true).remarks);
  try_response(features, std::nullopt);
  try_response(features, ResponseRequest{MultiSlopeSensor{{{0.9, 0.5}}}});
  try_response(features, ResponseRequest{LinLogSensor{0.5, 0.5, 1, 1}});
  try_response(features, ResponseRequest{LinearSensor{}});
}

std::string integer(const std::string& name, int address, const std::string& more = {}) {
  return "<IntReg Name=\"" + name + "\"><Address>" + std::to_string(address) +
         "</Address><Length>4</Length><AccessMode>RW</AccessMode><pPort>Device</pPort><Sign>Unsigned</Sign>"
         "<Endianess>BigEndian</Endianess>" +
         more + "</IntReg>\n";
}

std::string choice(const std::string& name, const std::string& on, int address) {
  return "<Enumeration Name=\"" + name + "\"><EnumEntry Name=\"Off\"><Value>0</Value></EnumEntry><EnumEntry Name=\"" +
         on + "\"><Value>1</Value></EnumEntry><pValue>" + name + "Reg</pValue></Enumeration>\n" +
         integer(name + "Reg", address);
}

std::string real(const std::string& name, int address) {
  return "<Float Name=\"" + name + "\"><pIsImplemented>Has</pIsImplemented><pValue>" + name +
         "Convert</pValue><Min>0</Min><pMax>Limit</pMax></Float>\n<Converter Name=\"" + name +
         "Convert\"><pVariable Name=\"S\">Limit</pVariable><FormulaTo>FROM * S / 100</FormulaTo><FormulaFrom>TO * 100 "
         "/ "
         "S</FormulaFrom><pValue>" +
         name + "Reg</pValue></Converter>\n<FloatReg Name=\"" + name + "Reg\"><Address>" + std::to_string(address) +
         "</Address><pIndex "
         "Offset=\"8\">MultiSlopeKneePointSelector</pIndex><Length>8</Length><AccessMode>RW</AccessMode>"
         "<pPort>Device</pPort><Endianess>BigEndian</Endianess></FloatReg>\n";
}

std::vector<std::string> seeds() {
  std::string xml =
      "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<RegisterDescription ModelName=\"Seed\" VendorName=\"Mirrorfield\" "
      "SchemaMajorVersion=\"1\" SchemaMinorVersion=\"0\" SchemaSubMinorVersion=\"1\">\n";
  xml += choice("MultiSlopeMode", "Manual", 0) + integer("MultiSlopeKneePointCount", 8) +
         integer("MultiSlopeKneePointSelector", 12) + real("MultiSlopeExposureLimit", 64) +
         real("MultiSlopeSaturationThreshold", 128);
  xml += choice("LinLog_Mode", "UserDefined", 16);
  int address = 20;
  for (const char* feature : {"LinLog_Value1", "LinLog_Value2", "LinLog_Time1", "LinLog_Time2"})
    xml += integer(feature, address += 4);
  xml += "<Boolean Name=\"PtpEnable\"><pValue>PtpReg</pValue></Boolean>\n" + integer("PtpReg", 48) +
         choice("ExposureAuto", "Continuous", 52) + integer("Has", 56);
  xml +=
      "<IntSwissKnife Name=\"Limit\"><pVariable Name=\"H\">Has</pVariable><Formula>(H = 0) ? 50 : 100</Formula>"
      "</IntSwissKnife>\n<Port Name=\"Device\"/>\n</RegisterDescription>\n";
  return {std::string(1, '\1') + xml, std::string(1, '\0') + xml, std::string(1, '\xFF') + xml};
}

}  // namespace

FuzzTarget fuzz_target() {
  return {run, seeds};
}

}  // namespace mf::fuzz
