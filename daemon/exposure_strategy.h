// Which exposure comes next: a pure function of the job and of this bracket.
#pragma once

#include <optional>
#include <vector>

#include "core/machine/job_config.h"
#include "core/scan/journal.h"

namespace rig::daemon {

struct NextExposure {
  enum class Kind { expose, wait_for_frame, complete };
  Kind kind = Kind::complete;
  double exposure_s = 0;
  bool last = false;  ///< nothing follows this one, whatever it shows
};

/// `triggered` exposures were begun, `fetched` are those whose frame is known, in order. "Halve" starts with
/// the longest exposure and halves it while more of the sample is saturated than allowed (Mortensen and
/// Andersen 2007, 16.3).
[[nodiscard]] NextExposure next_exposure(const machine::ExposureConfig& config, std::size_t triggered,
                                         const std::vector<scan::FrameRecord>& fetched);

}  // namespace rig::daemon
