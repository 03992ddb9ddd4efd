// rigd-safe: brings the rig to its safe state when there is no rigd to do it.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <thread>

#include "core/base/command_line.h"
#include "core/base/log.h"
#include "daemon/journal_log.h"
#include "daemon/make_safe.h"
#include "daemon/state_db.h"

namespace {

constexpr int kLockTries = 20;
constexpr std::chrono::milliseconds kLockAgain{50};

struct Options {
  std::string config = "/etc/rigd/rig.toml";
  std::string state_folder = "/var/lib/rigd";
  double within_s = 20;
};

// A rigd that was killed a moment ago may still hold it.
rig::base::Result<rig::base::FolderLock> take_lock(const std::filesystem::path& folder) {
  for (int tries = 1;; ++tries) {
    auto lock = rig::daemon::take_state_folder(folder);
    if (lock || lock.error().code != rig::base::ErrorCode::busy || tries == kLockTries) return lock;
    std::this_thread::sleep_for(kLockAgain);
  }
}

// Whether all of the rig is safe.
bool run(const Options& options) {
  using namespace rig;
  auto rig = machine::load_rig_config(options.config);
  if (!rig) {
    base::log_error("{}", rig.error().text());
    return false;
  }
  const std::filesystem::path state_folder = std::filesystem::absolute(options.state_folder);
  const auto lock = take_lock(state_folder);
  if (!lock) {
    base::log_error("rigd is running and has the devices: {}; `rig stop` stops the rig", lock.error().text());
    return false;
  }
  std::shared_ptr<base::Clock> clock = base::make_system_clock();
  if (rig->clock == machine::ClockKind::discrete_event) clock = base::make_discrete_event_clock(clock->now());
  const auto shared = std::make_shared<const machine::RigConfig>(std::move(*rig));
  const auto within =
      std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::duration<double>(options.within_s));
  bool safe = true;
  for (const daemon::SafePart& part : daemon::make_safe(shared, clock, state_folder, within)) {
    if (part.state) {
      base::log_info("{}: {}", part.name, *part.state);
    } else {
      base::log_error("{}: NOT SAFE: {}", part.name, part.state.error().text());
      safe = false;
    }
  }
  return safe;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Stops every axis and makes the light safe when rigd is not there to do it. Says what became of each; "
      "exit "
      "status 1 if anything is not safe.");
  Options options;
  app.add_option("--config", options.config, "the machine's description")->capture_default_str();
  app.add_option("--state", options.state_folder, "rigd's state folder; it must not be running")
      ->capture_default_str();
  app.add_option("--within-s", options.within_s, "longest time it takes")
      ->check(CLI::Range(0.1, 600.0))
      ->capture_default_str();
  if (const auto status = rig::base::parse_command_line(app, argc, argv)) return *status;
  rig::daemon::log_to_journal("rigd-safe");
  const bool safe = run(options);
  std::fflush(nullptr);
  // A thread that hangs in a driver must not keep the process.
  std::_Exit(safe ? 0 : 1);
}
