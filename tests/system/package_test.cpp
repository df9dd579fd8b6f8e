// SPDX-License-Identifier: Apache-2.0
// The rig's Debian package, built and unpacked into a folder; nothing of it is installed.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <array>
#include <filesystem>
#include <fstream>

#include "device/config.h"
#include "tests/support/expect_input_error.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_folder.h"

namespace mf::test {
namespace {

namespace fs = std::filesystem;

class Package : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* program : {"dpkg-deb", "dpkg-shlibdeps"})
      if (!has_program(program)) GTEST_SKIP() << program << " is missing";
    const CommandOutcome built = run_command(
        {MF_CPACK, "-G", "DEB", "--config", MF_PROJECT_BINARY_DIR "/CPackConfig.cmake", "-B", folder_ / "built"});
    ASSERT_EQ(built.exit_code, 0) << built.out << built.err;
    for (const auto& file : fs::directory_iterator(folder_ / "built"))
      if (file.path().extension() == ".deb") deb_ = file.path();
    ASSERT_FALSE(deb_.empty()) << built.out;
    ASSERT_EQ(run_command({"dpkg-deb", "-x", deb_, folder_ / "root"}).exit_code, 0);
    ASSERT_EQ(run_command({"dpkg-deb", "-e", deb_, folder_ / "control"}).exit_code, 0);
  }
  TemporaryFolder folder_;
  fs::path deb_;
};

// Recording begins when somebody asks for it, not because a package came.
void scripts_start_nothing(const fs::path& control) {
  for (const char* script : {"postinst", "prerm", "postrm"}) {
    EXPECT_EQ(run_command({"sh", "-n", control / script}).exit_code, 0) << script;
    std::ifstream in(control / script);
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    EXPECT_EQ(text.find("systemctl start"), std::string::npos) << script;
    EXPECT_EQ(text.find("enable"), text.find("enable mirror")) << script;
  }
}

TEST_F(Package, HoldsTheRigAndRunsFromWhereItIsUnpacked) {
  const fs::path root = folder_ / "root";
  std::cout << "  " << deb_.filename().string() << ": " << fs::file_size(deb_) << " bytes\n";
  for (const char* file : {"usr/bin/mirrorfieldd", "usr/lib/systemd/system/mirrorfieldd.service",
                           "usr/lib/udev/rules.d/60-mirrorfield.rules", "usr/lib/sysusers.d/mirrorfield.conf",
                           "etc/mirrorfield/mirrorfieldd.toml", "usr/share/man/man8/mirrorfieldd.8.gz",
                           "usr/share/man/man5/mirrorfieldd.toml.5.gz", "usr/share/doc/mirrorfield-rig/copyright",
                           "usr/share/doc/mirrorfield-rig/examples/60-mirrorfield.conf"})
    EXPECT_TRUE(fs::is_regular_file(root / file)) << file;
  for (const auto& entry : fs::recursive_directory_iterator(root)) {
    struct stat s {};
    ASSERT_EQ(::lstat(entry.path().c_str(), &s), 0);
    EXPECT_EQ(s.st_mode & S_IWOTH, 0U) << entry.path() << " may be written by everybody";
    EXPECT_NE(entry.path().filename(), "mirrorfield-sim") << "the simulator is never shipped to a rig";
  }
  const CommandOutcome help = run_command({root / "usr/bin/mirrorfieldd", "--help"});
  EXPECT_EQ(help.exit_code, 0) << help.err;
  EXPECT_TRUE(contains(help.out, "--config"));

  const CommandOutcome control = run_command({"dpkg-deb", "-I", deb_});
  EXPECT_TRUE(contains(control.out, "Package: mirrorfield-rig"));
  EXPECT_TRUE(contains(control.out, "libaravis"));
  std::ifstream conffiles(folder_ / "control/conffiles");
  std::string line;
  ASSERT_TRUE(std::getline(conffiles, line));
  EXPECT_TRUE(fs::exists(root / line.substr(1))) << "a conffile that is not there";
  EXPECT_NO_THROW((void)read_device_config(root / line.substr(1)));
  scripts_start_nothing(folder_ / "control");
}

}  // namespace
}  // namespace mf::test
