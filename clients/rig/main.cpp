// rig: the one command an operator needs to know.
#include <cstdio>
#include <functional>
#include <unistd.h>

#include "clients/rig/access_options.h"
#include "clients/rig/commands.h"
#include "clients/rig/dispatch.h"
#include "clients/rig/fetch_frame.h"
#include "clients/rig/metrics.h"
#include "clients/rig/scan_commands.h"
#include "clients/rig/setup_options.h"
#include "clients/rig/watch.h"
#include "core/base/command_line.h"
#include "core/base/interrupt.h"
#include "protocol/client.h"

using namespace rig;
using namespace rig::client;

namespace {

// Runs rig-<name> in place of this process; returns only where there is none.
void run_program(int argc, char** argv) {
  if (argc < 2 || argv[1][0] == '-') return;
  const auto program = find_program(argv[1]);
  if (!program) return;
  ::execv(program->c_str(), argv + 1);
  std::perror(program->c_str());
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Operates a rig, and leads to the programs that turn its scans into materials.");
  app.set_help_all_flag("--help-all", "every command with its options");
  app.require_subcommand(1);
  Connection to{protocol::default_endpoint(), 5};
  std::function<base::Result<void>()> chosen;
  const auto command = [&](CLI::App& parent, const char* name, const char* help) {
    CLI::App* sub = parent.add_subcommand(name, help);
    sub->add_option("--endpoint", to.endpoint, "where rigd listens")->capture_default_str();
    sub->add_option("--wait", to.wait_s, "seconds to wait for rigd, also while it starts")
        ->capture_default_str();
    return sub;
  };

  command(app, "status", "what the rig is doing")->callback([&] { chosen = [&] { return status(to); }; });

  bool as_json = false;
  bool as_prometheus = false;
  auto* metrics_command = command(app, "metrics", "how rigd itself is doing: queues, times, memory, disk");
  auto* json_flag = metrics_command->add_flag("--json", as_json, "as one JSON object");
  metrics_command->add_flag("--prometheus", as_prometheus, "in Prometheus' text format")->excludes(json_flag);
  metrics_command->callback([&] {
    chosen = [&] {
      return metrics(to, as_json         ? MetricsFormat::json
                         : as_prometheus ? MetricsFormat::prometheus
                                         : MetricsFormat::text);
    };
  });

  WatchOptions watching;
  auto* watch_command = command(app, "watch", "follow the running job");
  watch_command->add_flag("--until-idle", watching.until_idle, "end when no job is queued or active");
  watch_command->add_flag("--lines", watching.lines, "lines instead of a whole screen, also on a terminal");
  watch_command->add_option("--preview-width", watching.preview_width, "of the picture, in pixels");
  watch_command->add_option("--preview-every-ms", watching.preview_every_ms,
                            "at most one picture in so much time, where the way to rigd is slow");
  watch_command->callback([&] {
    chosen = [&] {
      watching.endpoint = to.endpoint;
      return watch(watching);
    };
  });

  std::vector<std::string> axes;
  auto* home_command = command(app, "home", "find the zero of axes");
  home_command->add_option("axes", axes, "roll, tilt, pan, arm; none: all");
  home_command->callback([&] { chosen = [&] { return home(to, axes); }; });

  std::map<std::string, double> angles;
  auto* move_command = command(app, "move", "move axes together");
  for (const char* axis : {"roll", "tilt", "pan", "arm"}) {
    move_command->add_option_function<double>(
        fmt::format("--{}", axis), [&angles, axis](double angle) { angles[axis] = angle; }, "degrees");
  }
  move_command->callback([&] { chosen = [&] { return move(to, angles); }; });

  std::string reason;
  auto* stop_command = command(app, "stop", "stop every axis and make the light safe, at once");
  stop_command->add_option("--reason", reason, "for those who find it stopped");
  stop_command->callback([&] { chosen = [&] { return stop(to, reason); }; });
  command(app, "clear", "end a stop; an active job goes on")->callback([&] {
    chosen = [&] { return clear(to); };
  });

  LightChange change;
  auto* light_command = command(app, "light", "switch the light");
  light_command->add_flag_callback(
      "--on", [&] { change.on = true; }, "full level");
  light_command->add_flag_callback(
      "--off", [&] { change.on = false; }, "level 0");
  light_command->add_flag_callback(
      "--open", [&] { change.shutter_open = true; }, "open the shutter");
  light_command->add_flag_callback(
      "--shut", [&] { change.shutter_open = false; }, "close the shutter");
  light_command->add_option("--level", change.level, "0 to 1");
  light_command->callback([&] { chosen = [&] { return light(to, change); }; });

  double exposure_us = 20000;
  std::string out;
  auto* snap_command = command(app, "snap", "take one photograph where the rig stands");
  snap_command->add_option("--exposure-us", exposure_us, "exposure time")->capture_default_str();
  snap_command->add_option("--out", out, ".png: a preview; .tif: the raw samples")->required();
  snap_command->callback([&] { chosen = [&] { return snap(to, exposure_us, out); }; });

  offer_live(app, command, to, chosen);
  offer_axis(app, command, to, chosen);

  auto* job = app.add_subcommand("job", "scan jobs");
  job->require_subcommand(1);
  std::string job_file;
  std::string scan;
  std::uint64_t id = 0;
  auto* submit = command(*job, "submit", "hand a job to rigd");
  submit->add_option("file", job_file, "job.toml")->required();
  submit->add_option("--scan", scan, "folder to scan into; must not exist")->required();
  submit->callback([&] { chosen = [&] { return job_submit(to, job_file, scan); }; });
  command(*job, "list", "every job rigd knows")->callback([&] { chosen = [&] { return job_list(to); }; });
  auto* show = command(*job, "show", "one job");
  show->add_option("job", id, "its number")->required();
  show->callback([&] { chosen = [&] { return job_show(to, id); }; });
  auto* abort = command(*job, "abort", "end a job for good; what was committed stays");
  abort->add_option("job", id, "its number")->required();
  abort->callback([&] { chosen = [&] { return job_abort(to, id); }; });

  auto* check = command(*job, "check", "what a job would take, and whether the rig can do it; nothing moves");
  check->add_option("file", job_file, "job.toml")->required();
  check->add_option("--scan", scan, "folder to scan into: its disk is looked at too");
  check->callback([&] { chosen = [&] { return job_check(to, job_file, scan); }; });
  auto* report = command(*job, "report", "what became of a job, pose by pose, and why");
  report->add_option("job", id, "its number")->required();
  report->callback([&] { chosen = [&] { return job_report(to, id); }; });
  std::uint64_t before = 0;
  const auto add_hold = [&](const char* name, const char* help, const char* fallback) {
    auto* hold = command(*job, name, help);
    hold->add_option("job", id, "its number")->required();
    hold->add_option("--reason", reason, "for those who find it held");
    hold->callback([&, fallback] {
      chosen = [&, fallback] { return job_hold(to, id, reason.empty() ? fallback : reason); };
    });
  };
  add_hold("hold", "let a job wait until it is released; a running one finishes its pose", "");
  add_hold("pause", "hold the running job after the pose in flight", "paused");
  for (const char* name : {"release", "resume"}) {
    auto* release = command(*job, name, "end a hold; also: the sample has been changed");
    release->add_option("job", id, "its number")->required();
    release->callback([&] { chosen = [&] { return job_release(to, id); }; });
  }
  auto* order = command(*job, "move", "change the order of the queue");
  order->add_option("job", id, "its number")->required();
  order->add_option("--before", before, "the number of a queued job; without: to the end");
  order->callback([&] { chosen = [&] { return job_reorder(to, id, before); }; });

  auto* scans = app.add_subcommand("scan", "scans on disk");
  scans->require_subcommand(1);
  auto* verify = scans->add_subcommand("verify", "is a scan complete and undamaged?");
  verify->add_option("scan", scan, "its folder")->required();
  verify->callback([&] { chosen = [&] { return scan_verify(scan); }; });

  offer_control(app, command, to, chosen);
  offer_keys(app, chosen);
  offer_frame(app, command, to, chosen);
  auto* recover = scans->add_subcommand("recover", "rebuild a lost or damaged journal from the frames");
  recover->add_option("scan", scan, "its folder")->required();
  bool even_if_whole = false;
  recover->add_flag("--even-if-whole", even_if_whole, "also where the journal can be read");
  recover->callback([&] { chosen = [&] { return scan_recover(scan, even_if_whole); }; });
  auto* push = scans->add_subcommand("push", "copy committed poses to another place, verified");
  push->add_option("scan", scan, "its folder")->required();
  std::string destination;
  push->add_option("dest", destination, "a new folder, or one of an earlier push of this scan")->required();
  bool follow = false;
  push->add_flag("--follow", follow, "go on until the job is complete");
  push->callback([&] { chosen = [&] { return scan_push(scan, destination, follow); }; });

  std::string further = "Further programs, run as `rig NAME`:";
  for (const std::string& name : programs()) further += " " + name;
  app.footer(further);

  const auto is_builtin = [&](const std::string& name) {
    for (const CLI::App* sub : app.get_subcommands(nullptr)) {
      if (sub->get_name() == name) return true;
    }
    return false;
  };
  if (argc >= 2 && !is_builtin(argv[1])) run_program(argc, argv);
  if (const auto status = base::parse_command_line(app, argc, argv)) return *status;
  base::catch_interrupts();
  const auto done = chosen();
  if (done) return 0;
  std::fprintf(stderr, "rig: %s\n", done.error().text().c_str());
  return done.error().code == base::ErrorCode::interrupted ? 130 : 1;
}
