// A program of the project as a process of its own.
#pragma once

#include <chrono>
#include <csignal>
#include <fcntl.h>
#include <filesystem>
#include <gtest/gtest.h>
#include <poll.h>
#include <string>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

namespace rig::test {

inline std::string program_path(const std::string& name) {
  return std::string(RIG_BINARY_DIR) + "/bin/" + name;
}

/// Runs until it ends or is killed; its output goes to a file. Killed with the test if it still runs.
class Program {
 public:
  Program(const std::string& name, std::vector<std::string> arguments, const std::filesystem::path& output) {
    arguments.insert(arguments.begin(), program_path(name));
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    pid_ = ::fork();
    if (pid_ == 0) {
      const int out = ::open(output.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
      if (out < 0 || ::dup2(out, 1) < 0 || ::dup2(out, 2) < 0) ::_exit(126);
      ::execv(argv[0], argv.data());
      ::_exit(127);
    }
    EXPECT_GT(pid_, 0);
  }
  ~Program() {
    if (pid_ > 0) signal(SIGKILL);
  }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  /// Sends the signal and waits for the end. The exit status, or minus the signal that ended it.
  int signal(int number) {
    EXPECT_EQ(::kill(pid_, number), 0);
    return wait();
  }
  [[nodiscard]] pid_t pid() const { return pid_; }
  /// Whether it ends within this time.
  [[nodiscard]] bool ends_within(std::chrono::milliseconds most) const {
    const int process = static_cast<int>(::syscall(SYS_pidfd_open, pid_, 0));
    EXPECT_GE(process, 0);
    pollfd ended{process, POLLIN, 0};
    const bool has_ended = ::poll(&ended, 1, static_cast<int>(most.count())) == 1;
    ::close(process);
    return has_ended;
  }
  int wait() {
    int status = 0;
    EXPECT_EQ(::waitpid(pid_, &status, 0), pid_);
    pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }

 private:
  pid_t pid_ = -1;
};

/// Runs a program to its end; its exit status.
inline int run_program(const std::string& name, const std::vector<std::string>& arguments,
                       const std::filesystem::path& output) {
  return Program(name, arguments, output).wait();
}

}  // namespace rig::test
