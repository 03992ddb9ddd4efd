// Which exposure comes next: a pure function of the job, of the rig's geometry and sensor, and of this
// bracket.
#pragma once

#include <optional>

#include "core/machine/job_config.h"
#include "daemon/state.h"

namespace rig::daemon {

struct NextExposure {
  enum class Kind { expose, wait_for_frame, complete };
  Kind kind = Kind::complete;
  double exposure_s = 0;
  bool last = false;  ///< nothing follows this one, whatever it shows
};

/// Of `take` counts what was triggered, the frames fetched and where the pose is meant to be. "Halve" starts
/// with the longest exposure and halves it while more of the sample is saturated than allowed (Mortensen and
/// Andersen 2007, 16.3); "predicted" is in exposure_prediction.h, "adaptive" in adaptive_exposure.h. Fixed
/// and predicted brackets wait for no frame.
[[nodiscard]] NextExposure next_exposure(const Setup& setup, const machine::ExposureConfig& config,
                                         const PoseTake& take);

/// Of an adaptive bracket: the share of the sample's pixels that miss the signal-to-noise ratio asked for.
[[nodiscard]] std::optional<double> shortfall(const Setup& setup, const machine::ExposureConfig& config,
                                              const PoseTake& take);

}  // namespace rig::daemon
