// Whether a reference visit agrees with another one, such as the scan's first: a pure comparison.
#pragma once

#include <optional>
#include <string>

#include "core/machine/reference_config.h"
#include "core/scan/visits.h"

namespace rig::daemon {

struct VisitVerdict {
  bool room_dark = true;       ///< false: the dark frame is lighter than it was
  std::string what;            ///< what is wrong, in words; empty: nothing
  double dark_dn = 0;          ///< of the dark frame, above the first visit's
  double level = 1;            ///< mean of the patches, relative to the first visit
  double unevenness = 0;       ///< farthest that one patch's change departs from all of theirs, relative
  double flat_level = 0;       ///< mean of the flat, relative to the first visit; 0: none to compare
  double flat_unevenness = 0;  ///< farthest that one part's change departs from all of theirs, relative
};

/// `first`: what to compare with; none for the first visit itself, which is good where patches and flat are
/// lit.
/// `strict` tightens the bounds after a bad visit, so that what is at their edge does not come and go.
[[nodiscard]] VisitVerdict judge_visit(const machine::ReferenceConfig& config,
                                       const std::optional<scan::VisitRecord>& first,
                                       const scan::VisitRecord& now, bool strict);

}  // namespace rig::daemon
