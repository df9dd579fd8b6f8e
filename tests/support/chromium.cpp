// SPDX-License-Identifier: Apache-2.0
#include "tests/support/chromium.h"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <stdexcept>
#include <thread>

#include "device/base64.h"
#include "tests/support/run_command.h"

namespace mf::test {

namespace {

using Json = nlohmann::json;

constexpr int longest_answer_ms = 60'000;  // a first start on a busy machine takes long

std::array<int, 2> make_pipe() {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw std::runtime_error("no pipe is left");
  return ends;
}

}  // namespace

bool Chromium::is_there() {
  return has_program("chromium");
}

Chromium::Chromium(const Screen& screen) {
  const std::array<int, 2> commands = make_pipe(), answers = make_pipe();
  process_.emplace(
      std::vector<std::string>{"chromium", "--headless=new", "--no-sandbox", "--disable-gpu", "--no-first-run",
                               "--disable-dev-shm-usage", "--disable-background-networking", "--remote-debugging-pipe",
                               "--user-data-dir=" + profile_.path().string(), "about:blank"},
      std::vector<int>{commands[0], answers[1]});
  ::close(commands[0]);
  ::close(answers[1]);
  to_browser_ = commands[1];
  from_browser_ = answers[0];
  const std::string target = call("Target.createTarget", {{"url", "about:blank"}})["targetId"];
  session_ = call("Target.attachToTarget", {{"targetId", target}, {"flatten", true}})["sessionId"];
  for (const char* domain : {"Page", "Runtime", "Log", "Network"})
    call(std::string(domain) + ".enable", Json::object());
  call("Emulation.setDeviceMetricsOverride", {{"width", screen.width},
                                              {"height", screen.height},
                                              {"deviceScaleFactor", screen.pixels_per_css},
                                              {"mobile", true}});
  const Json scheme{{"name", "prefers-color-scheme"}, {"value", screen.dark ? "dark" : "light"}};
  call("Emulation.setEmulatedMedia", {{"features", Json::array({scheme})}});
}

Chromium::~Chromium() {
  process_.reset();
  ::close(to_browser_);
  ::close(from_browser_);
}

Json Chromium::receive() {
  std::size_t end = 0;
  while ((end = received_.find('\0')) == std::string::npos) {
    pollfd polled{from_browser_, POLLIN, 0};
    std::array<char, 65536> bytes{};
    const bool ready = ::poll(&polled, 1, longest_answer_ms) > 0;
    const ssize_t got = ready ? ::read(from_browser_, bytes.data(), bytes.size()) : 0;
    if (got <= 0) throw std::runtime_error("chromium does not answer");
    received_.append(bytes.data(), static_cast<std::size_t>(got));
  }
  Json message = Json::parse(received_.substr(0, end));
  received_.erase(0, end + 1);
  return message;
}

void Chromium::take_event(const Json& message) {
  const std::string method = message.value("method", "");
  if (method == "Runtime.exceptionThrown") faults_.push_back(message["params"]["exceptionDetails"].dump());
  if (method == "Runtime.consoleAPICalled" && message["params"]["type"] == "error")
    faults_.push_back(message["params"]["args"].dump());
  if (method == "Log.entryAdded" && message["params"]["entry"]["level"] == "error")
    faults_.push_back(message["params"]["entry"].dump());
}

Json Chromium::call(const std::string& method, const Json& parameters) {
  Json command{{"id", next_id_}, {"method", method}, {"params", parameters}};
  if (!session_.empty()) command["sessionId"] = session_;
  const std::string text = command.dump() + '\0';
  if (::write(to_browser_, text.data(), text.size()) != static_cast<ssize_t>(text.size()))
    throw std::runtime_error("chromium takes no command");
  while (true) {
    const Json message = receive();
    if (!message.contains("id")) take_event(message);
    if (message.value("id", 0) != next_id_) continue;
    ++next_id_;
    if (message.contains("error")) throw std::runtime_error(method + ": " + message["error"].dump());
    return message["result"];
  }
}

void Chromium::open(const std::string& url) {
  call("Page.navigate", {{"url", "about:blank"}});  // else only another #fragment would not load the page again
  call("Page.navigate", {{"url", url}});
  if (!becomes("location.href !== 'about:blank' && document.readyState !== 'loading'"))
    throw std::runtime_error(url + " does not load");
}

Json Chromium::value(const std::string& expression) {
  const Json result =
      call("Runtime.evaluate", {{"expression", expression}, {"returnByValue", true}, {"awaitPromise", true}});
  if (result.contains("exceptionDetails"))
    throw std::runtime_error(expression + ": " + result["exceptionDetails"].dump());
  return result["result"].value("value", Json());
}

bool Chromium::becomes(const std::string& expression) {
  for (int i = 0; i < 200; ++i) {
    if (value("Boolean(" + expression + ")") == true) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  return false;
}

void Chromium::screenshot(const std::filesystem::path& file) {
  const Json size = call("Page.getLayoutMetrics", Json::object())["cssContentSize"];
  const Json clip{{"x", 0}, {"y", 0}, {"width", size["width"]}, {"height", size["height"]}, {"scale", 1}};
  const Json shot =
      call("Page.captureScreenshot", {{"format", "png"}, {"captureBeyondViewport", true}, {"clip", clip}});
  const auto bytes = from_base64(shot["data"].get<std::string>());
  if (!bytes) throw std::runtime_error("chromium's picture is no base64");
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes->data()), static_cast<std::streamsize>(bytes->size()));
}

}  // namespace mf::test
