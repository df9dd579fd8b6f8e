// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <csignal>
#include <cstdio>

#include "common/command_line/command_line.h"
#include "common/error.h"
#include "device/status/status_service.h"

namespace {

struct Arguments {
  std::filesystem::path config;
  // What is given here goes before the config.
  std::string address;
  int port = -1;
  std::filesystem::path socket;
  std::filesystem::path token_file;
};

mf::StatusConfig config_of(const Arguments& a) {
  mf::StatusConfig config = a.config.empty() ? mf::StatusConfig{} : mf::read_status_config(a.config);
  if (!a.address.empty()) config.address = a.address;
  if (a.port != -1) config.port = a.port;
  if (config.port < 0 || config.port > 65535) throw mf::InputError("--port", "", "must lie from 0 to 65535");
  if (!a.socket.empty()) config.socket = a.socket;
  if (!a.token_file.empty()) {
    config.token_file = a.token_file;
    config.remote_start = true;
  }
  return config;
}

void serve(const Arguments& arguments) {
  const mf::StatusConfig config = config_of(arguments);
  sigset_t ends;
  sigemptyset(&ends);
  sigaddset(&ends, SIGINT);
  sigaddset(&ends, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &ends, nullptr);  // before any thread is made: all of them leave these to sigwait()
  const mf::StatusService service(config);
  const bool v6 = config.address.find(':') != std::string::npos;
  fmt::print("http://{}{}{}:{}/\n", v6 ? "[" : "", config.address, v6 ? "]" : "", service.port());
  std::fflush(stdout);
  int signal = 0;
  sigwait(&ends, &signal);
}

}  // namespace

int main(int argc, char** argv) {
  mf::CommandLine program("mirrorfield-status",
                          "Serves a page with what the rig does, for a phone, until it is told to stop (SIGINT, "
                          "SIGTERM). It reads mirrorfieldd's status socket (docs/status.md).",
                          MIRRORFIELD_VERSION);
  Arguments arguments;
  program.option("--config", arguments.config, "mirrorfieldd.toml, of which it reads [status]; left out: the defaults");
  program.option("--address", arguments.address, "of the page: of one network of this machine, or 0.0.0.0 or ::");
  program.option("--port", arguments.port, "of the page; 0: any that is free; -1: the config's, or 8080");
  program.option("--socket", arguments.socket,
                 "mirrorfieldd's (default: the config's, or /run/mirrorfield/status.sock)");
  program.option("--token-file", arguments.token_file, "allows remote start with the word in this file");
  program.on_run([&] { serve(arguments); });
  return program.run(argc, argv);
}
