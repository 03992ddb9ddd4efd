// rigd: the daemon that owns motors, light and camera.
#include <cstdio>

#include "core/base/command_line.h"
#include "core/base/log.h"
#include "daemon/journal_log.h"
#include "daemon/rigd.h"

int main(int argc, char** argv) {
  CLI::App app("The daemon that owns motors, light and camera, and runs scan jobs.");
  rig::daemon::Options options{"/etc/rigd/rig.toml", "/var/lib/rigd", "/run/rigd", 60};
  bool check_only = false;
  bool verbose = false;
  app.add_option("--config", options.config, "the machine's description")->capture_default_str();
  app.add_option("--state", options.state_folder, "what rigd remembers between starts")
      ->capture_default_str();
  app.add_option("--runtime", options.runtime_folder, "where its sockets are")->capture_default_str();
  app.add_option("--statistics-s", options.statistics_s, "seconds between two Stats lines; 0: none")
      ->check(CLI::Range(0.0, 86400.0))
      ->capture_default_str();
  app.add_flag("--check", check_only, "validate the configuration without touching hardware, and end");
  app.add_flag("--verbose", verbose, "log more");
  if (const auto status = rig::base::parse_command_line(app, argc, argv)) return *status;
  rig::daemon::log_to_journal("rigd");
  if (verbose) rig::base::set_log_level(rig::base::LogLevel::debug);
  const auto done = check_only ? rig::daemon::check(options) : rig::daemon::run(options);
  if (!done) {
    std::fprintf(stderr, "rigd: %s\n", done.error().text().c_str());
    return 1;
  }
  if (check_only) std::printf("%s: correct\n", options.config.c_str());
  return 0;
}
