// One owner of a folder, also right after the one before was killed.
#include "core/base/folder_lock.h"

#include <chrono>
#include <gtest/gtest.h>
#include <optional>
#include <thread>

#include "tests/core/temporary_folder.h"

namespace rig::base {
namespace {

const FolderLock::Taken kTaken{"somebody has it", "stop him"};

TEST(FolderLock, IsForOneAndGoesWithHim) {
  const test::TemporaryFolder folder;
  {
    const auto first = FolderLock::take(folder / "state", "lock", kTaken);
    ASSERT_TRUE(first.has_value()) << first.error().text();
    const auto second = FolderLock::take(folder / "state", "lock", kTaken);
    ASSERT_FALSE(second.has_value());
    EXPECT_EQ(second.error().code, ErrorCode::busy);
    EXPECT_NE(second.error().text().find("somebody has it (stop him)"), std::string::npos)
        << second.error().text();
  }
  EXPECT_TRUE(FolderLock::take(folder / "state", "lock", kTaken).has_value());
}

// A process that was just killed may leave it to a child for a moment.
TEST(FolderLock, WaitsForAMomentForOneWhoIsAboutToGo) {
  const test::TemporaryFolder folder;
  auto first = FolderLock::take(folder.path(), "lock", kTaken);
  ASSERT_TRUE(first.has_value());
  std::thread goes([held = std::optional<FolderLock>(std::move(*first))]() mutable {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));  // the moment
    held.reset();
  });
  EXPECT_TRUE(FolderLock::take(folder.path(), "lock", kTaken).has_value());
  goes.join();
}

}  // namespace
}  // namespace rig::base
