// The right to listen in a folder: one server's at a time, and gone with it, however it ended.
#include "protocol/socket_folder.h"

#include <csignal>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>

#include "tests/core/temporary_folder.h"

namespace rig::protocol {
namespace {

namespace fs = std::filesystem;
using base::ErrorCode;
using testing::HasSubstr;

// A socket file as a program leaves it that was killed.
void leave_socket(const fs::path& path) {
  const int fd = ::socket(AF_UNIX, SOCK_STREAM, 0);
  ASSERT_GE(fd, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  ASSERT_LT(path.string().size(), sizeof address.sun_path);
  path.string().copy(address.sun_path, sizeof address.sun_path - 1);
  ASSERT_EQ(::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  ::close(fd);
  ASSERT_TRUE(fs::is_socket(path));
}

TEST(SocketFolder, IsMadeAndTaken) {
  const test::TemporaryFolder folder;
  const auto taken = SocketFolder::take(folder / "run" / "rigd");
  ASSERT_TRUE(taken.has_value()) << taken.error().text();
  EXPECT_EQ(taken->make_way("a.sock").value(), folder.path() / "run" / "rigd" / "a.sock");
}

TEST(SocketFolder, IsTakenByOneOnly) {
  const test::TemporaryFolder folder;
  {
    const auto first = SocketFolder::take(folder.path());
    ASSERT_TRUE(first.has_value());
    const auto second = SocketFolder::take(folder.path());
    ASSERT_FALSE(second.has_value());
    EXPECT_EQ(second.error().code, ErrorCode::busy);
    EXPECT_THAT(second.error().text(), HasSubstr(folder.path().string()));
    // From another process too.
    EXPECT_EQ(test::in_child([&] { return SocketFolder::take(folder.path()) ? 1 : 0; }), 0);
  }
  EXPECT_TRUE(SocketFolder::take(folder.path()).has_value());
}

TEST(SocketFolder, IsFreeWhenItsServerWasKilled) {
  const test::TemporaryFolder folder;
  const int status = test::in_child([&] {
    const auto taken = SocketFolder::take(folder.path());
    return taken ? ::raise(SIGKILL) : 1;
  });
  ASSERT_EQ(status, -1);
  EXPECT_TRUE(SocketFolder::take(folder.path()).has_value());
}

TEST(SocketFolder, ALeftOverMakesWay) {
  const test::TemporaryFolder folder;
  leave_socket(folder / "a.sock");
  const auto taken = SocketFolder::take(folder.path());
  ASSERT_TRUE(taken.has_value());
  ASSERT_TRUE(taken->make_way("a.sock").has_value());
  EXPECT_FALSE(fs::exists(folder / "a.sock"));
}

TEST(SocketFolder, WhatIsNoSocketStays) {
  const test::TemporaryFolder folder;
  test::put_bytes(folder / "file", "mine");
  fs::create_directory(folder / "folder");
  fs::create_symlink(folder / "nowhere", folder / "link");
  const auto taken = SocketFolder::take(folder.path());
  ASSERT_TRUE(taken.has_value());
  for (const char* name : {"file", "folder", "link"}) {
    const auto way = taken->make_way(name);
    ASSERT_FALSE(way.has_value()) << name;
    EXPECT_EQ(way.error().code, ErrorCode::refused);
    EXPECT_EQ(way.error().where, (folder / name).string());
  }
  EXPECT_EQ(test::bytes_in(folder / "file"), "mine");
  EXPECT_TRUE(fs::is_symlink(folder / "link"));
}

TEST(SocketFolder, ALongPathIsSaidToBeLong) {
  const test::TemporaryFolder folder;
  const auto taken = SocketFolder::take(folder.path() / std::string(100, 'x'));
  ASSERT_TRUE(taken.has_value());
  const auto way = taken->make_way("a.sock");
  ASSERT_FALSE(way.has_value());
  EXPECT_EQ(way.error().code, ErrorCode::bad_input);
  EXPECT_THAT(way.error().what, HasSubstr("107 letters"));
}

TEST(SocketFolder, AFileInItsPlaceIsAnError) {
  const test::TemporaryFolder folder;
  test::put_bytes(folder / "file", "mine");
  for (const fs::path& path : {folder / "file", folder / "file" / "run"}) {
    const auto taken = SocketFolder::take(path);
    ASSERT_FALSE(taken.has_value());
    EXPECT_EQ(taken.error().code, ErrorCode::io);
  }
  EXPECT_EQ(test::bytes_in(folder / "file"), "mine");
}

}  // namespace
}  // namespace rig::protocol
