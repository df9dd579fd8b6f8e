// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tests/support/child_process.h"

namespace mf::test {

// mirrorfield-status itself, on a free port of loopback.
class StatusProgram {
 public:
  explicit StatusProgram(const std::string& socket, const std::vector<std::string>& more = {})
      : process_(arguments(socket, more)), url_(process_.first_line()) {}

  [[nodiscard]] const std::string& url() const { return url_; }  // "http://127.0.0.1:PORT/"; empty: it did not start
  [[nodiscard]] std::string host() const { return url_.size() < 9 ? "" : url_.substr(7, url_.size() - 8); }
  [[nodiscard]] int port() const { return std::stoi(url_.substr(url_.rfind(':') + 1)); }
  [[nodiscard]] ChildProcess& process() { return process_; }

 private:
  static std::vector<std::string> arguments(const std::string& socket, const std::vector<std::string>& more) {
    std::vector<std::string> all{std::string(MF_BINARY_DIR) + "/mirrorfield-status",
                                 "--address",
                                 "127.0.0.1",
                                 "--port",
                                 "0",
                                 "--socket",
                                 socket};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  ChildProcess process_;
  std::string url_;
};

}  // namespace mf::test
