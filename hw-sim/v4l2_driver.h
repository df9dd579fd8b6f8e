// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <linux/videodev2.h>

#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hw-sim/v4l2_camera.h"
#include "hw-sim/v4l2_sim_controls.h"

namespace mf::sim {

// Memory that the driver fills and clients map: a file, so that both can.
class SharedFrames {
 public:
  // Makes the file as large; throws InputError.
  SharedFrames(const std::string& file, std::size_t bytes);
  SharedFrames(const SharedFrames&) = delete;
  SharedFrames& operator=(const SharedFrames&) = delete;
  ~SharedFrames();
  [[nodiscard]] std::span<std::uint8_t> bytes() const { return {address_, size_}; }

 private:
  std::uint8_t* address_ = nullptr;
  std::size_t size_ = 0;
};

// What the kernel's side of a V4L2 capture device does, ioctl by ioctl, after the V4L2 specification: no transport.
// Safe to call from several threads.
class V4l2Driver {
 public:
  using Client = const void*;  // an open descriptor of whoever calls

  // `file` stands for the device's memory.
  V4l2Driver(const V4l2CameraOptions&, std::string file);

  // 0 or errno. `argument` is the request's own struct, with pointers in it resolved. DQBUF never waits: EAGAIN.
  [[nodiscard]] int handle(Client, std::uint32_t request, void* argument);
  void client_came(Client);
  void client_gone(Client);
  // All who have it open now get ENODEV from now on.
  void unplug();

  // The next frame's time: takes a queued buffer, if there is one, and has it filled. Nothing happens while no client
  // streams.
  void expose(const V4l2Camera::Fill&);
  [[nodiscard]] double period_s() const;

  void add_faults(const V4l2Faults&);
  void hold(bool hung) { set(hung_, hung); }
  void occupy(bool busy) { set(busy_, busy); }
  [[nodiscard]] V4l2CameraCounts counts() const;

 private:
  struct Buffer {
    bool queued = false;  // the driver has it, filled or not
    std::uint32_t bytes_used = 0, sequence = 0, flags = 0;
    timeval stamp{};
  };
  struct Shot {  // what a frame is made with
    std::uint32_t index = 0;
    std::uint64_t number = 0;
    V4l2Mode mode;
    std::shared_ptr<SharedFrames> memory;
    bool damaged = false, cut = false;
  };
  void set(bool& flag, bool value);
  [[nodiscard]] int query(std::uint32_t request, void* argument);
  [[nodiscard]] int stream(Client, std::uint32_t request, void* argument);
  [[nodiscard]] int capabilities(v4l2_capability&) const;
  [[nodiscard]] int enumerate_format(v4l2_fmtdesc&) const;
  [[nodiscard]] int enumerate_size(v4l2_frmsizeenum&) const;
  [[nodiscard]] int get_format(v4l2_format&) const;
  [[nodiscard]] int set_format(v4l2_format&, bool keep);
  [[nodiscard]] int parameters(v4l2_streamparm&, bool write);
  [[nodiscard]] int selection(v4l2_selection&, bool write);
  [[nodiscard]] int input(v4l2_input&) const;
  [[nodiscard]] int request_buffers(Client, v4l2_requestbuffers&);
  [[nodiscard]] int query_buffer(v4l2_buffer&) const;
  [[nodiscard]] int queue_buffer(v4l2_buffer&);
  [[nodiscard]] int dequeue_buffer(v4l2_buffer&);
  void tell(v4l2_buffer&) const;
  void release();
  [[nodiscard]] bool occupied_for(Client) const;
  [[nodiscard]] std::uint32_t image_bytes() const;
  [[nodiscard]] std::uint32_t buffer_bytes() const;
  [[nodiscard]] std::uint32_t line_bytes(std::uint32_t fourcc, std::uint32_t width) const;
  [[nodiscard]] V4l2Mode mode() const;
  [[nodiscard]] std::optional<Shot> begin_shot();
  void end_shot(const Shot&);

  V4l2CameraOptions options_;
  std::string file_;
  mutable std::mutex mutex_;
  V4l2SimControls controls_;
  std::uint32_t fourcc_;
  v4l2_rect crop_{};
  v4l2_fract interval_{};
  Client owner_ = nullptr;    // who has the buffers
  std::vector<Client> gone_;  // had it open when it was unplugged
  std::vector<Client> open_;
  std::vector<Buffer> buffers_;
  std::deque<std::uint32_t> waiting_, filled_;
  std::shared_ptr<SharedFrames> memory_;
  bool streaming_ = false, hung_ = false, busy_ = false;
  std::uint32_t sequence_ = 0;
  V4l2Faults faults_;
  V4l2CameraCounts counts_;
};

}  // namespace mf::sim
