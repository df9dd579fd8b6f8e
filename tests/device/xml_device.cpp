// SPDX-License-Identifier: Apache-2.0
#include "tests/device/xml_device.h"

#include <arv.h>

#include <map>
#include <string>

namespace {

struct State {
  std::string xml;
  std::uint8_t blank = 0;
  std::map<std::uint64_t, std::uint8_t> memory;
  ArvGc* genicam = nullptr;
};

struct XmlArvDevice {
  ArvDevice parent;
  State* state;
};
struct XmlArvDeviceClass {
  ArvDeviceClass parent;
};

State& state_of(ArvDevice* device) {
  return *reinterpret_cast<XmlArvDevice*>(device)->state;
}

gboolean read_memory(ArvDevice* device, guint64 address, guint32 size, void* buffer, GError** /*error*/) {
  const State& state = state_of(device);
  auto* bytes = static_cast<std::uint8_t*>(buffer);
  for (guint32 i = 0; i < size; ++i) {
    const auto kept = state.memory.find(address + i);
    bytes[i] = kept != state.memory.end() ? kept->second : state.blank;
  }
  return TRUE;
}

gboolean write_memory(ArvDevice* device, guint64 address, guint32 size, void* buffer, GError** /*error*/) {
  const auto* bytes = static_cast<const std::uint8_t*>(buffer);
  for (guint32 i = 0; i < size; ++i) state_of(device).memory[address + i] = bytes[i];
  return TRUE;
}

gboolean read_register(ArvDevice* device, guint64 address, guint32* value, GError** error) {
  return read_memory(device, address, sizeof *value, value, error);
}
gboolean write_register(ArvDevice* device, guint64 address, guint32 value, GError** error) {
  return write_memory(device, address, sizeof value, &value, error);
}

ArvGc* get_genicam(ArvDevice* device) {
  return state_of(device).genicam;
}
const char* get_genicam_xml(ArvDevice* device, std::size_t* size) {
  *size = state_of(device).xml.size();
  return state_of(device).xml.c_str();
}

void finalize(GObject* object) {
  State* state = reinterpret_cast<XmlArvDevice*>(object)->state;
  if (state->genicam != nullptr) g_object_unref(state->genicam);
  delete state;
  auto* parent = static_cast<GObjectClass*>(g_type_class_peek(ARV_TYPE_DEVICE));
  parent->finalize(object);
}

void init_class(void* type, void* /*data*/) {
  static_cast<GObjectClass*>(type)->finalize = finalize;
  auto* device = static_cast<ArvDeviceClass*>(type);
  device->read_memory = read_memory;
  device->write_memory = write_memory;
  device->read_register = read_register;
  device->write_register = write_register;
  device->get_genicam = get_genicam;
  device->get_genicam_xml = get_genicam_xml;
}

GType xml_device_type() {
  static const GType type = [] {
    GTypeInfo info{};
    info.class_size = sizeof(XmlArvDeviceClass);
    info.class_init = init_class;
    info.instance_size = sizeof(XmlArvDevice);
    return g_type_register_static(ARV_TYPE_DEVICE, "MirrorfieldXmlDevice", &info, G_TYPE_FLAG_NONE);
  }();
  return type;
}

}  // namespace

namespace mf::test {

XmlDevice::XmlDevice(std::string_view xml, std::uint8_t blank) {
  auto* object = static_cast<XmlArvDevice*>(g_object_new(xml_device_type(), nullptr));
  object->state = new State{std::string(xml), blank, {}, nullptr};
  device_ = &object->parent;
  object->state->genicam = arv_gc_new(device_, object->state->xml.data(), object->state->xml.size());
  if (object->state->genicam != nullptr) return;
  g_object_unref(device_);
  device_ = nullptr;
}

XmlDevice::~XmlDevice() {
  if (device_ != nullptr) g_object_unref(device_);
}

}  // namespace mf::test
