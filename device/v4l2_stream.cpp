// SPDX-License-Identifier: Apache-2.0
#include "device/v4l2_stream.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <thread>

#include "common/check.h"
#include "common/error.h"

namespace mf {

namespace {

using Clock = std::chrono::steady_clock;

v4l2_buffer mapped_buffer(std::uint32_t index = 0) {
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  return buffer;
}

}  // namespace

V4l2Stream::V4l2Stream(const V4l2Device& device) : device_(&device) {
  v4l2_requestbuffers request{};
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  request.count = 16;  // 0.4 s at 37 frames a second; a driver that has less memory grants fewer
  device.demand(VIDIOC_REQBUFS, &request, "",
                "the camera gives no buffers to map: choose another, or a smaller region");
  // One that is being filled, one that waits, one that is being read.
  constexpr std::uint32_t least = 3;
  if (request.count < least)
    throw InputError(device.node(), "",
                     fmt::format("the driver has memory for {} frames, {} are needed: choose a "
                                 "smaller region, or raise the kernel's cma=",
                                 request.count, least));
  mappings_.resize(request.count);
}

V4l2Stream::~V4l2Stream() {
  if (started_ && !lost_) {
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    (void)device_->control(VIDIOC_STREAMOFF, &type);
  }
  for (const Mapping& mapping : mappings_)
    if (mapping.address != nullptr) ::munmap(mapping.address, mapping.length);
  if (lost_) return;
  v4l2_requestbuffers none{};
  none.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  none.memory = V4L2_MEMORY_MMAP;
  (void)device_->control(VIDIOC_REQBUFS, &none);
}

void V4l2Stream::map(std::uint32_t index) {
  v4l2_buffer buffer = mapped_buffer(index);
  device_->demand(VIDIOC_QUERYBUF, &buffer, "", "the driver does not tell its buffers");
  void* address =
      ::mmap(nullptr, buffer.length, PROT_READ, MAP_SHARED, device_->descriptor(), static_cast<off_t>(buffer.m.offset));
  if (address == MAP_FAILED)
    throw InputError(device_->node(), "",
                     fmt::format("its buffers cannot be mapped ({}): free some memory", std::strerror(errno)));
  mappings_[index] = {address, buffer.length};
}

int V4l2Stream::queue(std::uint32_t index) const {
  v4l2_buffer buffer = mapped_buffer(index);
  return device_->control(VIDIOC_QBUF, &buffer);
}

void V4l2Stream::start() {
  for (std::uint32_t index = 0; index < mappings_.size(); ++index) {
    map(index);
    v4l2_buffer buffer = mapped_buffer(index);
    device_->demand(VIDIOC_QBUF, &buffer, "", "the camera does not start");
  }
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  device_->demand(VIDIOC_STREAMON, &type, "",
                  "the camera does not start: the USB bus may be full, choose a lower frame rate or a smaller region");
  started_ = true;
}

void V4l2Stream::release() {
  if (!filled_ || lost_) return;
  lost_ = queue(filled_->index) != 0;
  filled_.reset();
}

int V4l2Stream::take() {
  v4l2_buffer buffer = mapped_buffer();
  if (const int error = device_->control(VIDIOC_DQBUF, &buffer); error != 0) return error;
  if (buffer.index >= mappings_.size()) return EIO;
  filled_ = buffer;
  return 0;
}

V4l2Stream::Wait V4l2Stream::wait(std::chrono::milliseconds at_most) {
  check(started_, "a stream is started before it is waited for");
  release();
  const auto until = Clock::now() + at_most;
  while (!lost_) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - Clock::now());
    pollfd waiting{device_->descriptor(), POLLIN, 0};
    const int ready = ::poll(&waiting, 1, static_cast<int>(std::max<std::int64_t>(left.count(), 0)));
    if (ready == 0) return Wait::nothing;
    if (ready < 0 && errno != EINTR) break;
    if (ready < 0) continue;
    // POLLERR and POLLHUP, too: what has happened, DQBUF tells.
    const int error = take();
    if (error == 0) return Wait::filled;
    if (error != EAGAIN) break;  // ENODEV: unplugged; EIO, EINVAL: the driver's queue is dead
    if (Clock::now() >= until) return Wait::nothing;
    if ((waiting.revents & POLLIN) == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));  // would spin
  }
  lost_ = true;
  return Wait::lost;
}

std::span<const std::uint8_t> V4l2Stream::bytes() const {
  const Mapping& mapping = mappings_[filled_->index];
  return {static_cast<const std::uint8_t*>(mapping.address), std::min<std::size_t>(filled_->bytesused, mapping.length)};
}

}  // namespace mf
