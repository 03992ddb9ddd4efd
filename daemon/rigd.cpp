#include "daemon/rigd.h"

#include <csignal>
#include <fcntl.h>
#include <sys/file.h>
#include <thread>
#include <unistd.h>

#include "core/base/files.h"
#include "core/base/log.h"
#include "daemon/loop.h"

namespace rig::daemon {

namespace fs = std::filesystem;
using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;

namespace {

constexpr const char* kVersion = "0.1.0";
constexpr std::size_t kFrameSlots = 6;

// One rigd a state folder: the lock goes with the process.
class FolderLock {
 public:
  static Result<FolderLock> take(const fs::path& folder) {
    std::error_code error;
    fs::create_directories(folder, error);
    if (error)
      return fail(ErrorCode::io, fmt::format("cannot make the folder: {}", error.message()), folder.string());
    const int fd = ::open((folder / "lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (fd < 0) return fail(ErrorCode::io, "cannot make the lock file", folder.string());
    FolderLock lock(fd);
    if (::flock(fd, LOCK_EX | LOCK_NB) != 0) {
      return fail(ErrorCode::busy, "another rigd uses this state folder", folder.string(),
                  "stop it, or choose another --state");
    }
    return lock;
  }
  FolderLock(FolderLock&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  FolderLock& operator=(FolderLock&&) = delete;
  ~FolderLock() {
    if (fd_ >= 0) ::close(fd_);
  }

 private:
  explicit FolderLock(int fd) : fd_(fd) {}
  int fd_;
};

// Turns the first SIGINT or SIGTERM into EndRequested. The signals are blocked in every thread and waited for
// in one.
class SignalThread {
 public:
  static void block() {
    const sigset_t set = signals();
    ::pthread_sigmask(SIG_BLOCK, &set, nullptr);
    // A limit on the size of files is an error of the write, as a full disk is, not the end of rigd.
    ::signal(SIGXFSZ, SIG_IGN);
  }
  explicit SignalThread(Loop& loop)
      : thread_([&loop] {
          const sigset_t set = signals();
          int signal = 0;
          ::sigwait(&set, &signal);
          loop.post(EndRequested{});
        }) {}
  SignalThread(const SignalThread&) = delete;
  SignalThread& operator=(const SignalThread&) = delete;
  ~SignalThread() {
    ::pthread_kill(thread_.native_handle(), SIGTERM);  // where the loop ended by itself
    thread_.join();
  }

 private:
  static sigset_t signals() {
    sigset_t set;
    sigemptyset(&set);
    sigaddset(&set, SIGINT);
    sigaddset(&set, SIGTERM);
    return set;
  }
  std::thread thread_;
};

Result<State> remembered_state(StateDb& db) {
  State state;
  auto epoch = db.begin_epoch();
  if (!epoch) return pass(epoch);
  auto jobs = db.jobs();
  if (!jobs) return pass(jobs);
  auto stopped = db.stopped();
  if (!stopped) return pass(stopped);
  state.epoch = *epoch;
  state.jobs = std::move(*jobs);
  state.stopped = std::move(*stopped);
  return state;
}

}  // namespace

Result<void> check(const Options& options) {
  auto rig = machine::load_rig_config(options.config);
  if (!rig) return pass(rig);
  return check_modules(*rig);
}

Result<void> run(const Options& options) {
  const fs::path state_folder = fs::absolute(options.state_folder);
  auto rig_toml = base::read_file(options.config);
  if (!rig_toml) return pass(rig_toml);
  auto rig = machine::parse_rig_config(*rig_toml, options.config);
  if (!rig) return pass(rig);
  auto lock = FolderLock::take(state_folder);
  if (!lock) return pass(lock);
  SignalThread::block();

  auto clock = base::make_system_clock();
  if (rig->clock == machine::ClockKind::discrete_event) clock = base::make_discrete_event_clock(clock->now());
  // The loop's own membership: no virtual time passes before it waits.
  const base::ClockMember member(*clock);

  auto devices = open_devices(*rig, *clock, state_folder);
  if (!devices) return pass(devices);
  auto db = StateDb::open(state_folder);
  if (!db) return pass(db);
  auto state = remembered_state(*db);
  if (!state) return pass(state);
  Setup setup{std::move(*rig), (*devices)->camera->capabilities(), (*devices)->light->capabilities(),
              kVersion};
  const std::string name = setup.rig.name;
  const machine::CameraConfig camera = setup.rig.camera;
  FramePool pool(kFrameSlots, static_cast<std::size_t>(camera.intrinsics.width) *
                                  static_cast<std::size_t>(camera.intrinsics.height));
  Loop loop(*clock, std::move(setup), std::move(*state), **devices, pool);
  auto server =
      protocol::Server::start({fs::absolute(options.runtime_folder)}, [&loop](protocol::Incoming in) {
        loop.post(RequestReceived{std::move(in.client), in.role, std::move(in.request)});
      });
  if (!server) return pass(server);
  {
    Storage storage(
        *clock, camera, std::move(*rig_toml), std::move(*db), pool,
        [&loop](What what) { loop.post(std::move(what)); },
        [&server](const Action& answer) {
          const auto& reply = std::get<SendReply>(answer);
          (*server)->reply(reply.client, reply.reply);
        });
    loop.attach(storage, **server);
    const SignalThread signals(loop);
    base::log_info("{}: ready at {}", name, fs::absolute(options.runtime_folder).string());
    loop.run();
    base::log_info("{}: ending; an active job goes on at the next start", name);
    // Stops still queued at the buses are carried out before their workers end.
    (*devices)->finish();
  }
  return {};
}

}  // namespace rig::daemon
