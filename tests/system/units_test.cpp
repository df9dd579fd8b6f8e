// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <regex>

#include "tests/support/expect_input_error.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_folder.h"

namespace mf::test {
namespace {

const std::filesystem::path source = MF_SOURCE_DIR;
constexpr std::array units{"mirrorfieldd.service", "mirrorfield-status.service"};

std::string content(const std::filesystem::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

class Units : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (!has_program("systemd-analyze")) GTEST_SKIP() << "systemd-analyze is missing";
  }
  // The unit with a program that is there, as systemd-analyze wants it, and with `more` after its [Service].
  [[nodiscard]] std::filesystem::path unit(const std::string& more = "") const {
    std::string text = std::regex_replace(content(source / "systemd" / GetParam()),
                                          std::regex("/usr/bin/mirrorfield\\S*"), "/bin/true");
    text = std::regex_replace(text, std::regex("\\[Service\\]\n"), "[Service]\n" + more);
    std::ofstream(folder_ / GetParam()) << text;
    return folder_ / GetParam();
  }
  // 0 (sealed) to 10 (open).
  [[nodiscard]] static double exposure(const std::filesystem::path& unit) {
    const CommandOutcome outcome = run_command({"systemd-analyze", "security", "--offline=true", "--no-pager", unit});
    static const std::regex figure("Overall exposure level for .*: ([0-9.]+)");
    std::smatch match;
    EXPECT_TRUE(std::regex_search(outcome.out, match, figure)) << outcome.out << outcome.err;
    return match.empty() ? 10 : std::strtod(match[1].str().c_str(), nullptr);
  }
  TemporaryFolder folder_;
};

TEST_P(Units, AreSealed) {
  const double ours = exposure(unit());
  std::cout << "  " << GetParam() << ": " << ours << "\n";
  EXPECT_LE(ours, 2.1);
  // That it judges at all: the plainest unit.
  std::ofstream(folder_ / "open.service") << "[Service]\nExecStart=/bin/true\n";
  EXPECT_GT(exposure(folder_ / "open.service"), 8);
}

TEST_P(Units, HaveNoUnknownKey) {
  const auto complaints = [](const std::filesystem::path& file) {
    const CommandOutcome outcome = run_command({"systemd-analyze", "verify", "--man=no", file});
    return outcome.out + outcome.err;
  };
  EXPECT_EQ(complaints(unit()), "");
  EXPECT_TRUE(contains(complaints(unit("ProtectSystm=strict\n")), "ProtectSystm"));
}

TEST_P(Units, HaveTheirManualPages) {
  static const std::regex page(R"(man:([\w.-]+)\((\d)\))");
  const std::string text = content(source / "systemd" / GetParam());
  int found = 0;
  for (std::sregex_iterator m(text.begin(), text.end(), page), end; m != end; ++m, ++found)
    EXPECT_TRUE(std::filesystem::exists(source / "docs/man" / ((*m)[1].str() + "." + (*m)[2].str()))) << m->str();
  EXPECT_GT(found, 0);
}

INSTANTIATE_TEST_SUITE_P(System, Units, testing::ValuesIn(units), [](const auto& unit) {
  return std::string(unit.param).substr(0, 11) + (unit.param[11] == 'd' ? "d" : "Status");
});

TEST(Sysusers, AreUnderstood) {
  if (!has_program("systemd-sysusers")) GTEST_SKIP() << "systemd-sysusers is missing";
  const CommandOutcome outcome =
      run_command({"systemd-sysusers", "--dry-run", source / "systemd/sysusers.d/mirrorfield.conf"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(contains(outcome.out + outcome.err, "mirrorfield"));
}

TEST(ManPages, AreSetWithoutAWarning) {
  if (!has_program("groff")) GTEST_SKIP() << "groff is missing";
  int pages = 0;
  for (const auto& page : std::filesystem::directory_iterator(source / "docs/man")) {
    const CommandOutcome outcome = run_command({"groff", "-ww", "-t", "-man", "-Tutf8", page.path()});
    EXPECT_EQ(outcome.exit_code, 0);
    EXPECT_EQ(outcome.err, "") << page.path();
    EXPECT_TRUE(contains(outcome.out, "DESCRIPTION") || contains(outcome.out, "D\bDE"));
    ++pages;
  }
  EXPECT_EQ(pages, 3);
}

// An option that the page leaves out, or one that the program does not have.
TEST(ManPages, NameEveryOptionOfTheDaemon) {
  const std::string page = std::regex_replace(content(source / "docs/man/mirrorfieldd.8"), std::regex("\\\\-"), "-");
  const CommandOutcome help = run_command({MF_BINARY_DIR "/mirrorfieldd", "--help"});
  ASSERT_EQ(help.exit_code, 0) << help.err;
  static const std::regex option("--[a-z][a-z-]+");
  int options = 0;
  for (std::sregex_iterator m(help.out.begin(), help.out.end(), option), end; m != end; ++m, ++options)
    EXPECT_TRUE(contains(page, m->str()));
  EXPECT_GT(options, 4);
}

}  // namespace
}  // namespace mf::test
