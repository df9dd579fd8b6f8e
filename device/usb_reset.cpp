// SPDX-License-Identifier: Apache-2.0
#include "device/usb_reset.h"

#include <fmt/format.h>
#include <libusb-1.0/libusb.h>

#include <cstdlib>
#include <optional>
#include <vector>

#include "device/udev_handle.h"

namespace mf {

namespace {

struct UsbAddress {
  int bus = 0, device = 0;
};

std::string attribute(udev_device* device, const char* name) {
  const char* value = udev_device_get_sysattr_value(device, name);
  return value == nullptr ? "" : value;
}

int number(udev_device* device, const char* name, int base) {
  return static_cast<int>(std::strtol(attribute(device, name).c_str(), nullptr, base));
}

bool fits(udev_device* device, const UsbDeviceName& name) {
  return (name.vendor_id == 0 || number(device, "idVendor", 16) == name.vendor_id) &&
         (name.product_id == 0 || number(device, "idProduct", 16) == name.product_id) &&
         (name.serial.empty() || attribute(device, "serial") == name.serial);
}

std::vector<UsbAddress> addresses_of(const UsbDeviceName& name) {
  const Udev library(udev_new());
  const UdevEnumerate found(udev_enumerate_new(library.get()));
  udev_enumerate_add_match_subsystem(found.get(), "usb");
  udev_enumerate_add_match_property(found.get(), "DEVTYPE", "usb_device");
  udev_enumerate_scan_devices(found.get());
  std::vector<UsbAddress> addresses;
  for (udev_list_entry* e = udev_enumerate_get_list_entry(found.get()); e != nullptr; e = udev_list_entry_get_next(e)) {
    const UdevDevice device(udev_device_new_from_syspath(library.get(), udev_list_entry_get_name(e)));
    if (device && fits(device.get(), name))
      addresses.push_back({number(device.get(), "busnum", 10), number(device.get(), "devnum", 10)});
  }
  return addresses;
}

UsbResetOutcome refused(std::string why) {
  return {UsbResetOutcome::Result::refused, std::move(why)};
}

UsbResetOutcome reset(libusb_device* device) {
  libusb_device_handle* handle = nullptr;
  const int opened = libusb_open(device, &handle);
  if (opened != LIBUSB_SUCCESS)
    return refused(
        fmt::format("the USB device cannot be opened: {}: see udev/60-mirrorfield.rules", libusb_strerror(opened)));
  const int done = libusb_reset_device(handle);
  libusb_close(handle);
  // Not found: it came back as another device, and whoever opens it next finds that one.
  if (done == LIBUSB_SUCCESS || done == LIBUSB_ERROR_NOT_FOUND) return {UsbResetOutcome::Result::done, ""};
  return refused(
      fmt::format("the USB device cannot be reset: {}: unplug it and plug it in again", libusb_strerror(done)));
}

}  // namespace

UsbResetOutcome reset_usb_device(const UsbDeviceName& name) {
  if (name.vendor_id == 0 && name.serial.empty()) return refused("no USB device was named: give its vendor or serial");
  const std::vector<UsbAddress> addresses = addresses_of(name);
  if (addresses.empty()) return {};
  if (addresses.size() > 1) return refused("several USB devices have that name: give the serial number as well");
  libusb_context* context = nullptr;
  if (const int made = libusb_init(&context); made != LIBUSB_SUCCESS)
    return refused(fmt::format("libusb does not start: {}", libusb_strerror(made)));
  const std::unique_ptr<libusb_context, FreeWith<libusb_exit>> owned(context);
  libusb_device** list = nullptr;
  const ssize_t count = libusb_get_device_list(context, &list);
  UsbResetOutcome outcome;
  for (ssize_t i = 0; i < count; ++i)
    if (libusb_get_bus_number(list[i]) == addresses.front().bus &&
        libusb_get_device_address(list[i]) == addresses.front().device)
      outcome = reset(list[i]);
  if (count >= 0) libusb_free_device_list(list, 1);
  return outcome;
}

}  // namespace mf
