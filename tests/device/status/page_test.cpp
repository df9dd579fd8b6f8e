// SPDX-License-Identifier: Apache-2.0
// The page in a browser, as wide as a small phone, fed by the daemon's own socket through the real program.
// MF_SCREENSHOTS=FOLDER keeps a picture of each state, to be looked at.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <thread>

#include "device/status_socket.h"
#include "tests/device/status/status_program.h"
#include "tests/device/status_examples.h"
#include "tests/support/chromium.h"
#include "tests/support/expect_input_error.h"

namespace mf {
namespace {

using test::contains;

RigStatus example() {
  static const RigStatus status =
      test::recording_status(test::grey_picture(std::string(MF_SHARED_DATA) + "/desk/frames/00010.png"));
  return status;
}

// Publishes a status again and again, as the daemon does.
class Publisher {
 public:
  Publisher(const std::string& path, RigStatus status, bool accept_start = false)
      : status_(std::move(status)), socket_(options(path, accept_start)), thread_([this] { run(); }) {}
  ~Publisher() {
    stop_ = true;
    thread_.join();
  }
  void set(RigStatus status) {
    const std::scoped_lock hold(mutex_);
    status_ = std::move(status);
  }
  [[nodiscard]] std::optional<StartRequest> take_start_request() { return socket_.take_start_request(); }

