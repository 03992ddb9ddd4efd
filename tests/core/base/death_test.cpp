#include "core/base/death.h"

#include <csignal>
#include <cstdlib>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "core/base/files.h"
#include "tests/core/temporary_folder.h"

namespace rig::base {
namespace {

// Replaces a file by "new" in a process that dies at an instant; the signal that ended it, or 0.
int replace_dying_at(const char* instant, const std::filesystem::path& file) {
  const pid_t child = ::fork();
  if (child == 0) {
    ::setenv("RIG_DIE_AT", instant, 1);
    ::_exit(write_file_durably(file, "new") ? 0 : 1);
  }
  int status = 0;
  EXPECT_EQ(::waitpid(child, &status, 0), child);
  return WIFSIGNALED(status) ? WTERMSIG(status) : 0;
}

TEST(Death, ComesAtTheInstantThatIsNamed) {
  test::TemporaryFolder folder;
  for (const auto& [instant, content] :
       {std::pair("before-write:1", "old"), std::pair("after-write:1", "old"),
        std::pair("before-flush:1", "old"), std::pair("after-flush:1", "old"),
        std::pair("before-rename:1", "old"), std::pair("after-rename:1", "new"),
        std::pair("before-flush:2", "new"), std::pair("after-flush:2", "new"), std::pair("any:5", "old"),
        std::pair("any:6", "new")}) {
    test::put_bytes(folder / "file", "old");
    EXPECT_EQ(replace_dying_at(instant, folder / "file"), SIGKILL) << instant;
    EXPECT_EQ(test::bytes_in(folder / "file"), content) << instant;
  }
}

TEST(Death, DoesNotComeWhereItsInstantIsNeverReached) {
  test::TemporaryFolder folder;
  for (const char* instant : {"before-write:2", "before-commit:1", "any:99"}) {
    EXPECT_EQ(replace_dying_at(instant, folder / "file"), 0) << instant;
    EXPECT_EQ(test::bytes_in(folder / "file"), "new");
  }
}

TEST(Death, KnowsItsInstants) {
  for (const char* good : {"before-write:1", "after-commit:12", "any:3"}) EXPECT_TRUE(names_an_instant(good));
  for (const char* bad : {"", "write:1", "before-write", "before-write:", "before-write:0", "any:x", "any:3 ",
                          "during-write:1", "before-read:1"}) {
    EXPECT_FALSE(names_an_instant(bad)) << bad;
  }
  EXPECT_FALSE(names_an_instant(nullptr));
}

}  // namespace
}  // namespace rig::base
