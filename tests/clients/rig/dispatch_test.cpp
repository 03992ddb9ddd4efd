// Which program `rig NAME` runs.
#include "clients/rig/dispatch.h"

#include <algorithm>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/temporary_folder.h"

namespace rig::client {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::Not;

class Dispatch : public testing::Test {
 protected:
  Dispatch() {
    fs::create_directory(first_);
    fs::create_directory(second_);
    set_path(first_.string() + "::" + second_.string() + ":" + (folder_ / "absent").string());
  }
  ~Dispatch() override {
    if (path_before_)
      ::setenv("PATH", path_before_->c_str(), 1);
    else
      ::unsetenv("PATH");
    std::error_code absent;
    fs::remove(beside_, absent);
  }

  static void set_path(const std::string& path) { ::setenv("PATH", path.c_str(), 1); }

  static void put_program(const fs::path& path, bool executable = true) {
    test::put_bytes(path, "#!/bin/sh\n");
    fs::permissions(path, executable ? fs::perms::owner_all : fs::perms::owner_read);
  }

  test::TemporaryFolder folder_;
  const fs::path first_ = folder_ / "first", second_ = folder_ / "second";
  // A name that nobody else has, in the folder of this program.
  const std::string own_ = "dispatch-test-" + std::to_string(::getpid());
  const fs::path beside_ = fs::read_symlink("/proc/self/exe").parent_path() / ("rig-" + own_);

 private:
  const std::optional<std::string> path_before_ =
      std::getenv("PATH") != nullptr ? std::optional<std::string>(std::getenv("PATH")) : std::nullopt;
};

TEST_F(Dispatch, FindsProgramsOnThePathInItsOrder) {
  EXPECT_EQ(find_program(own_), std::nullopt);
  put_program(second_ / ("rig-" + own_));
  EXPECT_EQ(find_program(own_), second_ / ("rig-" + own_));
  put_program(first_ / ("rig-" + own_));
  EXPECT_EQ(find_program(own_), first_ / ("rig-" + own_));
  EXPECT_EQ(find_program("rig-" + own_), std::nullopt);
}

TEST_F(Dispatch, PrefersTheProgramBesideItself) {
  put_program(first_ / ("rig-" + own_));
  put_program(beside_);
  EXPECT_EQ(find_program(own_), beside_);
  ::unsetenv("PATH");
  EXPECT_EQ(find_program(own_), beside_);
}

TEST_F(Dispatch, RefusesNamesThatArePaths) {
  fs::create_directory(first_ / "rig-x");
  put_program(first_ / "rig-x" / "tool");
  put_program(first_ / "tool");
  for (const char* name : {"", "/", "x/tool", "x/../tool", "../first/rig-x/tool", "/bin/sh"})
    EXPECT_EQ(find_program(name), std::nullopt) << name;
}

TEST_F(Dispatch, TakesOnlyFilesThatCanBeRun) {
  put_program(first_ / "rig-readable", false);
  fs::create_directory(first_ / "rig-folder");
  fs::create_symlink(folder_ / "nowhere", first_ / "rig-dangling");
  for (const char* name : {"readable", "folder", "dangling"}) {
    EXPECT_EQ(find_program(name), std::nullopt) << name;
    EXPECT_THAT(programs(), Not(Contains(name)));
  }
  put_program(second_ / "rig-readable");
  put_program(second_ / "rig-folder");
  fs::create_symlink(second_ / "rig-folder", second_ / "rig-linked");
  for (const char* name : {"readable", "folder", "linked"}) {
    EXPECT_EQ(find_program(name), second_ / (std::string("rig-") + name));
    EXPECT_THAT(programs(), Contains(name));
  }
}

TEST_F(Dispatch, ListsEveryProgramOnceAndSorted) {
  for (const char* name : {"rig-zebra", "rig-apple", "rigging", "other-rig-x"}) put_program(first_ / name);
  put_program(second_ / "rig-apple");
  const auto names = programs();
  EXPECT_TRUE(std::is_sorted(names.begin(), names.end()));
  EXPECT_EQ(std::count(names.begin(), names.end(), "apple"), 1);
  EXPECT_EQ(std::count(names.begin(), names.end(), "zebra"), 1);
  EXPECT_THAT(names, Not(Contains("ging")));
  EXPECT_THAT(names, Not(Contains("x")));
}

}  // namespace
}  // namespace rig::client
