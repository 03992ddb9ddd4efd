// What an installed rigd brings: units that are shut tight, manual pages, completion.
#include <filesystem>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <utility>
#include <vector>

#include "tests/core/temporary_folder.h"
#include "tests/system/program.h"
#include "tests/system/small_rig.h"

namespace rig::test {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

namespace {

constexpr const char* kUnit = RIG_BINARY_DIR "/systemd/rigd.service";

// A shell command; its exit status, or minus a signal. Its output stays in `output`.
int shell(const std::string& command, const fs::path& output) {
  return in_child([&] {
    const std::string all = "{ " + command + "; } > '" + output.string() + "' 2>&1 < /dev/null";
    ::execl("/bin/bash", "bash", "--norc", "-c", all.c_str(), nullptr);
    return 127;
  });
}

class Unit : public testing::Test {
 protected:
  // systemd reads drop-ins beside the unit, so that each test has a unit of its own.
  void SetUp() override { fs::copy_file(kUnit, unit_); }
  [[nodiscard]] int exposure_within(int tenths) {
    return shell(fmt::format("systemd-analyze security --no-pager --offline=true --threshold={} {}", tenths,
                             unit_.string()),
                 log_);
  }

  TemporaryFolder folder_;
  fs::path unit_ = folder_ / "rigd.service";
  fs::path log_ = folder_ / "log";
};

}  // namespace

TEST_F(Unit, IsShutTightWithoutNetwork) {
  EXPECT_EQ(exposure_within(15), 0) << bytes_in(log_);
  // The tool and this test can tell a tight unit from an open one.
  EXPECT_NE(exposure_within(1), 0) << bytes_in(log_);
}

TEST_F(Unit, IsShutTightWithNetwork) {
  fs::create_directories(folder_ / "rigd.service.d");
  fs::copy_file(RIG_SOURCE_DIR "/systemd/rigd.service.d/network.conf",
                folder_ / "rigd.service.d/network.conf");
  EXPECT_EQ(exposure_within(20), 0) << bytes_in(log_);
  EXPECT_THAT(bytes_in(log_), HasSubstr("RestrictAddressFamilies=~AF_(INET|INET6)"));
}

TEST_F(Unit, IsUnderstoodBySystemd) {
  // With the programs of this build: those it names are installed later.
  std::string text = bytes_in(unit_);
  for (const char* program : {"rigd-safe", "rigd"}) {
    const std::string name = std::string("/bin/") + program;
    for (std::size_t at = 0; (at = text.find(name, at)) != std::string::npos;) {
      const std::size_t from = text.rfind('=', at) + 1;
      const std::string built = program_path(program);
      text.replace(from, at + name.size() - from, built);
      at = from + built.size();
    }
  }
  put_bytes(unit_, text);
  EXPECT_EQ(shell("systemd-analyze verify --man=no --recursive-errors=no " + unit_.string(), log_), 0)
      << bytes_in(log_);
  EXPECT_EQ(bytes_in(log_), "");
}

TEST(Installation, RulesOfUsersAndFoldersAreUnderstoodBySystemd) {
  const TemporaryFolder folder;
  const auto log = folder / "log";
  EXPECT_EQ(shell("systemd-sysusers --dry-run " RIG_SOURCE_DIR "/systemd/sysusers.conf", log), 0)
      << bytes_in(log);
  EXPECT_THAT(bytes_in(log), AllOf(HasSubstr("rig-observe"), HasSubstr("rig-operate"), HasSubstr("rigd")));
}

TEST(Installation, BringsProgramsModulesPagesAndUnits) {
  const TemporaryFolder folder;
  const auto log = folder / "log";
  ASSERT_EQ(
      shell(fmt::format("cmake --install {} --prefix {}", RIG_BINARY_DIR, (folder / "usr").string()), log), 0)
      << bytes_in(log);
  for (const char* file :
       {"bin/rigd", "bin/rigd-safe", "bin/rig", "bin/rig-plan", "lib/rigd/librig_driver_virtual.so",
        "lib/systemd/system/rigd.service", "lib/sysusers.d/rigd.conf", "lib/tmpfiles.d/rigd.conf",
        "lib/udev/rules.d/60-rigd.rules", "share/rigd/network.conf", "share/rigd/virtual/rig.toml",
        "share/man/man8/rigd.8", "share/man/man8/rigd-safe.8"}) {
    EXPECT_TRUE(fs::exists(folder / "usr" / file)) << file;
  }
  for (const auto& program : fs::directory_iterator(folder / "usr/bin")) {
    const std::string name = program.path().filename().string();
    EXPECT_TRUE(fs::exists(folder / "usr/share/bash-completion/completions" / name)) << name;
    if (name.rfind("rigd", 0) == 0) continue;
    EXPECT_TRUE(fs::exists(folder / "usr/share/man/man1" / (name + ".1"))) << name;
  }
  // It finds its module where it was installed.
  EXPECT_EQ(shell(fmt::format("{0}/bin/rigd --check --config {0}/share/rigd/virtual/rig.toml",
                              (folder / "usr").string()),
                  log),
            0)
      << bytes_in(log);
}

TEST(Manual, SaysWhatTheProgramSaysAndMore) {
  const std::string page = bytes_in(RIG_BINARY_DIR "/man/rigd.8");
  EXPECT_THAT(page, AllOf(HasSubstr("rigd - the daemon"), HasSubstr("\\-\\-check"),
                          HasSubstr("/etc/rigd/rig.toml"), HasSubstr("SIGTERM")));
  EXPECT_THAT(bytes_in(RIG_BINARY_DIR "/man/rig.1"),
              AllOf(HasSubstr("\\-\\-until\\-idle"), HasSubstr("RIG_ENDPOINT"),
                    HasSubstr("\\-\\-preview\\-width"), HasSubstr("/etc/rigd/rig.toml")));
}

TEST(Completion, OffersWhatTheProgramsKnow) {
  const std::vector<std::pair<std::string, std::string>> typed_and_offered{
      {"rig stat", "<status>"},
      {"rig job sub", "<submit>"},
      {"rig job submit --sc", "<--scan>"},
      {"rig watch --", "<--until-idle>"},
      {"rig pla", "<plan>"},
      {"rig plan --angle", "<--angle-deg>"},
      {"rig metrics --js", "<--json>"},
      {"rig liv", "<live>"},
      {"rig live --au", "<--auto>"},
      {"rig axis se", "<setup>"},
      {"rig axis setup --sc", "<--scale-deg>"},
      {"rig-plan --angle", "<--angle-deg>"},
      {"rigd --ch", "<--check>"},
      {"rigd-safe --wi", "<--within-s>"}};
  const TemporaryFolder folder;
  const auto log = folder / "log";
  for (const auto& [typed, offered] : typed_and_offered) {
    const std::string script = fmt::format(
        "export PATH={}/bin:$PATH; source {}/share/completion/rig.bash; COMP_WORDS=({}); "
        "COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); _rig; printf '<%s>' \"${{COMPREPLY[@]}}\"",
        RIG_BINARY_DIR, RIG_SOURCE_DIR, typed);
    EXPECT_EQ(shell(script, log), 0);
    EXPECT_THAT(bytes_in(log), HasSubstr(offered)) << typed;
  }
}

}  // namespace rig::test
