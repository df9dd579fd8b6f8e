// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace mf {

enum class Presence { optional, required };

// A program's command line, or one command of it ("mirrorfield probe"). A thin front of CLI11, whose header alone
// takes a compiler longer than most of our files: only command_line.cpp reads it.
//
// `names` are as CLI11 takes them: "-o,--output", or "field" for a positional argument. What a value holds when it is
// added is its default, and --help shows it. Values must live until the program has run.
class CommandLine {
 public:
  CommandLine(const std::string& program, const std::string& description, const std::string& version = {});
  CommandLine(CommandLine&&) noexcept;
  CommandLine& operator=(CommandLine&&) = delete;
  ~CommandLine();

  // A command of this program; once there is one, the user must name one.
  [[nodiscard]] CommandLine command(const std::string& name, const std::string& description);

  void flag(const std::string& names, bool& value, const std::string& help);

  // T: int, std::uint64_t, double, std::string, std::filesystem::path, or std::optional of int or double.
  template <typename T>
  void option(const std::string& names, T& value, const std::string& help, Presence = Presence::optional);

  // Exactly `count` values, or none when optional. T: int or double.
  template <typename T>
  void values(const std::string& names, int count, std::vector<T>& into, const std::string& help,
              Presence = Presence::optional);

  // One value each time that it is given.
  void repeatable(const std::string& names, std::vector<std::filesystem::path>& values, const std::string& help,
                  Presence = Presence::optional);

  // What runs once the arguments are read.
  void on_run(std::function<void()>);

  // Reads the arguments, runs, and gives the exit code: 0; 2 with the usage on standard error for arguments that don't
  // fit; 1 with one line "PROGRAM: what" on standard error for any std::exception.
  [[nodiscard]] int run(int argc, char** argv);

 private:
  struct Parser;
  explicit CommandLine(std::unique_ptr<Parser>);
  std::unique_ptr<Parser> parser_;
};

}  // namespace mf
