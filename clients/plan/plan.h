// From a rig and an angle to a job: what rig-plan does.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "clients/plan/density.h"
#include "clients/plan/pose_choice.h"
#include "core/base/result.h"
#include "core/machine/job_config.h"
#include "core/machine/job_course.h"
#include "core/machine/rig_config.h"

namespace rig::plan {

struct PlanRequest {
  ChoiceOptions choice;
  std::uint64_t seed = 1;  ///< of the rolls
  std::string name;
  std::string sample;
  std::string operator_name;
  machine::ExposureConfig exposure;
};

struct Plan {
  machine::JobConfig job;                               ///< poses in the order of the tour
  std::vector<IsotropicPair> pairs;                     ///< of the job's poses, in their order
  std::size_t walked = 0, too_steep = 0, kept_out = 0;  ///< as in Choice
  std::size_t unreachable = 0;  ///< poses left out because no allowed move leads to them
  std::size_t cut_off = 0;      ///< poses in which the camera does not see the whole sample
  machine::JobCourse course;    ///< from home, as rigd goes: with the reference visits of rig.toml
  double warm_up_s = 0;
};

/// Chooses the poses, gives each its roll, puts them in order and checks the job against the rig.
[[nodiscard]] base::Result<Plan> make_plan(const machine::RigConfig& rig, const PlanRequest& request);

/// What a person wants to know of a plan: number, angle, time, how the polar angles are spread; a few lines.
[[nodiscard]] std::string summary(const PlanRequest& request, const Plan& plan);

/// Refuses to replace a file that exists, unless told to, and a folder always; writes the job with its
/// summary as a comment.
[[nodiscard]] base::Result<void> write_plan(const std::string& path, bool replace, const PlanRequest& request,
                                            const Plan& plan);

}  // namespace rig::plan
