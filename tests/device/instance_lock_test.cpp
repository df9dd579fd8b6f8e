// SPDX-License-Identifier: Apache-2.0
#include "device/instance_lock.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>

#include "tests/support/expect_input_error.h"
#include "tests/support/temporary_folder.h"

namespace mf {
namespace {

TEST(InstanceLock, TheSecondIsToldWhoTheFirstIs) {
  const test::TemporaryFolder folder;
  EXPECT_FALSE(instance_lock_holder(folder.path()));
  {
    const InstanceLock first(folder.path());
    const std::string error = test::input_error_of([&] { const InstanceLock second(folder.path()); });
    EXPECT_TRUE(test::contains(error, "another mirrorfieldd (process " + std::to_string(::getpid()) + ")"));
    EXPECT_EQ(instance_lock_holder(folder.path()), ::getpid());
    EXPECT_EQ(instance_lock_holder(folder.path()), ::getpid()) << "asking takes nothing away";
  }
  EXPECT_FALSE(instance_lock_holder(folder.path()));
  const InstanceLock again(folder.path());
}

TEST(InstanceLock, AKilledDaemonHoldsNothing) {
  const test::TemporaryFolder folder;
  std::array<int, 2> ready{};
  ASSERT_EQ(::pipe(ready.data()), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    const InstanceLock held(folder.path());
    (void)!::write(ready[1], "x", 1);
    ::pause();
    ::_exit(0);
  }
  char byte = 0;
  ASSERT_EQ(::read(ready[0], &byte, 1), 1);
  EXPECT_EQ(instance_lock_holder(folder.path()), child);
  EXPECT_TRUE(test::contains(test::input_error_of([&] { const InstanceLock mine(folder.path()); }), "another"));
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  const InstanceLock mine(folder.path());
  ::close(ready[0]);
  ::close(ready[1]);
}

TEST(InstanceLock, AFolderThatIsNotThereIsNamed) {
  EXPECT_TRUE(test::contains(test::input_error_of([] { const InstanceLock lock("/nowhere/at/all"); }),
                             "/nowhere/at/all: the recordings folder cannot be written"));
}

}  // namespace
}  // namespace mf
