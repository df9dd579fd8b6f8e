// SPDX-License-Identifier: Apache-2.0
#include "device/v4l2_identity.h"

#include <fmt/format.h>
#include <libudev.h>
#include <linux/videodev2.h>
#include <sys/stat.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <sstream>
#include <string_view>

#include "common/error.h"

namespace mf {

namespace {

struct UdevRelease {
  void operator()(udev* context) const { udev_unref(context); }
  void operator()(udev_device* device) const { udev_device_unref(device); }
  void operator()(udev_enumerate* list) const { udev_enumerate_unref(list); }
};
template <typename T>
using UdevPointer = std::unique_ptr<T, UdevRelease>;

template <std::size_t size>
std::string fixed_text(const __u8 (&text)[size]) {
  const auto* characters = reinterpret_cast<const char*>(text);
  return {characters, strnlen(characters, size)};
}

std::string property(udev_device* device, const char* name) {
  const char* value = udev_device_get_property_value(device, name);
  return value == nullptr ? std::string() : std::string(value);
}

v4l2_capability capability_of(const V4l2Device& device) {
  v4l2_capability capability{};
  device.demand(VIDIOC_QUERYCAP, &capability, "address", "it is no V4L2 camera; choose one from `mirrorfieldd --list`");
  const bool own = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0;
  const std::uint32_t can = own ? capability.device_caps : capability.capabilities;
  if ((can & V4L2_CAP_VIDEO_CAPTURE_MPLANE) != 0)
    throw InputError(
        device.node(), "address",
        "gives its frames in several planes, which cannot be recorded: choose another node of this camera");
  if ((can & V4L2_CAP_VIDEO_CAPTURE) == 0)
    throw InputError(device.node(), "address",
                     "takes no pictures (a camera may have several nodes): choose one from `mirrorfieldd --list`");
  if ((can & V4L2_CAP_STREAMING) == 0)
    throw InputError(device.node(), "address", "cannot stream into mapped memory: choose another camera");
  return capability;
}

// What udev adds: maker, serial number, lasting name.
void add_from_udev(FoundCamera& camera, const V4l2Device& device) {
  struct stat status {};
  if (::stat(device.target().c_str(), &status) != 0) return;
  const UdevPointer<udev> context(udev_new());
  if (context == nullptr) return;
  const UdevPointer<udev_device> known(udev_device_new_from_devnum(context.get(), 'c', status.st_rdev));
  if (known == nullptr) return;
  if (std::string vendor = property(known.get(), "ID_VENDOR"); !vendor.empty()) camera.vendor = std::move(vendor);
  camera.serial = property(known.get(), "ID_SERIAL_SHORT");
  std::istringstream links(property(known.get(), "DEVLINKS"));
  for (std::string link; links >> link;)
    if (link.starts_with("/dev/v4l/by-id/")) camera.name = link;
}

}  // namespace

FoundCamera identify_v4l2_camera(const V4l2Device& device) {
  const v4l2_capability capability = capability_of(device);
  FoundCamera camera;
  camera.name = device.node();
  camera.address = device.target();
  camera.vendor = fixed_text(capability.driver);
  camera.model = fixed_text(capability.card);
  add_from_udev(camera, device);
  if (camera.serial.empty()) camera.serial = fixed_text(capability.bus_info);
  return camera;
}

std::vector<std::string> v4l2_nodes() {
  const UdevPointer<udev> context(udev_new());
  if (context == nullptr) return {};
  const UdevPointer<udev_enumerate> list(udev_enumerate_new(context.get()));
  if (list == nullptr) return {};
  udev_enumerate_add_match_subsystem(list.get(), "video4linux");
  udev_enumerate_scan_devices(list.get());
  std::vector<std::string> nodes;
  udev_list_entry* entry = nullptr;
  udev_list_entry_foreach(entry, udev_enumerate_get_list_entry(list.get())) {
    const UdevPointer<udev_device> device(udev_device_new_from_syspath(context.get(), udev_list_entry_get_name(entry)));
    const char* node = device == nullptr ? nullptr : udev_device_get_devnode(device.get());
    if (node != nullptr && std::string_view(node).starts_with("/dev/video")) nodes.emplace_back(node);
  }
  const auto before = [](const std::string& a, const std::string& b) {  // video2 before video10
    return a.size() != b.size() ? a.size() < b.size() : a < b;
  };
  std::sort(nodes.begin(), nodes.end(), before);
  return nodes;
}

}  // namespace mf
