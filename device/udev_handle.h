// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <libudev.h>

#include "device/c_handle.h"

namespace mf {

using Udev = std::unique_ptr<udev, FreeWith<udev_unref>>;
using UdevMonitor = std::unique_ptr<udev_monitor, FreeWith<udev_monitor_unref>>;
using UdevEnumerate = std::unique_ptr<udev_enumerate, FreeWith<udev_enumerate_unref>>;
using UdevDevice = std::unique_ptr<udev_device, FreeWith<udev_device_unref>>;

}  // namespace mf
