// SPDX-License-Identifier: Apache-2.0
#include "device/v4l2_device.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "common/error.h"

namespace mf {

namespace {

std::string busy_remedy(const std::string& node) {
  return fmt::format("another program has the camera: `fuser -v {}` names it, end it", node);
}

[[noreturn]] void cannot_open(const std::string& node, int error) {
  std::string remedy = "see `mirrorfieldd --list`";
  if (error == ENOENT || error == ENODEV || error == ENXIO)
    remedy = "plug the camera in, or choose one from `mirrorfieldd --list`";
  if (error == EACCES || error == EPERM)
    remedy = "add this user to the group video (`sudo usermod -aG video USER`) and log in again";
  if (error == EBUSY) remedy = busy_remedy(node);
  throw InputError(node, "address", fmt::format("cannot be opened ({}): {}", std::strerror(error), remedy));
}

// A node that is not there is never opened: a lost camera is looked for several times a second.
std::string followed(const std::string& node) {
  std::error_code error;
  const std::filesystem::path target = std::filesystem::canonical(node, error);
  if (error) cannot_open(node, error.value());
  return target.string();
}

}  // namespace

V4l2Device::V4l2Device(const std::string& node)
    : node_(node), target_(followed(node)), descriptor_(::open(target_.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC)) {
  if (descriptor_ < 0) cannot_open(node, errno);
}

V4l2Device::~V4l2Device() {
  ::close(descriptor_);
}

int V4l2Device::control(unsigned long request, void* argument) const {
  while (true) {
    if (::ioctl(descriptor_, request, argument) >= 0) return 0;
    if (errno != EINTR) return errno;
  }
}

void V4l2Device::demand(unsigned long request, void* argument, const std::string& field,
                        const std::string& remedy) const {
  const int error = control(request, argument);
  if (error == 0) return;
  throw InputError(node_, field,
                   fmt::format("{}: {}", std::strerror(error), error == EBUSY ? busy_remedy(node_) : remedy));
}

}  // namespace mf
