// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/sensor_response.h"
#include "device/pixel_packing.h"

namespace mf::sim {

struct GigeCameraOptions {
  std::string address = "127.0.0.1";  // IPv4 of an interface of this machine
  std::string serial = "MF0001";
  WireFormat format;
  std::vector<WireFormat> more_formats;  // that a client may choose instead
  int width = 0, height = 0;             // pixels; fixed
  double frame_rate_hz = 37;             // until a client sets another
  double exposure_s = 0.01;              // likewise
  double packet_loss = 0;                // of the frames' packets at their first sending, 0 to below 1
  double clock_ppm = 0;               // how much faster than the host's the camera's clock runs, as long as PTP is off
  std::int64_t ptp_offset_ns = 0;     // what PTP leaves between CLOCK_REALTIME and the camera's clock
  bool programmable_response = true;  // has LinLog_* and MultiSlope*
  std::uint64_t seed = 1;             // of the losses
  int most_frames = 0;                // then it falls silent; 0: never
};

struct GigeCameraCounts {
  std::int64_t frames = 0;   // sent
  std::int64_t packets = 0;  // of them, resent ones not counted
  std::int64_t dropped = 0;  // packets that were not sent at first
  std::int64_t resent = 0;   // packets that a client asked for again
};

// A frame to be taken, with the settings at its time.
struct GigeShot {
  std::uint64_t number = 0;  // from 1
  double exposure_s = 0;
  double gain_db = 0;
  SensorResponse response;
  WireFormat format;
};

// A GigE Vision camera in software: GVCP (discovery, registers, memory, heartbeat, packet resend) and GVSP (image
// payload, 16-bit block numbers) after the GigE Vision 1.2 specification, with a GenICam description of its own. It
// keeps what a client sets in readable registers. One client has control at a time; when its heartbeat stops, control
// ends and so does the stream.
//
// It has the features of a programmable response (LinLog_*, MultiSlope*), of PTP, and chunk data (ChunkModeActive:
// every frame then ends with its own timestamp and exposure time).
//
// Packets leave at gigabit speed. Left out: extended block numbers, message channels, multicast, action commands.
class GigeCamera {
 public:
  // Fills frame `number` (from 1) as format.bytes_for(width · height) bytes; runs in the streaming thread.
  using Fill = std::function<void(std::uint64_t number, std::span<std::uint8_t> payload)>;
  // The same for pictures that depend on what the client has set.
  using Expose = std::function<void(const GigeShot&, std::span<std::uint8_t> payload)>;

  // Answers from now on. Throws InputError when the address is not this machine's or its GVCP port (3956) is taken.
  GigeCamera(const GigeCameraOptions&, Expose);
  GigeCamera(const GigeCameraOptions&, Fill);
  ~GigeCamera();

  // A dead camera neither answers nor sends; revived, it has booted anew: settings, block numbers and clock start over.
  void die();
  void revive();

  // From the next frame on, until another is set.
  void set_packet_loss(double share);
  void set_jitter(double most_s);  // each frame leaves late by up to this
  // So many frames are taken and numbered, but never sent.
  void skip_frames(int count);

  [[nodiscard]] GigeCameraCounts counts() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mf::sim
