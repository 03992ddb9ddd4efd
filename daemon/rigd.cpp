#include "daemon/rigd.h"

#include <algorithm>
#include <csignal>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <thread>

#include "core/base/files.h"
#include "core/base/log.h"
#include "core/scan/scan_directory.h"
#include "daemon/access.h"
#include "daemon/job.h"
#include "daemon/loop.h"
#include "daemon/notifier.h"
#include "daemon/service_manager.h"
#include "daemon/state_db.h"
#include "daemon/wall_timer.h"
#include "daemon/watchdog.h"

namespace rig::daemon {

namespace fs = std::filesystem;
using base::pass;
using base::Result;

namespace {

constexpr const char* kVersion = "0.1.0";
constexpr std::size_t kFrameSlots = 6;

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
    // Where the loop ended by itself. The thread waits for the signal; none is ended by it.
    ::pthread_kill(thread_.native_handle(), SIGTERM);  // NOLINT(bugprone-bad-signal-to-kill-thread)
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

// Everything that must be alive for rigd to be.
std::vector<WatchedPart> watched_parts(Loop& loop, const OpenDevices& devices, Storage& storage) {
  std::vector<WatchedPart> parts{
      {"the loop", [&loop](std::function<void()> answer) { loop.post(Heartbeat{std::move(answer)}); }},
      {"the storage",
       [&storage](std::function<void()> answer) { storage.queue(AskStorage{std::move(answer)}); }}};
  for (const auto& [bus, worker] : devices.workers) {
    parts.push_back(
        {"bus " + bus, [w = worker.get()](std::function<void()> answer) { w->queue(std::move(answer)); }});
  }
  return parts;
}

Result<State> remembered_state(StateDb& db) {
  State state;
  auto epoch = db.begin_epoch();
  if (!epoch) return pass(epoch);
  auto jobs = db.jobs();
  if (!jobs) return pass(jobs);
  auto stopped = db.stopped();
  if (!stopped) return pass(stopped);
  auto holder = db.lease_holder();
  if (!holder) return pass(holder);
  state.epoch = *epoch;
  state.jobs = std::move(*jobs);
  state.stopped = std::move(*stopped);
  state.lease.holder = std::move(*holder);
  return state;
}

// Of jobs whose end was saved by a rigd that ended before it had written and told how they went.
Result<std::vector<TellOfJob>> reports_due(const StateDb& db, const State& state) {
  const auto due = db.reports_due();
  if (!due) return pass(due);
  std::vector<TellOfJob> reports;
  for (const JobEntry& job : state.jobs) {
    if (std::find(due->begin(), due->end(), job.id) != due->end())
      reports.push_back(report_of_ended(state, job));
  }
  return reports;
}

constexpr std::size_t kRememberedEvents = 20000;
constexpr std::size_t kRememberedScans = 3;

// The last events of earlier epochs: those of poses from the journals of the latest scans, the rest from
// rigd's own state. What cannot be read is missed by late joiners alone.
std::deque<protocol::Event> remembered_events(StateDb& db, const std::vector<JobEntry>& jobs) {
  std::map<std::pair<std::uint64_t, std::uint64_t>, protocol::Event> sorted;
  const auto take = [&sorted](const Result<std::vector<scan::EventRecord>>& records) {
    if (!records) return base::log_warning("earlier events: {}", records.error().text());
    for (const scan::EventRecord& record : *records) {
      protocol::Event event;
      if (event.ParseFromString(record.payload)) sorted[{record.epoch, record.number}] = std::move(event);
    }
  };
  take(db.last_events(kRememberedEvents));
  std::vector<const JobEntry*> latest;
  for (const JobEntry& job : jobs) {
    if (job.state != JobEntry::State::queued) latest.push_back(&job);
  }
  std::sort(latest.begin(), latest.end(), [](const auto* a, const auto* b) { return a->id > b->id; });
  if (latest.size() > kRememberedScans) latest.resize(kRememberedScans);
  for (const JobEntry* job : latest) {
    std::error_code error;
    const auto path = scan::journal_path(job->scan_folder);
    if (!fs::exists(path, error)) continue;
    auto journal = scan::Journal::open_read_only(path);
    if (!journal) {
      base::log_warning("earlier events: {}", journal.error().text());
      continue;
    }
    take(journal->events_after(0, 0, kRememberedEvents));
  }
  std::deque<protocol::Event> events;
  for (auto& [key, event] : sorted) events.push_back(std::move(event));
  while (events.size() > kRememberedEvents) events.pop_front();
  return events;
}

}  // namespace

Result<void> check(const Options& options) {
  auto rig = machine::load_rig_config(options.config);
  if (!rig) return pass(rig);
  if (auto ok = check_access(server_options(options, rig->access)); !ok) return ok;
  return check_modules(*rig);
}

Result<void> run(const Options& options) {
  const fs::path state_folder = fs::absolute(options.state_folder);
  auto rig_toml = base::read_file(options.config);
  if (!rig_toml) return pass(rig_toml);
  auto rig = machine::parse_rig_config(*rig_toml, options.config);
  if (!rig) return pass(rig);
  auto lock = take_state_folder(state_folder);
  if (!lock) return pass(lock);
  SignalThread::block();

  auto clock = base::make_system_clock();
  if (rig->clock == machine::ClockKind::discrete_event) clock = base::make_discrete_event_clock(clock->now());
  // The loop's own membership: no virtual time passes before it waits.
  std::optional<base::ClockMember> member(std::in_place, *clock);

  auto devices = open_devices(*rig, *clock, state_folder);
  if (!devices) return pass(devices);
  auto db = StateDb::open(state_folder);
  if (!db) return pass(db);
  auto state = remembered_state(*db);
  if (!state) return pass(state);
  Setup setup{std::move(*rig), (*devices)->camera->capabilities(), (*devices)->light->capabilities(),
              kVersion};
  setup.state_folder = state_folder;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    setup.homing_velocity_rad_s[i] = (*devices)->axes[i]->capabilities().homing_velocity_rad_s;
  }
  const std::string name = setup.rig.name;
  protocol::ServerOptions listening = server_options(options, setup.rig.access);
  Notifier notifier(setup.rig.unattended.notify);
  const machine::RigConfig rig_config = setup.rig;
  const machine::CameraConfig& camera = rig_config.camera;
  auto earlier = remembered_events(*db, state->jobs);
  auto due = reports_due(*db, *state);
  if (!due) return pass(due);
  auto pool = FramePool::make(kFrameSlots, static_cast<std::size_t>(camera.intrinsics.width) *
                                               static_cast<std::size_t>(camera.intrinsics.height));
  if (!pool) return pass(pool);
  Loop loop(*clock, std::move(setup), std::move(*state), **devices, **pool);
  listening.revoked = [&loop](std::string who) { loop.post(ClientRevoked{std::move(who)}); };
  auto server = protocol::Server::start(listening, [&loop](protocol::Incoming in) {
    loop.post(RequestReceived{std::move(in.client), in.role, std::move(in.request), std::move(in.who)});
  });
  if (!server) return pass(server);
  auto frames = protocol::FrameDoor::open(fs::absolute(options.runtime_folder), listening.observe_group);
  if (!frames) return pass(frames);
  {
    Storage storage(
        *clock, rig_config, std::move(*rig_toml), std::move(*db), **pool,
        [&loop](What what) { loop.post(std::move(what)); },
        [&server](const Action& answer) {
          const auto& reply = std::get<SendReply>(answer);
          (*server)->reply(reply.client, reply.reply);
        },
        [&notifier](std::string occasion, std::string report, std::function<void()> told) {
          notifier.tell(std::move(occasion), std::move(report), std::move(told));
        });
    for (TellOfJob& report : *due) {
      base::log_info("job {}: rigd ended before its report was told of; now it is", report.job.job());
      storage.queue(std::move(report));
    }
    loop.remember(std::move(earlier));
    loop.attach(storage, **server, **frames);
    const SignalThread signals(loop);
    if (!(*server)->network_endpoint().empty())
      base::log_info("{}: listens on the network at {}", name, (*server)->network_endpoint());
    base::log_info("{}: ready at {}", name, fs::absolute(options.runtime_folder).string());
    {
      std::optional<Watchdog> watchdog;
      if (const auto period = watchdog_period())
        watchdog.emplace(watched_parts(loop, **devices, storage), *period, &notify_alive);
      std::optional<WallTimer> statistics;
      if (options.statistics_s > 0)
        statistics.emplace(std::chrono::duration<double>(options.statistics_s),
                           [&loop] { loop.post(StatisticsDue{}); });
      notify_ready();
      loop.run();
    }
    notify_stopping();
    base::log_info("{}: ending; an active job goes on at the next start", name);
    // A device that takes its time needs the clock to go on while it is waited for.
    member.reset();
    // Stops still queued at the buses are carried out before their workers end.
    (*devices)->finish();
    // What is told of now is noted by the storage.
    storage.settle();
    notifier.finish();
  }
  return {};
}

}  // namespace rig::daemon
