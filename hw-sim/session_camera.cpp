// SPDX-License-Identifier: Apache-2.0
#include "hw-sim/session_camera.h"

#include <algorithm>

#include "common/error.h"
#include "common/session.h"

namespace mf::sim {

namespace {

std::vector<std::uint8_t> packed(const ImageU16& codes, const WireFormat& format) {
  std::vector<std::uint8_t> bytes(format.bytes_for(codes.data.size()));
  for (std::size_t i = 0; i < codes.data.size(); ++i) {
    if (format.packing == Packing::bytes) {
      bytes[i] = static_cast<std::uint8_t>(codes.data[i]);
    } else {
      bytes[2 * i] = static_cast<std::uint8_t>(codes.data[i]);
      bytes[2 * i + 1] = static_cast<std::uint8_t>(codes.data[i] >> 8);
    }
  }
  return bytes;
}

}  // namespace

SessionCamera::SessionCamera(const std::filesystem::path& session, const PlayOptions& play) : options_(play.camera) {
  const SessionReader reader(session);
  const SessionHeader& header = reader.header();
  const std::string name = pixel_format_name(header.format);
  const std::optional<WireFormat> format = wire_format(name);
  const std::vector<SessionFrame> frames = reader.frames(FrameRole::mirror);
  if (!format)
    throw InputError(session.string(), "camera", "no camera of ours sends " + name + ": use Mono or Bayer codes");
  if (frames.empty())
    throw InputError(session.string(), "frames", "none of them shows the mirror: give another session");
  options_.format = *format;
  options_.width = header.width;
  options_.height = header.height;
  options_.exposure_s = frames.front().info.exposure_s;
  options_.most_frames = play.times * static_cast<int>(frames.size());
  for (const SessionFrame& frame : frames)
    payloads_.push_back(packed(std::get<ImageU16>(reader.read_frame(frame).pixels), *format));
  camera_ = std::make_unique<GigeCamera>(options_, [this](std::uint64_t number, std::span<std::uint8_t> into) {
    const auto& payload = payloads_[(number - 1) % payloads_.size()];
    std::copy(payload.begin(), payload.end(), into.begin());
  });
}

bool SessionCamera::finished() const {
  return options_.most_frames > 0 && counts().frames >= options_.most_frames;
}

}  // namespace mf::sim