 private:
  static StatusSocketOptions options(const std::string& path, bool accept_start) {
    StatusSocketOptions o;
    o.path = path;
    o.accept_start = accept_start;
    return o;
  }
  void run() {
    while (!stop_) {
      {
        const std::scoped_lock hold(mutex_);
        status_.free_bytes -= 2'000'000;  // 20 MB a second
        socket_.publish(status_);
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
  }
  std::mutex mutex_;
  RigStatus status_;
  StatusSocket socket_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

class StatusPageTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!test::Chromium::is_there()) GTEST_SKIP() << "chromium is not installed: the page is not tried in a browser";
  }
  void keep_picture(test::Chromium& browser, const std::string& name) {
    const char* folder = std::getenv("MF_SCREENSHOTS");
    if (folder != nullptr) browser.screenshot(std::filesystem::path(folder) / (name + ".png"));
  }
  static std::string text(test::Chromium& browser, const std::string& id) {
    return browser.value("document.getElementById('" + id + "').textContent").get<std::string>();
  }
  static bool visible(test::Chromium& browser, const std::string& id) {
    return browser.value("document.getElementById('" + id + "').offsetParent !== null").get<bool>();
  }
  // Of any element, to the right or left of the page.
  static void expect_fits(test::Chromium& browser) {
    EXPECT_EQ(browser.value("innerWidth"), 360);
    EXPECT_EQ(browser.value("document.documentElement.scrollWidth"), 360);
    EXPECT_EQ(browser.value("[...document.querySelectorAll('body *')].filter(e => e.offsetParent && "
                            "(e.getBoundingClientRect().right > 360.5 || e.getBoundingClientRect().left < -0.5))"
                            ".map(e => e.id || e.tagName).join()"),
              "");
    EXPECT_EQ(browser.value("Math.min(...[...document.querySelectorAll('body *')].filter(e => e.offsetParent && "
                            "e.children.length == 0 && e.textContent.trim()).map(e => "
                            "parseFloat(getComputedStyle(e).fontSize)))"),
              16);
  }
  static bool banner_becomes(test::Chromium& browser, const std::string& state, const std::string& title) {
    return browser.becomes("document.getElementById('banner').dataset.state === '" + state +
                           "' && document.getElementById('state').textContent.startsWith('" + title + "')");
  }
  test::TemporaryFolder folder_;
  std::string socket_ = folder_ / "status.sock";
};

TEST_F(StatusPageTest, ShowsEveryStateOfTheRig) {
  test::StatusProgram program(socket_);
  test::Chromium browser({});
  browser.open(program.url());
  ASSERT_TRUE(banner_becomes(browser, "offline", "RECORDER OFF"));
  EXPECT_TRUE(contains(text(browser, "problem"), "mirrorfieldd does not run"));
  expect_fits(browser);
  keep_picture(browser, "off");

  RigStatus idle = example();
  idle.state = RigState::idle;
  idle.seconds = 0;
  idle.durable_frames = idle.lost_frames = idle.gaps = 0;
  idle.session.clear();
  idle.coverage.reset();
  auto rig = std::make_unique<Publisher>(socket_, idle);
  ASSERT_TRUE(banner_becomes(browser, "idle", "READY"));
  EXPECT_FALSE(visible(browser, "problem"));
  EXPECT_FALSE(visible(browser, "guidance"));
  EXPECT_FALSE(visible(browser, "start"));
  EXPECT_EQ(text(browser, "lost"), "none");
  expect_fits(browser);
  keep_picture(browser, "idle");

  RigStatus metering = idle;
  metering.state = RigState::metering;
  rig->set(metering);
  ASSERT_TRUE(banner_becomes(browser, "metering", "METERING"));
  keep_picture(browser, "metering");

  rig->set(example());
  ASSERT_TRUE(banner_becomes(browser, "recording", "RECORDING"));
  EXPECT_EQ(text(browser, "clock"), "1:12");
  EXPECT_EQ(text(browser, "frames"), "2\u2009671");
  EXPECT_EQ(text(browser, "rate"), "36.9 /s");
  EXPECT_EQ(text(browser, "lost"), "3 in 2 gaps");
  EXPECT_EQ(text(browser, "queue"), "4 of 48");
  EXPECT_EQ(text(browser, "free"), "31.2 GB");
  EXPECT_EQ(text(browser, "temperature"), "52 °C");
  EXPECT_EQ(text(browser, "exposure"), "4.00 ms");
  EXPECT_EQ(text(browser, "advice"), "tilt the mirror's left edge down");
  EXPECT_TRUE(visible(browser, "guidance"));
  EXPECT_TRUE(
      contains(browser.value("document.getElementById('hemisphere').ariaLabel").get<std::string>(), "azimuth 250°"));
  ASSERT_TRUE(browser.becomes("document.getElementById('left').textContent.endsWith('min')"));
  EXPECT_NEAR(std::stod(text(browser, "left")), 26, 6);  // 31 GB at 20 MB a second, on a busy machine
  // The picture was drawn: of many greys, and with the tags' colour.
  const nlohmann::json drawn = browser.value(
      "(() => { const c = document.getElementById('preview'); const d = c.getContext('2d').getImageData(0, 0, c.width, "
      "c.height).data; const greys = new Set(); let yellow = 0; for (let i = 0; i < d.length; i += 4) { if (d[i] === "
      "d[i + 2]) greys.add(d[i]); else if (d[i] > 200 && d[i + 2] < 60) ++yellow; } return [greys.size, yellow]; })()");
  EXPECT_GT(drawn[0].get<int>(), 40);
  EXPECT_GT(drawn[1].get<int>(), 200);
  // "Go here" stands in the south-west, where the lamp is, and nowhere else.
  const nlohmann::json red = browser.value(
      "(() => { const c = document.getElementById('hemisphere'), n = c.width; const d = "
      "c.getContext('2d').getImageData("
      "0, 0, n, n).data; let x = 0, y = 0, k = 0; for (let i = 0; i < d.length; i += 4) if (d[i] > 240 && d[i + 1] < "
      "60 "
      "&& d[i + 2] < 30) { x += i / 4 % n; y += Math.floor(i / 4 / n); ++k; } return [x / k, y / k, k]; })()");
  EXPECT_GT(red[2].get<int>(), 500);
  EXPECT_NEAR(red[0].get<double>(), 320 - 262 * 0.4604 * 0.3420, 4);  // sqrt(1 − sin 52°) and azimuth 250°
  EXPECT_NEAR(red[1].get<double>(), 320 + 262 * 0.4604 * 0.9397, 4);
  expect_fits(browser);
  keep_picture(browser, "recording");

  RigStatus covered = example();
  covered.coverage->done = true;
  covered.coverage->covered = 0.95;
  covered.coverage->advice.reset();
  rig->set(covered);
  ASSERT_TRUE(browser.becomes("document.getElementById('detail').textContent.startsWith('You may stop')"));
  EXPECT_EQ(text(browser, "covered"), "95 %");
  keep_picture(browser, "covered");

  covered.state = RigState::done;
  rig->set(covered);
  ASSERT_TRUE(banner_becomes(browser, "done", "DONE"));
  EXPECT_TRUE(contains(text(browser, "detail"), "2\u2009671 frames, all safe"));
  expect_fits(browser);
  keep_picture(browser, "done");

  RigStatus failed = example();
  failed.state = RigState::error;
  failed.problem = "/var/lib/mirrorfield is full: delete old sessions or mount another disk, then press the button";
  failed.preview.reset();
  rig->set(failed);
  ASSERT_TRUE(banner_becomes(browser, "error", "ERROR"));
  EXPECT_EQ(text(browser, "problem"), failed.problem);
  EXPECT_TRUE(visible(browser, "problem"));
  expect_fits(browser);
  keep_picture(browser, "error");

  rig.reset();
  ASSERT_TRUE(banner_becomes(browser, "offline", "RECORDER OFF"));
  rig = std::make_unique<Publisher>(socket_, example());
  ASSERT_TRUE(banner_becomes(browser, "recording", "RECORDING"));
  EXPECT_EQ(browser.faults(), std::vector<std::string>{});

  program.process().end();
  ASSERT_TRUE(banner_becomes(browser, "offline", "NO CONNECTION"));
  expect_fits(browser);
  keep_picture(browser, "no_connection");
}

TEST_F(StatusPageTest, HostileTextStaysText) {
  RigStatus hostile = example();
  hostile.state = RigState::recording;
  hostile.problem = "<img src=x onerror=\"document.title='owned'\"><script>document.title='owned'</script>";
  hostile.session = "</script><b id=injected>";
  hostile.camera = std::string(4000, 'W');
  hostile.coverage->advice->text = "<svg onload=alert(1)>\n\ndata: x";
  hostile.coverage->patches.push_back({std::nan(""), std::nan(""), std::nan(""), std::nan("")});
  const Publisher rig(socket_, hostile);
  test::StatusProgram program(socket_);
  test::Chromium browser({});
  browser.open(program.url());
  ASSERT_TRUE(banner_becomes(browser, "recording", "RECORDING"));
  EXPECT_EQ(text(browser, "problem"), hostile.problem);
  EXPECT_EQ(text(browser, "advice"), hostile.coverage->advice->text);
  EXPECT_EQ(browser.value("document.querySelectorAll('img, b, svg').length"), 0);
  expect_fits(browser);
  EXPECT_EQ(browser.faults(), std::vector<std::string>{});
}

TEST_F(StatusPageTest, DarkPagesKeepTheNumbers) {
  const Publisher rig(socket_, example());
  test::StatusProgram program(socket_);
  test::Chromium browser({360, 740, 2, true});
  browser.open(program.url());
  ASSERT_TRUE(banner_becomes(browser, "recording", "RECORDING"));
  EXPECT_EQ(browser.value("getComputedStyle(document.body).backgroundColor"), "rgb(0, 0, 0)");
  EXPECT_EQ(browser.value("getComputedStyle(document.body).color"), "rgb(255, 255, 255)");
  expect_fits(browser);
  keep_picture(browser, "dark");
  EXPECT_EQ(browser.faults(), std::vector<std::string>{});
}

TEST_F(StatusPageTest, APairedBrowserStartsARecording) {
  const std::string token = "correct-horse-battery";
  std::ofstream(folder_ / "token") << token << "\n";
  std::filesystem::permissions(folder_ / "token", std::filesystem::perms(0600));
  RigStatus idle = example();
  idle.state = RigState::idle;
  Publisher rig(socket_, idle, true);
  test::StatusProgram program(socket_, {"--token-file", folder_ / "token"});
  test::Chromium browser({});
  browser.open(program.url());
  ASSERT_TRUE(browser.becomes("!document.getElementById('start').hidden"));
  EXPECT_TRUE(visible(browser, "token"));
  expect_fits(browser);
  keep_picture(browser, "start");
  browser.value(
      "document.getElementById('token').value = 'a wrong word, surely'; "
      "document.getElementById('start-button').click()");
  ASSERT_TRUE(browser.becomes("document.getElementById('start-answer').textContent.includes('not the pairing word')"));
  EXPECT_FALSE(rig.take_start_request());
  browser.value("document.getElementById('token').value = '" + token +
                "'; document.getElementById('start-button').click()");
  ASSERT_TRUE(browser.becomes("document.getElementById('start-answer').textContent.includes('asked to start')"));
  std::optional<StartRequest> start;
  for (int i = 0; i < 100 && !start; ++i) {
    start = rig.take_start_request();
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  ASSERT_TRUE(start);
  EXPECT_EQ(start->token, token);
  // The rig has taken it; a second one while that waits would be refused, and the page says so.
  browser.value("document.getElementById('start-button').click()");
  browser.value("document.getElementById('start-button').click()");
  EXPECT_TRUE(
      browser.becomes("document.getElementById('start-answer').textContent === 'Refused: another request waits'"));
  // Another day, by the link that pairs: the word is not asked for, and does not stay in the address.
  browser.open(program.url() + "#token=" + token);
  ASSERT_TRUE(browser.becomes("!document.getElementById('start').hidden"));
  EXPECT_FALSE(visible(browser, "token"));
  EXPECT_EQ(browser.value("location.hash"), "");
}

}  // namespace
}  // namespace mf
