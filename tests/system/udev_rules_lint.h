// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace mf::test {

// What is wrong with a file of udev rules that udev itself passes over: an assignment where a comparison was meant,
// modes that let everybody in, a GOTO without its label, access given too late for 70-uaccess.rules. Examples in
// comments ("#SUBSYSTEM...") are judged as well. Each is "NAME:LINE: what".
[[nodiscard]] std::vector<std::string> lint_udev_rules(const std::string& file_name, const std::string& text);

}  // namespace mf::test
