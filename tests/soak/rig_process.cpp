#include "tests/soak/rig_process.h"

#include <csignal>
#include <cstdlib>
#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

namespace rig::soak {

namespace fs = std::filesystem;
using base::ErrorCode;
using base::fail;
using base::Result;

namespace {

constexpr std::chrono::milliseconds kLookAfter{200};  // whether the process still lives
constexpr std::chrono::seconds kPatience{60};

int status_of(int raw) {
  return WIFEXITED(raw) ? WEXITSTATUS(raw) : -WTERMSIG(raw);
}

}  // namespace

Result<RigProcess> RigProcess::start(const fs::path& rigd, const fs::path& folder,
                                     const std::string& die_at) {
  std::vector<std::string> arguments{rigd.string(),
                                     "--config",
                                     (folder / "rig.toml").string(),
                                     "--state",
                                     (folder / "state").string(),
                                     "--runtime",
                                     (folder / "run").string()};
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  const std::string log = (folder / "rigd.log").string();
  const pid_t pid = ::fork();
  if (pid < 0) return fail(ErrorCode::io, "cannot start a process", rigd.string());
  if (pid == 0) {
    if (!die_at.empty()) ::setenv("RIG_DIE_AT", die_at.c_str(), 1);
    const int out = ::open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
    if (out < 0 || ::dup2(out, 1) < 0 || ::dup2(out, 2) < 0) ::_exit(126);
    ::execv(argv[0], argv.data());
    ::_exit(127);
  }
  auto client = protocol::Client::connect("ipc://" + (folder / "run/operate.sock").string());
  if (!client) {
    RigProcess orphan(pid, {});
    return base::pass(client);
  }
  return RigProcess(pid, std::move(*client));
}

RigProcess::RigProcess(RigProcess&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)), status_(other.status_), client_(std::move(other.client_)) {}

RigProcess::~RigProcess() {
  if (pid_ > 0) (void)end(SIGKILL);
}

bool RigProcess::ended() {
  if (status_) return true;
  int raw = 0;
  if (::waitpid(pid_, &raw, WNOHANG) != pid_) return false;
  status_ = status_of(raw);
  return true;
}

int RigProcess::end(int signal) {
  client_.reset();
  if (!ended()) {
    ::kill(pid_, signal);
    int raw = 0;
    while (::waitpid(pid_, &raw, 0) != pid_) {
    }
    status_ = status_of(raw);
  }
  pid_ = -1;
  return *status_;
}

Result<std::optional<protocol::Reply>> RigProcess::ask(const protocol::Request& request) {
  // One request a try: an answer to an earlier try is not taken for that of a later one, and every request
  // of the soak may be carried out twice.
  const auto until = std::chrono::steady_clock::now() + kPatience;
  while (std::chrono::steady_clock::now() < until) {
    auto reply = client_->ask(request, 10 * kLookAfter);
    if (reply) return std::optional<protocol::Reply>(std::move(*reply));
    if (reply.error().code != ErrorCode::timeout) return base::pass(reply);
    if (ended()) return std::optional<protocol::Reply>();
  }
  return fail(ErrorCode::timeout, "rigd runs and does not answer", request.ShortDebugString());
}

Result<std::optional<protocol::Event>> RigProcess::next_event(std::chrono::milliseconds patience) {
  return client_->next_event(patience);
}

}  // namespace rig::soak
