// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace mf {

// The page, whole: its style and its script are in it. Generated at build time from page/.
[[nodiscard]] std::string_view status_page();
// What its Content-Security-Policy allows: "sha256-…" of the style and of the script.
[[nodiscard]] std::string_view status_page_style_source();
[[nodiscard]] std::string_view status_page_script_source();

}  // namespace mf
