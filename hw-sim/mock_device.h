// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <umockdev.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "device/c_handle.h"

namespace mf::sim {

// Clients that still hold a removed device open get answers until this is gone, and then none of ours.
struct EndAnswers {
  gpointer self = nullptr;
  void operator()(UMockdevIoctlBase* handler) const;
};
using MockHandler = std::unique_ptr<UMockdevIoctlBase, EndAnswers>;
using MockData = std::unique_ptr<UMockdevIoctlData, FreeWith<g_object_unref>>;

// What a device answers to a client's ioctl, in umockdev's own thread. False: it knows no such request.
using MockAnswer = gboolean (*)(UMockdevIoctlBase*, UMockdevIoctlClient*, gpointer self);

struct MockDevice {
  std::string path;         // /sys/devices/...
  std::string node;         // /dev/...
  std::string description;  // for umockdev_testbed_add_from_string
};

// Adds the device and lets `answer` speak for it; it is not announced yet. Throws InputError naming the node.
[[nodiscard]] MockHandler add_mock_device(UMockdevTestbed*, const MockDevice&, MockAnswer, gpointer self);
// Announces that it is gone, and removes it and its node.
void remove_mock_device(UMockdevTestbed*, const MockDevice&);
// The file that clients find at the node.
[[nodiscard]] std::filesystem::path real_node(UMockdevTestbed*, const MockDevice&);

// The client's bytes at the request's argument; nothing when it has none there.
[[nodiscard]] MockData argument_bytes(UMockdevIoctlClient*, std::size_t count);
void put(UMockdevIoctlData&, std::span<const std::uint8_t>);
void finish(UMockdevIoctlClient*, long result = 0);
void fail(UMockdevIoctlClient*, int error);  // with that errno

}  // namespace mf::sim
