#include "sim/wire/gv_camera_process.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>
#include <utility>

extern char** environ;

namespace rig::sim::wire {

base::Result<GvCameraProcess> GvCameraProcess::start(const std::filesystem::path& program,
                                                     const std::vector<std::string>& arguments) {
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    return base::fail(base::ErrorCode::io, std::strerror(errno), program.string());
  }
  std::vector<std::string> words{program.string()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_adddup2(&actions, ends[1], STDIN_FILENO);
  ::posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
  pid_t pid = 0;
  const int error = ::posix_spawn(&pid, program.c_str(), &actions, nullptr, argv.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  ::close(ends[1]);
  if (error != 0) {
    ::close(ends[0]);
    return base::fail(base::ErrorCode::io, std::strerror(error), program.string());
  }
  GvCameraProcess process(pid, ends[0]);
  if (process.read_line() != "ready") {
    return base::fail(base::ErrorCode::io, "it does not start", program.string());
  }
  return process;
}

GvCameraProcess::GvCameraProcess(GvCameraProcess&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)), line_(std::exchange(other.line_, -1)) {}

GvCameraProcess::~GvCameraProcess() {
  if (pid_ < 0) return;
  ::close(line_);  // it ends with its input
  int status = 0;
  (void)::waitpid(pid_, &status, 0);
}

bool GvCameraProcess::command(const std::string& line) {
  const std::string whole = line + "\n";
  if (::send(line_, whole.data(), whole.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(whole.size()))
    return false;
  return read_line() == "ok";
}

std::string GvCameraProcess::read_line() {
  std::string line;
  char c = 0;
  while (::read(line_, &c, 1) == 1 && c != '\n') line += c;
  return line;
}

}  // namespace rig::sim::wire
