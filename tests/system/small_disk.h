// A disk of a few megabytes that a test can fill, or make read-only, for real.
#pragma once

#include <cerrno>
#include <fcntl.h>
#include <filesystem>
#include <fmt/format.h>
#include <fstream>
#include <gtest/gtest.h>
#include <sched.h>
#include <string>
#include <sys/mount.h>
#include <unistd.h>

namespace rig::test {

/// Mounts of this process and of those it starts alone; they end with it. False where the system allows none.
inline bool have_own_mounts() {
  const uid_t user = ::geteuid();
  const gid_t group = ::getegid();
  if (user == 0) {
    if (::unshare(CLONE_NEWNS) != 0) return false;
  } else {
    // As the same user, who may mount in a namespace of his own.
    if (::unshare(CLONE_NEWUSER | CLONE_NEWNS) != 0) return false;
    std::ofstream("/proc/self/setgroups") << "deny";
    std::ofstream("/proc/self/uid_map") << fmt::format("{0} {0} 1", user);
    std::ofstream("/proc/self/gid_map") << fmt::format("{0} {0} 1", group);
  }
  return ::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0;
}

/// Mounted at a folder, which is made.
class SmallDisk {
 public:
  SmallDisk(const std::filesystem::path& at, int megabytes) : at_(at) {
    std::filesystem::create_directories(at_);
    const std::string size = fmt::format("size={}m", megabytes);
    mounted_ = ::mount("none", at_.c_str(), "tmpfs", 0, size.c_str()) == 0;
    EXPECT_TRUE(mounted_) << at_ << ": " << std::generic_category().message(errno);
  }
  ~SmallDisk() {
    if (mounted_) ::umount2(at_.c_str(), MNT_DETACH);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;

  /// Until so much is free; then what the disk holds changes quickly.
  void leave_free(std::size_t megabytes) {
    const auto most = std::filesystem::space(at_).available - (megabytes << 20);
    std::ofstream(at_ / "more_ballast", std::ios::binary) << std::string(most, 'x');
  }
  /// Until not a byte is free.
  void fill() {
    const int file = ::open((at_ / "ballast").c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
    ASSERT_GE(file, 0);
    const std::string bytes(1 << 16, 'x');
    while (::write(file, bytes.data(), bytes.size()) > 0) {
    }
    EXPECT_EQ(errno, ENOSPC);
    ::close(file);
  }
  void make_room() { std::filesystem::remove(at_ / "ballast"); }

 private:
  std::filesystem::path at_;
  bool mounted_ = false;
};

/// A folder that nothing can be written into while this lives.
class ReadOnlyFolder {
 public:
  explicit ReadOnlyFolder(const std::filesystem::path& folder) : folder_(folder) {
    const auto done = [&](int status) {
      EXPECT_EQ(status, 0) << folder_ << ": " << std::generic_category().message(errno);
    };
    done(::mount(folder_.c_str(), folder_.c_str(), nullptr, MS_BIND, nullptr));
    done(::mount(nullptr, folder_.c_str(), nullptr, MS_REMOUNT | MS_BIND | MS_RDONLY, nullptr));
  }
  ~ReadOnlyFolder() { EXPECT_EQ(::umount2(folder_.c_str(), MNT_DETACH), 0); }
  ReadOnlyFolder(const ReadOnlyFolder&) = delete;
  ReadOnlyFolder& operator=(const ReadOnlyFolder&) = delete;

 private:
  std::filesystem::path folder_;
};

}  // namespace rig::test
