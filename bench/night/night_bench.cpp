// A virtual night: rigd takes N poses with 3 exposures on a rig whose frames of 160 x 120 are painted from a
// hash, beside a bare loop that makes the same frames, hashes, writes and flushes them. They take turns: the
// job is held while the bare loop does as many poses. Then rigd's memory after its first hour of rig time and
// at the end, and what it takes of a processor while it has nothing to do.
#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <string>
#include <thread>
#include <unistd.h>

#include "bench/base/latencies.h"
#include "bench/night/bare_loop.h"
#include "bench/night/process_use.h"
#include "core/base/command_line.h"
#include "core/base/files.h"
#include "tests/soak/night.h"
#include "tests/soak/rig_process.h"
#include "tests/soak/tiny_rig.h"

namespace {

namespace fs = std::filesystem;
using namespace rig;
using bench::Steady;

constexpr double kMostRatio = 6;
constexpr double kMostMemory_MiB = 200;
constexpr double kMostGrowth_MiB = 10;  // from the first hour to the last
constexpr double kMostIdleShare = 0.02;
// Of 6 frames of 160 x 120.
constexpr double kPool_MiB = 6.0 * 160 * 120 * 2 / (1 << 20);

struct Options {
  std::size_t poses = 500;
  std::size_t turns = 10;
  double idle_s = 20;
};

struct Night {
  double rigd_s = 0, bare_s = 0;  // of the wall
  double rig_h = 0;               // of rig time
  double first_MiB = 0, last_MiB = 0, most_MiB = 0;
  double idle_share = 0;  // of one core
};

double seconds_since(Steady::time_point begin) {
  return std::chrono::duration<double>(Steady::now() - begin).count();
}

// 5.4 s a pose in all on this rig: 8000 poses are a night of twelve hours.
constexpr std::array kExposures_s{0.8, 0.4, 0.2};

base::Result<protocol::Reply> ask(soak::RigProcess& rig, const protocol::Request& request) {
  auto reply = rig.ask(request);
  if (!reply) return base::pass(reply);
  if (!*reply) return base::fail(base::ErrorCode::device, "rigd died");
  if ((*reply)->outcome() != protocol::DONE) return base::fail(base::ErrorCode::refused, (*reply)->reason());
  return std::move(**reply);
}

base::Result<soak::RigProcess> start(const fs::path& folder, std::size_t poses) {
  const fs::path shipped = fs::path(RIG_SOURCE_DIR) / "share/virtual/rig.toml";
  auto rig_toml = soak::tiny_rig(shipped, "");
  if (!rig_toml) return base::pass(rig_toml);
  auto job = soak::random_job(shipped, poses, 1, {kExposures_s.begin(), kExposures_s.end()});
  if (!job) return base::pass(job);
  fs::create_directories(folder);
  if (auto ok = base::write_file_durably(folder / "rig.toml", *rig_toml); !ok) return base::pass(ok);
  auto rig = soak::RigProcess::start(fs::read_symlink("/proc/self/exe").parent_path() / "rigd", folder, {});
  if (!rig) return base::pass(rig);
  protocol::Request subscribe;
  subscribe.mutable_subscribe();
  protocol::Request submit;
  submit.mutable_submit_job()->set_job_toml(*job);
  submit.mutable_submit_job()->set_job_name("job.toml");
  submit.mutable_submit_job()->set_scan_folder((folder / "scan").string());
  for (const auto& request : {subscribe, submit}) {
    if (auto reply = ask(*rig, request); !reply) return base::pass(reply);
  }
  return rig;
}

// The next event; a night without any trouble is what is measured.
base::Result<protocol::Event> next_event(soak::RigProcess& rig) {
  auto event = rig.next_event(std::chrono::seconds(60));
  if (!event) return base::pass(event);
  if (!*event) return base::fail(base::ErrorCode::timeout, "no event for a minute");
  if ((*event)->has_stop_latched())
    return base::fail(base::ErrorCode::device, (*event)->stop_latched().reason());
  if ((*event)->has_pose_failed())
    return base::fail(base::ErrorCode::device, (*event)->pose_failed().reason());
  return std::move(**event);
}

// Until nothing of the job is under way.
base::Result<void> hold(soak::RigProcess& rig) {
  protocol::Request hold;
  hold.mutable_hold_job()->set_job(1);
  if (auto reply = ask(rig, hold); !reply) return base::pass(reply);
  protocol::Request show;
  show.mutable_show_job()->set_job(1);
  while (true) {
    auto reply = ask(rig, show);
    if (!reply) return base::pass(reply);
    if (reply->job().resting()) return {};
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

void note_memory(Night& night, const soak::RigProcess& rig, bool first_is_due) {
  const double now_MiB = bench::resident_MiB(rig.pid());
  if (night.first_MiB == 0 && first_is_due) night.first_MiB = now_MiB;
  night.last_MiB = now_MiB;
  night.most_MiB = std::max(night.most_MiB, now_MiB);
}

base::Result<Night> measure(const fs::path& folder, const Options& options) {
  auto rig = start(folder / "night", options.poses);
  if (!rig) return base::pass(rig);
  bench::BareLoop bare(folder / "bare");
  const std::size_t per_turn = std::max<std::size_t>(1, options.poses / options.turns);
  constexpr std::size_t kLookEvery = 50;  // poses
  constexpr double kHour_us = 3600e6;
  Night night;
  std::size_t bare_done = 0;
  std::int64_t first_us = 0;
  auto begin = Steady::now();
  const auto bare_turn = [&](std::size_t poses) -> base::Result<void> {
    night.rigd_s += seconds_since(begin);
    begin = Steady::now();
    if (auto ok = bare.take(poses); !ok) return ok;
    bare_done += poses;
    night.bare_s += seconds_since(begin);
    begin = Steady::now();
    return {};
  };
  for (bool complete = false; !complete;) {
    auto event = next_event(*rig);
    if (!event) return base::pass(event);
    complete = event->has_job_changed() && event->job_changed().job().state() == protocol::COMPLETE;
    if (!event->has_pose_committed()) continue;
    if (first_us == 0) first_us = event->time_us();
    night.rig_h = static_cast<double>(event->time_us() - first_us) / kHour_us;
    const auto done = static_cast<std::size_t>(event->pose_committed().done());
    // A night shorter than an hour is measured from its first tenth.
    if (done % kLookEvery == 0 || done == options.poses)
      note_memory(night, *rig, night.rig_h >= 1 || (done >= options.poses / 10 && options.poses < 1000));
    if (done < bare_done + per_turn || done == options.poses) continue;
    if (auto ok = hold(*rig); !ok) return base::pass(ok);
    if (auto ok = bare_turn(per_turn); !ok) return base::pass(ok);
    protocol::Request release;
    release.mutable_release_job()->set_job(1);
    if (auto reply = ask(*rig, release); !reply) return base::pass(reply);
  }
  if (auto ok = bare_turn(options.poses - bare_done); !ok) return base::pass(ok);

  const double before_s = bench::processor_s(rig->pid());
  begin = Steady::now();
  std::this_thread::sleep_for(std::chrono::duration<double>(options.idle_s));
  night.idle_share = (bench::processor_s(rig->pid()) - before_s) / seconds_since(begin);
  if (const int status = rig->end(SIGTERM); status != 0)
    return base::fail(base::ErrorCode::device, fmt::format("rigd ended with {}", status));
  return night;
}

bool within(const char* what, double value, double most, const char* unit) {
  std::printf("  %-44s %8.2f %-3s (at most %g)%s\n", what, value, unit, most,
              value <= most ? "" : "  TOO MUCH");
  return value <= most;
}

bool tell(const Night& night, const Options& options) {
  std::printf("%zu poses, 3 exposures each, %.2f hours of rig time: rigd %.2f s, bare loop %.2f s\n",
              options.poses, night.rig_h, night.rigd_s, night.bare_s);
  std::printf("rigd's memory: %.1f MiB in the first hour, %.1f MiB at the end\n", night.first_MiB,
              night.last_MiB);
  bool fine = within("rigd over bare loop", night.rigd_s / night.bare_s, kMostRatio, "");
  fine &= within("memory beyond the frame pool, at most", night.most_MiB - kPool_MiB, kMostMemory_MiB, "MiB");
  fine &= within("memory, from the first hour to the end", night.last_MiB - night.first_MiB, kMostGrowth_MiB,
                 "MiB");
  fine &= within("of one core, with nothing to do", 100 * night.idle_share, 100 * kMostIdleShare, "%");
  return fine;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app{"a virtual night beside a bare loop that keeps the same frames"};
  app.add_option("--poses", options.poses, "of the night; 8000 are twelve hours")
      ->check(CLI::Range(20, 100000));
  app.add_option("--turns", options.turns, "that each side takes")->check(CLI::Range(1, 1000));
  app.add_option("--idle-s", options.idle_s, "how long it is watched while it has nothing to do")
      ->check(CLI::Range(1.0, 3600.0));
  if (const auto status = base::parse_command_line(app, argc, argv)) return *status;
  const fs::path folder = fs::current_path() / fmt::format("bench-night-{}", ::getpid());
  const auto night = measure(folder, options);
  std::error_code left_behind;
  fs::remove_all(folder, left_behind);
  if (!night) {
    std::fprintf(stderr, "bench_night: %s\n", night.error().text().c_str());
    return 1;
  }
  return tell(*night, options) ? 0 : 1;
}
