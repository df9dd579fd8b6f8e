// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "common/session.h"

namespace mf {

// The header as the documents that `session.db` keeps in its table `meta`, by key: camera, target, and when there are
// any, world and reference. They are spelled as in the import format.
[[nodiscard]] std::map<std::string, nlohmann::json> session_header_to_json(const SessionHeader&);

// Throws InputError naming `file` and the field.
[[nodiscard]] SessionHeader session_header_from_json(const std::map<std::string, nlohmann::json>&,
                                                     const std::string& file);

}  // namespace mf
