#include <cerrno>
#include <csignal>
#include <cstring>
#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "core/base/files.h"
#include "drivers/conformance/module_under_test.h"
#include "drivers/conformance/waiting.h"

namespace rig::drivers::conformance {

using base::ErrorCode;
using base::fail;
using base::pass;
using Steady = std::chrono::steady_clock;

namespace {

// Homing, a move and an opening.
constexpr base::Duration kUnderWayWithin = std::chrono::seconds(90);
constexpr const char* kProgram = "conformance_victim";

// The process, and the reading end of its standard output.
class Process final : public Victim {
 public:
  Process(pid_t pid, int output) : pid_(pid), output_(output) {}
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;
  ~Process() override {
    kill();
    ::close(output_);
  }

  void kill() override {
    if (pid_ <= 0) return;
    ::kill(pid_, SIGKILL);
    while (::waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) continue;
    pid_ = 0;
  }

  /// What it says in one line; shorter where it ended.
  Result<std::string> line_within(base::Duration within) {
    const auto end = Steady::now() + std::chrono::duration_cast<Steady::duration>(within);
    std::string line;
    while (true) {
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Steady::now()).count();
      if (left <= 0) return fail(ErrorCode::timeout, "it is not under way in time", kProgram);
      pollfd wait{output_, POLLIN, 0};
      if (::poll(&wait, 1, static_cast<int>(left)) < 0 && errno != EINTR) break;
      if (wait.revents == 0) continue;
      char c = 0;
      const ssize_t got = ::read(output_, &c, 1);
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0 || c == '\n') return line;
      line += c;
    }
    return fail(ErrorCode::io, std::strerror(errno), kProgram);
  }

 private:
  pid_t pid_;
  const int output_;
};

}  // namespace

Result<std::unique_ptr<Victim>> start_victim(const ModuleUnderTest& module, const Task& task) {
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error).parent_path() / kProgram;
  const auto settings = module.state_folder / "victim.toml";
  if (auto kept = base::write_file_durably(settings, std::string_view(module.settings)); !kept)
    return pass(kept);
  std::vector<std::string> words{program.string(), module.file, settings.string(),
                                 module.state_folder.string()};
  for (std::string& word : words_of(task)) words.push_back(std::move(word));
  std::vector<char*> arguments;
  arguments.reserve(words.size() + 1);
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);

  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) return fail(ErrorCode::io, std::strerror(errno), "pipe");
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
  pid_t pid = 0;
  const int failed = ::posix_spawn(&pid, program.c_str(), &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  ::close(ends[1]);
  if (failed != 0) {
    ::close(ends[0]);
    return fail(ErrorCode::io, std::strerror(failed), program.string(), "is it built?");
  }
  auto process = std::make_unique<Process>(pid, ends[0]);
  const auto said = process->line_within(patient(kUnderWayWithin));
  if (!said) return pass(said);
  if (*said != "under way")
    return fail(ErrorCode::device, said->empty() ? "it ended without a word" : *said, kProgram);
  return process;
}

}  // namespace rig::drivers::conformance
