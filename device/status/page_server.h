// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "device/status/page_texts.h"
#include "device/status/request_rules.h"

namespace mf {

struct PageServerOptions {
  std::string address = "0.0.0.0";  // IPv4 or IPv6; "::" is both
  int port = 8080;                  // 0: any that is free
  PageRules rules;
  unsigned most_connections = 128;               // in all
  unsigned most_connections_of_an_address = 80;  // so that one machine cannot shut out the others
  std::size_t most_event_clients = 64;           // of the connections, those that listen to /events
  std::chrono::seconds idle{15};                 // a connection that neither sends nor takes anything is closed; ≥ 1
};

// The page's web server: one thread (epoll), whatever the number of browsers. A browser that reads slowly misses some
// events and holds up nobody.
class PageServer {
 public:
  // `start` asks the rig for a recording; false: the rig is not there. It runs in the server's thread and must not
  // wait. Throws InputError: no such address, a port in use.
  PageServer(PageServerOptions, std::function<bool(const std::string& token)> start);
  PageServer(const PageServer&) = delete;
  PageServer& operator=(const PageServer&) = delete;
  ~PageServer();

  [[nodiscard]] int port() const;
  void publish(std::shared_ptr<const PageTexts>);

 private:
  struct Server;
  std::unique_ptr<Server> server_;
};

}  // namespace mf
