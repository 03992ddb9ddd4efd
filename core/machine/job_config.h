// job.toml: what to measure (docs/job-toml.md is the reference of its keys).
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "core/machine/pose.h"
#include "core/machine/rig_config.h"

namespace rig::machine {

enum class ExposureStrategy {
  fixed,  ///< every exposure of the list
  halve,  ///< from the longest, halved until the sample is not saturated (Mortensen and Andersen 2007, 16.3)
  predicted,  ///< from brackets for the lightest and the darkest pose (McAllister 2002, 3.4.1)
  adaptive,   ///< from the images of the bracket: what a signal-to-noise ratio asks for
};

struct ExposureConfig {
  ExposureStrategy strategy = ExposureStrategy::fixed;
  std::vector<double> exposures_s;  ///< fixed: the bracket, longest first
  double longest_s = 0;             ///< halve: where to begin; adaptive: bound on each exposure
  int most_frames = 1;              ///< halve, adaptive: bound on the bracket
  double saturated_share = 0;       ///< halve: share of the sample's pixels that may be saturated
  /// Predicted: brackets of equal length, longest first, for the lightest and the darkest pose, and the
  /// angles between view and mirror direction (exposure_prediction.h) of those poses.
  std::vector<double> lightest_s{}, darkest_s{};
  double lightest_rad = 0, darkest_rad = 0;
  double first_s = 0;      ///< adaptive: the exposure that nothing is known for yet
  double snr = 0;          ///< adaptive: signal over noise that a pixel's merged value is to have
  double short_share = 0;  ///< adaptive: share of the sample's pixels that may miss it
};

struct RetryConfig {
  int attempts = 3;    ///< of one pose, before it is abandoned
  double delay_s = 1;  ///< before the second attempt, doubled with each further one
};

struct JobConfig {
  std::string name;
  std::string sample;         ///< the sample's name, for people
  std::string operator_name;  ///< may be empty
  /// Tags that are on this sample's mount and on no other's: it is checked that they are seen before the
  /// first pose is taken.
  std::vector<int> sample_fiducials{};
  bool needs_sample_change = false;  ///< waits before it starts until a person has changed the sample
  std::vector<JointAngles> poses;    ///< in the order in which they are to be taken
  ExposureConfig exposure;
  RetryConfig retry;
};

[[nodiscard]] base::Result<JobConfig> load_job_config(const std::string& path);
[[nodiscard]] base::Result<JobConfig> parse_job_config(std::string_view text, const std::string& name);

/// job.toml as text, with a comment on top. parse_job_config reads it back to the same values, bit for bit,
/// where they are what some number of degrees or microseconds comes to (as all that were read from a file
/// are); to the last digit otherwise.
[[nodiscard]] std::string format_job_config(const JobConfig& job, std::string_view comment);

/// Whether the rig can do the job, before anything moves: every pose within the limits and out of the
/// keep-out zones, also on the way from pose to pose, every exposure within the camera's. All mistakes in one
/// Error, with the number of the pose (from 0, as the rows of the scan) and the axis or the rule.
[[nodiscard]] base::Result<void> check_job(const RigConfig& rig, const JobConfig& job);

}  // namespace rig::machine
