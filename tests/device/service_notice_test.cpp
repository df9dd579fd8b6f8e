// SPDX-License-Identifier: Apache-2.0
#include "device/service_notice.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <cstring>

#include "device/c_handle.h"
#include "device/owned_fd.h"
#include "tests/support/temporary_folder.h"

namespace mf {
namespace {

// systemd's end of NOTIFY_SOCKET.
class ServiceNotice : public testing::Test {
 protected:
  ServiceNotice() : socket_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, (folder_ / "notify").c_str(), sizeof address.sun_path - 1);
    EXPECT_EQ(::bind(socket_.get(), reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    ::setenv("NOTIFY_SOCKET", address.sun_path, 1);
  }
  ~ServiceNotice() override {
    ::unsetenv("NOTIFY_SOCKET");
    ::unsetenv("WATCHDOG_USEC");
    ::unsetenv("WATCHDOG_PID");
  }
  [[nodiscard]] std::string heard() const {
    std::array<char, 4096> text{};
    const ssize_t got = ::recv(socket_.get(), text.data(), text.size(), 0);
    return got < 0 ? "" : std::string(text.data(), static_cast<std::size_t>(got));
  }
  test::TemporaryFolder folder_;
  OwnedFd socket_;
};

TEST_F(ServiceNotice, EachIsOneMessage) {
  notice_ready();
  EXPECT_EQ(heard(), "READY=1");
  notice_status("recording: 120 frames");
  EXPECT_EQ(heard(), "STATUS=recording: 120 frames");
  notice_alive();
  EXPECT_EQ(heard(), "WATCHDOG=1");
  notice_stopping();
  EXPECT_EQ(heard(), "STOPPING=1");
  EXPECT_EQ(heard(), "");
}

TEST_F(ServiceNotice, AStatusCannotSayAnythingElse) {
  notice_status("idle\nREADY=1");
  EXPECT_EQ(heard(), "STATUS=idle READY=1");
}

TEST_F(ServiceNotice, SaysNothingWithoutAServiceManager) {
  ::unsetenv("NOTIFY_SOCKET");
  notice_ready();
  notice_status("idle");
  notice_alive();
  notice_stopping();
  EXPECT_EQ(heard(), "");
}

TEST_F(ServiceNotice, TheWatchdogIsRemindedTwiceAsOftenAsAsked) {
  EXPECT_FALSE(notice_alive_each());
  ::setenv("WATCHDOG_USEC", "10000000", 1);
  ::setenv("WATCHDOG_PID", std::to_string(::getpid()).c_str(), 1);
  EXPECT_EQ(notice_alive_each(), std::chrono::seconds(5));
  ::setenv("WATCHDOG_PID", "1", 1);
  EXPECT_FALSE(notice_alive_each()) << "meant for another process";
}

}  // namespace
}  // namespace mf
