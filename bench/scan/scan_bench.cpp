// How long a scan takes: the isotropic plan of 10 degrees on the virtual rig, in rig time, beside the bound
// that no scheduling can beat: each pose's exposures, a readout between two of them, and after the last the
// longer of its readout and the way to the next pose with settling. The disk takes no rig time here.
#include <algorithm>
#include <cstdio>
#include <string>
#include <unistd.h>
#include <vector>

#include "clients/plan/plan.h"
#include "core/base/command_line.h"
#include "core/base/units.h"
#include "core/machine/motion.h"
#include "tests/soak/rig_process.h"
#include "tests/soak/tiny_rig.h"

namespace {

namespace fs = std::filesystem;
using namespace rig;
using base::radians;

constexpr double kReadout_s = 0.5;  // of the shipped rig's camera
constexpr double kMostRatio = 1.10;

struct Taken {
  std::vector<double> exposures_s;
  double started_s = 0, arrived_s = 0, committed_s = 0;
};

double seconds_of(const protocol::Event& event) {
  return 1e-6 * static_cast<double>(event.time_us());
}

base::Result<plan::Plan> make_plan(const machine::RigConfig& rig, double apart_deg,
                                   const machine::ExposureConfig& exposure) {
  plan::PlanRequest request;
  request.choice = {radians(apart_deg), radians(1), radians(75), radians(65)};
  request.name = "bench";
  request.sample = "chart";
  request.exposure = exposure;
  return plan::make_plan(rig, request);
}

// What became of each pose, in the order of the job.
base::Result<std::vector<Taken>> scan(const fs::path& folder, const std::string& rig_toml,
                                      const machine::JobConfig& job) {
  fs::create_directories(folder);
  if (auto ok = base::write_file_durably(folder / "rig.toml", rig_toml); !ok) return base::pass(ok);
  auto rig = soak::RigProcess::start(fs::read_symlink("/proc/self/exe").parent_path() / "rigd", folder, {});
  if (!rig) return base::pass(rig);
  protocol::Request subscribe;
  subscribe.mutable_subscribe();
  protocol::Request submit;
  submit.mutable_submit_job()->set_job_toml(machine::format_job_config(job, ""));
  submit.mutable_submit_job()->set_job_name("job.toml");
  submit.mutable_submit_job()->set_scan_folder((folder / "scan").string());
  for (const auto& request : {subscribe, submit}) {
    auto reply = rig->ask(request);
    if (!reply) return base::pass(reply);
    if (!*reply || (*reply)->outcome() != protocol::DONE)
      return base::fail(base::ErrorCode::refused, *reply ? (*reply)->reason() : "rigd died");
  }
  std::vector<Taken> taken(job.poses.size());
  while (true) {
    auto next = rig->next_event(std::chrono::seconds(60));
    if (!next) return base::pass(next);
    if (!*next) return base::fail(base::ErrorCode::timeout, "no event for a minute");
    const protocol::Event& event = **next;
    const auto at = [&taken](std::int64_t row) -> Taken& { return taken.at(static_cast<std::size_t>(row)); };
    if (event.has_pose_started()) at(event.pose_started().row()).started_s = seconds_of(event);
    if (event.has_pose_arrived()) at(event.pose_arrived().row()).arrived_s = seconds_of(event);
    if (event.has_pose_committed()) at(event.pose_committed().row()).committed_s = seconds_of(event);
    if (event.has_frame_taken())
      at(event.frame_taken().row()).exposures_s.push_back(1e-6 * event.frame_taken().exposure_us());
    if (event.has_pose_failed())
      return base::fail(base::ErrorCode::device, "a pose failed: " + event.pose_failed().reason());
    if (event.has_job_changed() && event.job_changed().job().state() == protocol::COMPLETE) return taken;
  }
}

double bracket_s(const Taken& pose) {
  double s = kReadout_s * static_cast<double>(pose.exposures_s.size() - 1);
  for (const double exposure_s : pose.exposures_s) s += exposure_s;
  return s;
}

base::Result<bool> measure(const char* name, const fs::path& folder, double apart_deg,
                           const machine::ExposureConfig& exposure) {
  auto rig_toml = soak::tiny_rig(fs::path(RIG_SOURCE_DIR) / "share/virtual/rig.toml", "");
  if (!rig_toml) return base::pass(rig_toml);
  const auto rig = machine::parse_rig_config(*rig_toml, "rig.toml");
  if (!rig) return base::pass(rig);
  const auto plan = make_plan(*rig, apart_deg, exposure);
  if (!plan) return base::pass(plan);
  const auto& poses = plan->job.poses;
  const auto taken = scan(folder / name, *rig_toml, plan->job);
  if (!taken) return base::pass(taken);

  machine::JointAngles from{};
  for (std::size_t i = 0; i < machine::kAxisCount; ++i) from[i] = rig->axes[i].home_rad;
  double bound_s = machine::pose_change_time_s(*rig, from, poses.front());
  double worst = 0;
  std::size_t frames = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Taken& pose = (*taken)[i];
    frames += pose.exposures_s.size();
    const bool last = i + 1 == poses.size();
    const double after_s =
        last ? kReadout_s : std::max(kReadout_s, machine::pose_change_time_s(*rig, poses[i], poses[i + 1]));
    const double pose_s = bracket_s(pose) + after_s;
    const double took_s = (last ? pose.committed_s : (*taken)[i + 1].arrived_s) - pose.arrived_s;
    worst = std::max(worst, took_s / pose_s);
    bound_s += pose_s;
  }
  const double took_s = taken->back().committed_s - taken->front().started_s;
  const double ratio = took_s / bound_s;
  std::printf(
      "%-10s %zu poses, %zu frames: %.1f s of rig time, bound %.1f s, ratio %.4f (at most %.2f); "
      "worst pose %.4f\n",
      name, poses.size(), frames, took_s, bound_s, ratio, kMostRatio, worst);
  std::fflush(stdout);
  return ratio <= kMostRatio;
}

base::Result<bool> run(const fs::path& folder, double apart_deg) {
  machine::ExposureConfig fixed;
  fixed.exposures_s = {0.16, 0.02, 0.0025};
  machine::ExposureConfig predicted;
  predicted.strategy = machine::ExposureStrategy::predicted;
  predicted.lightest_s = {0.008, 0.0005};
  predicted.darkest_s = {0.5, 0.008};
  predicted.lightest_rad = 0;
  predicted.darkest_rad = radians(90);
  auto first = measure("fixed", folder, apart_deg, fixed);
  if (!first) return first;
  auto second = measure("predicted", folder, apart_deg, predicted);
  if (!second) return second;
  return *first && *second;
}

}  // namespace

int main(int argc, char** argv) {
  double apart_deg = 10;
  CLI::App app{"how long a scan takes, beside the bound that no scheduling can beat"};
  app.add_option("--angle-deg", apart_deg, "between poses of the plan")->check(CLI::Range(2.0, 90.0));
  if (const auto status = base::parse_command_line(app, argc, argv)) return *status;
  const fs::path folder = fs::current_path() / fmt::format("bench-scan-{}", ::getpid());
  const auto within = run(folder, apart_deg);
  std::error_code left_behind;
  fs::remove_all(folder, left_behind);
  if (!within) {
    std::fprintf(stderr, "bench_scan: %s\n", within.error().text().c_str());
    return 1;
  }
  return *within ? 0 : 1;
}
