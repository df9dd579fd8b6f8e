// SPDX-License-Identifier: Apache-2.0
#include "common/command_line/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <optional>

namespace mf {

namespace {

constexpr int exit_bad_input = 1;
constexpr int exit_usage = 2;

template <typename T>
bool has_default(const T& value) {
  if constexpr (requires { value.empty(); })
    return !value.empty();
  else if constexpr (requires { value.has_value(); })
    return value.has_value();
  else
    return true;
}

}  // namespace

// The program owns its CLI::App; a command's belongs to the program's.
struct CommandLine::Parser {
  std::unique_ptr<CLI::App> owned;
  CLI::App* app = nullptr;
};

CommandLine::CommandLine(const std::string& program, const std::string& description, const std::string& version)
    : parser_(std::make_unique<Parser>()) {
  parser_->owned = std::make_unique<CLI::App>(description);
  parser_->app = parser_->owned.get();
  parser_->app->name(program);
  if (!version.empty()) parser_->app->set_version_flag("--version", version);
}

CommandLine::CommandLine(std::unique_ptr<Parser> parser) : parser_(std::move(parser)) {}
CommandLine::CommandLine(CommandLine&&) noexcept = default;
CommandLine::~CommandLine() = default;

CommandLine CommandLine::command(const std::string& name, const std::string& description) {
  parser_->app->require_subcommand(1);
  auto parser = std::make_unique<Parser>();
  parser->app = parser_->app->add_subcommand(name, description);
  return CommandLine(std::move(parser));
}

void CommandLine::flag(const std::string& names, bool& value, const std::string& help) {
  parser_->app->add_flag(names, value, help);
}

template <typename T>
void CommandLine::option(const std::string& names, T& value, const std::string& help, Presence presence) {
  CLI::Option* option = parser_->app->add_option(names, value, help);
  if (presence == Presence::required)
    option->required();
  else if (has_default(value))
    option->capture_default_str();
}

template <typename T>
void CommandLine::values(const std::string& names, int count, std::vector<T>& into, const std::string& help,
                         Presence presence) {
  CLI::Option* option = parser_->app->add_option(names, into, help)->expected(count);
  if (presence == Presence::required) option->required();
}

template void CommandLine::option(const std::string&, int&, const std::string&, Presence);
template void CommandLine::option(const std::string&, std::uint64_t&, const std::string&, Presence);
template void CommandLine::option(const std::string&, double&, const std::string&, Presence);
template void CommandLine::option(const std::string&, std::string&, const std::string&, Presence);
template void CommandLine::option(const std::string&, std::filesystem::path&, const std::string&, Presence);
template void CommandLine::option(const std::string&, std::optional<int>&, const std::string&, Presence);
template void CommandLine::option(const std::string&, std::optional<double>&, const std::string&, Presence);
template void CommandLine::values(const std::string&, int, std::vector<int>&, const std::string&, Presence);
template void CommandLine::values(const std::string&, int, std::vector<double>&, const std::string&, Presence);

void CommandLine::repeatable(const std::string& names, std::vector<std::filesystem::path>& values,
                             const std::string& help, Presence presence) {
  CLI::Option* option = parser_->app->add_option(names, values, help)->allow_extra_args(false);
  if (presence == Presence::required) option->required();
}

void CommandLine::on_run(std::function<void()> run) {
  parser_->app->callback(std::move(run));
}

int CommandLine::run(int argc, char** argv) {
  try {
    parser_->app->parse(argc, argv);
    return 0;
  } catch (const CLI::ParseError& e) {
    return parser_->app->exit(e) == 0 ? 0 : exit_usage;
  } catch (const std::exception& e) {
    fmt::print(stderr, "{}: {}\n", parser_->app->get_name(), e.what());
  }
  return exit_bad_input;
}

}  // namespace mf
