// SPDX-License-Identifier: Apache-2.0
#include "common/session_checks.h"

#include <fmt/format.h>

#include <bit>

#include "common/file_bytes.h"

namespace mf {

std::uint32_t row_check(const SessionFrame& f) {
  const auto bits = [](double value) { return std::bit_cast<std::uint64_t>(value); };
  std::string text =
      fmt::format("{}|{}|{}|{:016x}|{:016x}|{:016x}|{}|{}|{}", f.id, frame_role_name(f.info.role), f.info.name,
                  bits(f.info.exposure_s), bits(f.info.nd_density), bits(f.info.time_s), f.file, f.bytes, f.crc32);
  if (f.arrival)
    text += fmt::format("|{}|{}|{}|{}", f.arrival->device_frame, f.arrival->device_ns, f.arrival->monotonic_ns,
                        f.arrival->realtime_ns);
  return crc32(text);
}

std::int64_t count_frame_files(const std::filesystem::path& session_folder) {
  std::int64_t count = 0;
  std::error_code error;
  for (std::filesystem::directory_iterator i(session_folder / "frames", error), end; !error && i != end;
       i.increment(error))
    count += i->path().extension() == ".tif" ? 1 : 0;
  return count;
}

}  // namespace mf
