// SPDX-License-Identifier: Apache-2.0
// The lines on the status socket. The first byte of an input says which: from the daemon ('s'), to it ('c').
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "common/error.h"
#include "device/base64.h"
#include "device/rig_status_json.h"
#include "device/status_command.h"
#include "tests/device/status_examples.h"
#include "tests/fuzz/fuzz_target.h"

namespace mf::fuzz {
namespace {

using Json = nlohmann::json;

std::string line_of(const RigStatus& status) {
  return rig_status_to_json(status).dump(-1, ' ', false, Json::error_handler_t::replace);
}

void run_status(std::string_view line) {
  const Json said = Json::parse(line, nullptr, false);
  if (said.is_discarded()) return;
  RigStatus status;
  try {
    status = rig_status_from_json(said, "fuzz");
  } catch (const InputError&) {
    return;
  }
  const std::string again = line_of(status);
  if (line_of(rig_status_from_json(Json::parse(again), "fuzz")) != again) throw std::logic_error("a status changed");
}

void run_line(std::span<const std::uint8_t> bytes) {
  if (bytes.empty()) return;
  const std::string_view line(reinterpret_cast<const char*>(bytes.data()) + 1, bytes.size() - 1);
  if (bytes[0] == 's') return run_status(line);
  const StatusCommand command = read_status_command(line);
  if (command.start_token.has_value() == !command.fault.empty()) throw std::logic_error("a command and a fault");
  if (const auto decoded = from_base64(line); decoded && to_base64(*decoded) != line)
    throw std::logic_error("base64 that is not what it decodes to");
}

std::vector<std::string> line_seeds() {
  RigStatus whole = test::recording_status();
  whole.preview = shrunk_preview(*whole.preview, 8);
  whole.preview->tags.resize(2);
  whole.coverage->patches.resize(3);
  RigStatus little;
  little.problem = "the disk is \"full\"";
  return {"s" + line_of(whole), "s" + line_of(little), R"(c{"command": "start", "token": "open sesame"})", "cZm9vYg=="};
}

}  // namespace

FuzzTarget fuzz_target() {
  return {run_line, line_seeds};
}

}  // namespace mf::fuzz
