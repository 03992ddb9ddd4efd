// A virtual night: rigd takes N poses with 3 exposures on a rig whose frames of 160 x 120 are painted from a
// hash, beside a bare loop that makes the same frames, hashes, writes and flushes them, in the same run.
// Prints the ratio of the times, and rigd's memory after its first hour of rig time and at the end.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <string>
#include <unistd.h>
#include <vector>

#include "core/base/command_line.h"
#include "core/base/files.h"
#include "core/base/hash.h"
#include "sim/hash_painter.h"
#include "tests/soak/night.h"
#include "tests/soak/rig_process.h"
#include "tests/soak/tiny_rig.h"

namespace {

namespace fs = std::filesystem;
using namespace rig;
using Steady = std::chrono::steady_clock;

constexpr int kFrames = 3;
constexpr int kWidth = 160;
constexpr int kHeight = 120;
constexpr std::size_t kRigdSlots = 6;  // of its frame pool
constexpr double kMostRatio = 6;
constexpr double kMostMemory_MiB = 200;

double seconds_since(Steady::time_point begin) {
  return std::chrono::duration<double>(Steady::now() - begin).count();
}

double resident_MiB(pid_t pid) {
  std::ifstream status("/proc/" + std::to_string(pid) + "/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("VmRSS:", 0) == 0) return std::stod(line.substr(6)) / 1024;
  }
  return 0;
}

// The same bytes made, hashed, written and flushed, a folder a pose; no decisions, no journal.
base::Result<double> bare_loop_s(const fs::path& folder, std::size_t poses) {
  sim::CameraWorld camera;
  camera.width = kWidth;
  camera.height = kHeight;
  camera.black_dn = 64;
  camera.saturation_dn = 4095;
  camera.white_fills_s = 0.06;
  std::vector<std::uint16_t> pixels(std::size_t{kWidth} * kHeight);
  std::size_t digits = 0;
  const auto begin = Steady::now();
  for (std::size_t pose = 0; pose < poses; ++pose) {
    const fs::path part = folder / (std::to_string(pose) + ".part");
    fs::create_directories(part);
    for (int i = 0; i < kFrames; ++i) {
      sim::paint_hashed(camera, 0.06, 1, pose * kFrames + static_cast<std::size_t>(i), pixels);
      const auto bytes = std::as_bytes(std::span(pixels));
      digits += base::sha256_hex(bytes).size();
      if (auto ok = base::write_and_flush(part / std::to_string(i), bytes); !ok) return base::pass(ok);
    }
    if (auto ok = base::flush_folder(part); !ok) return base::pass(ok);
    if (auto ok = base::rename_durably(part, folder / std::to_string(pose)); !ok) return base::pass(ok);
  }
  const double took = seconds_since(begin);
  if (digits == 0) return base::fail(base::ErrorCode::damaged, "nothing was hashed");
  return took;
}

struct NightTimes {
  double wall_s = 0, rig_h = 0;
  double first_MiB = 0, last_MiB = 0, most_MiB = 0;
};

base::Result<NightTimes> virtual_night(const fs::path& folder, std::size_t poses) {
  const fs::path shipped = fs::path(RIG_SOURCE_DIR) / "share/virtual/rig.toml";
  auto rig_toml = soak::tiny_rig(shipped, "");
  if (!rig_toml) return base::pass(rig_toml);
  auto job = soak::random_job(shipped, poses, 1);
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
    auto reply = rig->ask(request);
    if (!reply) return base::pass(reply);
    if (!*reply || (*reply)->outcome() != protocol::DONE)
      return base::fail(base::ErrorCode::refused, *reply ? (*reply)->reason() : "rigd died");
  }
  constexpr double kHour_us = 3600e6;
  NightTimes times;
  const auto begin = Steady::now();
  std::int64_t first_us = 0;
  while (true) {
    auto event = rig->next_event(std::chrono::seconds(60));
    if (!event) return base::pass(event);
    if (!*event) return base::fail(base::ErrorCode::timeout, "no event for a minute");
    if ((*event)->has_stop_latched())
      return base::fail(base::ErrorCode::device, (*event)->stop_latched().reason());
    if ((*event)->has_pose_committed()) {
      if (first_us == 0) first_us = (*event)->time_us();
      times.rig_h = static_cast<double>((*event)->time_us() - first_us) / kHour_us;
      // A night shorter than ten hours is measured in tenths.
      const auto done = static_cast<std::size_t>((*event)->pose_committed().done());
      constexpr std::size_t kEvery = 50;
      if (done % kEvery == 0 || done == poses) {
        const double now_MiB = resident_MiB(rig->pid());
        if (times.first_MiB == 0 && (times.rig_h >= 1 || done >= poses / 10)) times.first_MiB = now_MiB;
        times.last_MiB = now_MiB;
        times.most_MiB = std::max(times.most_MiB, now_MiB);
      }
    }
    if ((*event)->has_job_changed() && (*event)->job_changed().job().state() == protocol::COMPLETE) break;
  }
  times.wall_s = seconds_since(begin);
  if (const int status = rig->end(SIGTERM); status != 0)
    return base::fail(base::ErrorCode::device, fmt::format("rigd ended with {}", status));
  return times;
}

base::Result<bool> run(const fs::path& folder, std::size_t poses) {
  auto night = virtual_night(folder / "night", poses);
  if (!night) return base::pass(night);
  auto bare = bare_loop_s(folder / "bare", poses);
  if (!bare) return base::pass(bare);
  const double ratio = night->wall_s / *bare;
  const double pool_MiB =
      static_cast<double>(kRigdSlots * kWidth * kHeight * sizeof(std::uint16_t)) / (1 << 20);
  std::printf("%zu poses, %d exposures each, %.2f hours of rig time\n", poses, kFrames, night->rig_h);
  std::printf("rigd %.2f s, bare loop %.2f s: ratio %.2f (bound %.0f)\n", night->wall_s, *bare, ratio,
              kMostRatio);
  std::printf(
      "rigd's memory: %.1f MiB early, %.1f MiB at the end, %.1f MiB at most, of it %.1f MiB frame pool "
      "(bound %.0f MiB beyond it)\n",
      night->first_MiB, night->last_MiB, night->most_MiB, pool_MiB, kMostMemory_MiB);
  return ratio <= kMostRatio && night->most_MiB - pool_MiB <= kMostMemory_MiB;
}

}  // namespace

int main(int argc, char** argv) {
  std::size_t poses = 500;
  CLI::App app{"a virtual night beside a bare loop that keeps the same frames"};
  app.add_option("--poses", poses, "of the night; 8000 are twelve hours")->check(CLI::Range(20, 100000));
  if (const auto status = base::parse_command_line(app, argc, argv)) return *status;
  const fs::path folder = fs::current_path() / fmt::format("bench-night-{}", ::getpid());
  const auto within = run(folder, poses);
  std::error_code left_behind;
  fs::remove_all(folder, left_behind);
  if (!within) {
    std::fprintf(stderr, "%s\n", within.error().text().c_str());
    return 1;
  }
  return *within ? 0 : 1;
}
