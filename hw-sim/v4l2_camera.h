// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

struct _UMockdevTestbed;  // NOLINT(bugprone-reserved-identifier): umockdev's own name of UMockdevTestbed

namespace mf::sim {

struct V4l2CameraOptions {
  int number = 60;  // /dev/videoN; one that this machine has not: when unplugged, its own would be seen
  std::string card = "Mirrorfield camera";
  std::string serial = "MF0001";
  std::vector<std::uint32_t> fourccs;      // that it offers (V4L2_PIX_FMT_...), ≥ 1; set to the first
  int width = 0, height = 0;               // of the sensor, pixels
  double frame_rate_hz = 37;               // until a client sets another
  double highest_frame_rate_hz = 120;      // higher ones become this
  double exposure_s = 0.01;                // likewise; the control has steps of 100 µs
  std::uint32_t line_alignment_bytes = 1;  // what rows are padded to
  bool crops = true;                       // else it has one picture size
  bool monotonic_stamps = true;            // else frames have the time of a clock that nobody names
};

// How a client has set it.
struct V4l2Mode {
  std::uint32_t fourcc = 0;
  int x = 0, y = 0, width = 0, height = 0;  // the region of the sensor, pixels
  std::uint32_t bytes_per_line = 0;
  double exposure_s = 0;
  int gain = 0;
  bool wide_dynamic_range = false;
};

// Of the next frames: each is counted down as it happens.
struct V4l2Faults {
  int skipped = 0;  // taken, but never delivered: the sequence numbers go on
  int damaged = 0;  // delivered with the error flag
  int cut = 0;      // delivered half
};

struct V4l2CameraCounts {
  std::int64_t frames = 0;     // filled
  std::int64_t without = 0;    // frames that no buffer was there for
  std::int64_t streamers = 0;  // how often a client has started it
  bool streaming = false;
};

// A V4L2 capture device in software, below umockdev: /dev/videoN, sysfs and udev are there for this process and its
// children when they run with umockdev's preload library (umockdev-wrapper) and with this process's UMOCKDEV_DIR, which
// the testbed sets. The node is a plain file that holds the frames, so clients can map it; poll() on a plain file is
// always ready, so a DQBUF waits up to 20 ms for a frame before it says EAGAIN.
//
// umockdev 0.17 counts an open() that fails as an open file for ever, and ends the process at the fiftieth: look for a
// node before opening it.
//
// umockdev does not tell when a client dies within an ioctl. A client that has not asked anything for a second loses
// the camera to the next that wants it.
class V4l2Camera {
 public:
  // Fills frame `number` (from 1 at each start of streaming) with bytes_per_line × height bytes; runs in the camera's
  // thread. It must not call the camera.
  using Fill = std::function<void(std::uint64_t number, const V4l2Mode&, std::span<std::uint8_t> payload)>;

  // There from now on. Throws InputError when the preload library is not active or the options make no camera.
  V4l2Camera(_UMockdevTestbed*, const V4l2CameraOptions&, Fill);
  V4l2Camera(const V4l2Camera&) = delete;
  V4l2Camera& operator=(const V4l2Camera&) = delete;
  ~V4l2Camera();

  // The node goes, with its uevent, and who had it open gets ENODEV. Plugged in again, it is as at first.
  void unplug();
  void replug();

  void add_faults(const V4l2Faults&);
  void hang(bool hung);    // frames stop; everything else answers
  void occupy(bool busy);  // as if another program streamed: EBUSY

  [[nodiscard]] V4l2CameraCounts counts() const;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;  // umockdev's callbacks hold it, too: they end with the last client
};

// Whether this process runs with umockdev's preload library.
[[nodiscard]] bool has_umockdev();

}  // namespace mf::sim
