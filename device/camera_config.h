// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "device/camera_source.h"
#include "device/config_table.h"

namespace mf {

// Tables [camera] and [response] of mirrorfieldd.toml. Throw InputError naming the key.
[[nodiscard]] CameraSettings read_camera_config(ConfigTable);
[[nodiscard]] std::optional<ResponseRequest> read_response_config(ConfigTable);

}  // namespace mf
