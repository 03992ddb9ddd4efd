#include "daemon/notifier.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

#include "core/base/log.h"
#include "core/base/thread.h"

namespace rig::daemon {

using base::ErrorCode;
using base::fail;
using base::Result;

namespace {

constexpr auto kLookAgain = std::chrono::milliseconds(10);
constexpr std::size_t kMostQueued = 100;

// The text as a file without a name: a program that reads nothing of it keeps nobody waiting.
Result<int> input_with(const std::string& text) {
  const int fd = ::memfd_create("report", MFD_CLOEXEC);
  if (fd < 0) return fail(ErrorCode::io, fmt::format("no memory for the report: {}", std::strerror(errno)));
  std::size_t written = 0;
  while (written < text.size()) {
    const ssize_t n = ::write(fd, text.data() + written, text.size() - written);
    if (n <= 0) {
      ::close(fd);
      return fail(ErrorCode::io, "no memory for the report");
    }
    written += static_cast<std::size_t>(n);
  }
  ::lseek(fd, 0, SEEK_SET);
  return fd;
}

// A group of its own, so that it can be ended with all that it started; no signal of rigd's is blocked in it.
Result<pid_t> spawn(const std::vector<std::string>& command, int input) {
  std::vector<char*> argv;
  argv.reserve(command.size() + 1);
  for (const std::string& argument : command) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  posix_spawnattr_t attributes;
  posix_spawn_file_actions_t files;
  ::posix_spawnattr_init(&attributes);
  ::posix_spawn_file_actions_init(&files);
  sigset_t none;
  sigemptyset(&none);
  ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK);
  ::posix_spawnattr_setsigmask(&attributes, &none);
  ::posix_spawn_file_actions_adddup2(&files, input, STDIN_FILENO);
  pid_t child = -1;
  const int error = ::posix_spawn(&child, argv[0], &files, &attributes, argv.data(), environ);
  ::posix_spawn_file_actions_destroy(&files);
  ::posix_spawnattr_destroy(&attributes);
  if (error != 0) return fail(ErrorCode::io, fmt::format("cannot be started: {}", std::strerror(error)));
  return child;
}

}  // namespace

Result<void> run_notify(const machine::NotifyConfig& notify, const std::string& occasion,
                        const std::string& text) {
  const auto input = input_with(text);
  if (!input) return base::pass(input);
  std::vector<std::string> command = notify.command;
  command.push_back(occasion);
  const auto child = spawn(command, *input);
  ::close(*input);
  const std::string& program = notify.command.front();
  if (!child) return fail(child.error().code, child.error().what, program, "see [notify] in rig.toml");
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(notify.timeout_s);
  int status = 0;
  while (::waitpid(*child, &status, WNOHANG) == 0) {
    if (std::chrono::steady_clock::now() >= end) {
      ::kill(-*child, SIGKILL);
      ::waitpid(*child, &status, 0);
      return fail(ErrorCode::timeout, fmt::format("was not done in {} s and was killed", notify.timeout_s),
                  program);
    }
    std::this_thread::sleep_for(kLookAgain);
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return {};
  return fail(ErrorCode::io,
              WIFEXITED(status) ? fmt::format("ended with status {}", WEXITSTATUS(status))
                                : fmt::format("was ended by signal {}", WTERMSIG(status)),
              program);
}

Notifier::Notifier(machine::NotifyConfig notify) : notify_(std::move(notify)) {
  if (notify_.command.empty()) return;
  thread_ = std::thread([this] {
    base::name_thread("notifier");
    run();
  });
}

Notifier::~Notifier() {
  finish();
}

void Notifier::finish() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void Notifier::tell(std::string occasion, std::string text, std::function<void()> told) {
  if (notify_.command.empty()) {
    if (told) told();
    return;
  }
  {
    const std::lock_guard lock(mutex_);
    if (queue_.size() >= kMostQueued) {
      base::log_error("notify: too much to tell; '{}' is left out", occasion);
      return;
    }
    queue_.push_back({std::move(occasion), std::move(text), std::move(told)});
  }
  changed_.notify_one();
}

void Notifier::run() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return ending_ || !queue_.empty(); });
    if (queue_.empty()) return;
    const Message message = std::move(queue_.front());
    queue_.pop_front();
    lock.unlock();
    if (auto ok = run_notify(notify_, message.occasion, message.text); !ok) {
      base::log_error("notify: {}", ok.error().text());
    }
    if (message.told) message.told();
    lock.lock();
  }
}

}  // namespace rig::daemon
