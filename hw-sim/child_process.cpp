// SPDX-License-Identifier: Apache-2.0
#include "hw-sim/child_process.h"

#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <thread>

#include "common/error.h"

namespace mf::sim {

namespace {

std::vector<std::string> joined_environment(const std::map<std::string, std::string>& added) {
  std::vector<std::string> all;
  for (char** variable = environ; *variable != nullptr; ++variable) {
    const std::string text(*variable);
    if (!added.contains(text.substr(0, text.find('=')))) all.push_back(text);
  }
  for (const auto& [name, value] : added) all.push_back(name + "=" + value);
  return all;
}

std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> list;
  for (std::string& text : texts) list.push_back(text.data());
  list.push_back(nullptr);
  return list;
}

}  // namespace

ChildProcess::ChildProcess(const std::vector<std::string>& command,
                           const std::map<std::string, std::string>& environment) {
  std::vector<std::string> words = command, variables = joined_environment(environment);
  const std::vector<char*> arguments = pointers(words), settings = pointers(variables);
  if (::access(words[0].c_str(), X_OK) != 0)
    throw InputError(command[0], "", std::string("cannot be started (") + std::strerror(errno) + "): build it first");
  process_ = ::fork();
  if (process_ < 0) throw InputError(command[0], "", std::string("cannot be started (") + std::strerror(errno) + ")");
  if (process_ > 0) return;
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // whatever becomes of us, it does not outlive us
  ::execve(words[0].c_str(), arguments.data(), settings.data());
  ::_exit(127);
}

ChildProcess::~ChildProcess() {
  if (exit_code_) return;
  signal(SIGKILL);
  (void)wait(std::chrono::seconds(10));
}

void ChildProcess::signal(int number) const {
  if (!exit_code_) ::kill(process_, number);
}

std::optional<int> ChildProcess::wait(std::chrono::milliseconds at_most) {
  const auto until = std::chrono::steady_clock::now() + at_most;
  while (!exit_code_) {
    int status = 0;
    if (::waitpid(process_, &status, WNOHANG) == process_)
      exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    else if (std::chrono::steady_clock::now() >= until)
      break;
    else
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return exit_code_;
}

}  // namespace mf::sim
