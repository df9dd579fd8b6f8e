// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "common/image.h"

namespace mf {

// Text that is safe between tags and inside quoted attributes.
[[nodiscard]] std::string html_escaped(std::string_view text);

// A picture as a data URI (PNG). One or three channels.
[[nodiscard]] std::string png_data_uri(const ImageU8&);

}  // namespace mf
