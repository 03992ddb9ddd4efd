#include "clients/plan/plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <utility>

#include "core/base/files.h"
#include "core/base/progress.h"
#include "core/base/units.h"
#include "core/machine/kinematics.h"
#include "core/machine/pose_order.h"

namespace rig::plan {

using machine::AxisId;
using machine::JointAngles;

namespace {

bool sees_whole_sample(const machine::RigConfig& rig, const JointAngles& angles) {
  const auto outline = machine::sample_outline(rig, angles);
  if (!outline) return false;
  const auto& camera = rig.camera.intrinsics;
  return std::all_of(outline->begin(), outline->end(), [&camera](geometry::Vec2 p) {
    return p.x >= -0.5 && p.y >= -0.5 && p.x <= camera.width - 0.5 && p.y <= camera.height - 0.5;
  });
}

// One line: how many values fall into each ten degrees.
std::string histogram(const char* title, const std::vector<IsotropicPair>& pairs,
                      double (IsotropicPair::*angle_rad)() const) {
  constexpr std::size_t kBins = 9;
  constexpr double kWidth_deg = 10;
  std::array<int, kBins> counts{};
  for (const IsotropicPair& pair : pairs) {
    const auto bin = static_cast<std::size_t>(base::degrees((pair.*angle_rad)()) / kWidth_deg);
    ++counts[std::min(bin, kBins - 1)];
  }
  std::string out = fmt::format("{:8}", title);
  for (const int n : counts) out += fmt::format("{:7}", n);
  return out + "\n";
}

}  // namespace

base::Result<Plan> make_plan(const machine::RigConfig& rig, const PlanRequest& request) {
  // What is written must be what rigd reads: a bad exposure is refused before the long work.
  machine::JobConfig job;
  job.name = request.name;
  job.sample = request.sample;
  job.operator_name = request.operator_name;
  job.exposure = request.exposure;
  job.poses.push_back({});
  if (auto read = machine::parse_job_config(machine::format_job_config(job, ""), "the job"); !read) {
    return base::pass(read);
  }
  auto choice = choose_poses(rig, request.choice);
  if (!choice) return base::pass(choice);
  const std::size_t n = choice->poses.size();
  const auto roll = static_cast<std::size_t>(AxisId::roll);
  const auto rolls = stratified_rolls(rig.axes[roll], n, request.seed);
  for (std::size_t i = 0; i < n; ++i) choice->poses[i][roll] = rolls[i];

  JointAngles home{};
  for (std::size_t i = 0; i < machine::kAxisCount; ++i) home[i] = rig.axes[i].home_rad;
  std::unique_ptr<base::Progress> progress;
  std::size_t told = 0;
  const auto tour = machine::order_poses(rig, home, choice->poses, [&](std::size_t done, std::size_t total) {
    if (!progress) progress = std::make_unique<base::Progress>("order", total, "exchanges");
    progress->add(done - std::exchange(told, done));
  });

  Plan plan;
  plan.walked = choice->walked;
  plan.too_steep = choice->too_steep;
  plan.kept_out = choice->kept_out;
  plan.unreachable = tour.unreachable.size();
  plan.job = std::move(job);
  plan.job.poses.clear();
  for (const std::size_t i : tour.order) {
    plan.job.poses.push_back(choice->poses[i]);
    plan.pairs.push_back(choice->pairs[i]);
    if (!sees_whole_sample(rig, choice->poses[i])) ++plan.cut_off;
  }
  // What only the drivers know is left out: readouts, and whether there is no shutter for a dark frame.
  plan.course = machine::foresee(rig, {}, plan.job, home);
  plan.warm_up_s = rig.light.warm_up_s;
  if (auto ok = machine::check_job(rig, plan.job); !ok) return base::pass(ok);
  return plan;
}

std::string summary(const PlanRequest& request, const Plan& plan) {
  const ChoiceOptions& o = request.choice;
  std::string out = fmt::format(
      "{} poses, {:.2f} deg apart (isotropic, reciprocal), light to {:.0f} deg, view to {:.0f} deg\n",
      plan.job.poses.size(), base::degrees(o.apart_rad), base::degrees(o.max_incident_rad),
      base::degrees(o.max_exitant_rad));
  out += fmt::format("{} stations walked in steps of {:.2f} deg, {} of them too steep; rolls from seed {}\n",
                     plan.walked, base::degrees(o.step_rad), plan.too_steep, request.seed);
  if (plan.kept_out > 0) out += fmt::format("{} stations refused by keep-out rules\n", plan.kept_out);
  if (plan.unreachable > 0) {
    out +=
        fmt::format("warning: {} poses left out, because no allowed move leads to them\n", plan.unreachable);
  }
  if (plan.cut_off > 0) {
    out += fmt::format("warning: in {} poses the camera does not see the whole sample\n", plan.cut_off);
  }
  const machine::JobCourse& course = plan.course;
  if (!course.unproven.empty()) {
    out += fmt::format("warning: no reference visit can follow the last pose: {}\n", course.unproven);
  }
  out += fmt::format(
      "estimated {}: {} moving, {} exposing, {} warming up the light, with {} reference visits; "
      "without transfer of frames, homing and cooling down\n",
      base::format_duration(course.duration_s + plan.warm_up_s), base::format_duration(course.travel_s),
      base::format_duration(course.exposing_s), base::format_duration(plan.warm_up_s),
      course.visits == 0 ? "no" : std::to_string(course.visits));
  out += "polar angle, deg   0-10  10-20  20-30  30-40  40-50  50-60  60-70  70-80  80-90\n";
  out += histogram("   light", plan.pairs, &IsotropicPair::incident_rad);
  out += histogram("   view", plan.pairs, &IsotropicPair::exitant_rad);
  return out;
}

base::Result<void> write_plan(const std::string& path, bool replace, const PlanRequest& request,
                              const Plan& plan) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) {
    return base::fail(base::ErrorCode::bad_input, "is a folder", path, "name a file for the job");
  }
  if (!replace && std::filesystem::exists(path, error)) {
    return base::fail(base::ErrorCode::refused, "exists already", path, "--force replaces it");
  }
  return base::write_file_durably(path, machine::format_job_config(plan.job, summary(request, plan)));
}

}  // namespace rig::plan
