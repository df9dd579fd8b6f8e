// SPDX-License-Identifier: Apache-2.0
#include "host/cli/session_files.h"

#include <fmt/format.h>

#include <filesystem>

#include "common/error.h"

namespace mf {

namespace {

[[noreturn]] void refuse(const SessionReader& session, const std::filesystem::path& file, const char* command) {
  throw InputError(file.string(), "",
                   fmt::format("is missing: run `mirrorfield {} {}` first", command, session.folder().string()));
}

}  // namespace

SessionReader open_session(const std::filesystem::path& folder) {
  SessionReader session(folder);
  for (const std::string& line : session.damage()) fmt::print(stderr, "warning: {}\n", line);
  return session;
}

ResponseCurve response_of(const SessionReader& session) {
  const std::filesystem::path file = session.folder() / "response.json";
  if (std::filesystem::exists(file)) return read_response_curve(file);
  const PixelFormat& format = session.header().format;
  if (!format.linear_float) refuse(session, file, "photometry");
  ResponseCurve proportional;
  proportional.radiance_scale.assign(static_cast<std::size_t>(format.colour_channels()), 1);
  return proportional;
}

Calibration calibration_of(const SessionReader& session) {
  const std::filesystem::path file = session.folder() / "calibration.json";
  if (!std::filesystem::exists(file)) refuse(session, file, "calibrate");
  return read_calibration(file);
}

}  // namespace mf
