// The standard of a scan: the reference visit that its others are compared with, how it comes to be, and how
// it is given up where it was taken in a light that did not last. Pure.
#pragma once

#include <optional>

#include "core/base/clock.h"
#include "daemon/visit_verdict.h"

namespace rig::daemon {

/// Visits in succession that agree with each other and not with the standard, or before there is one.
struct Rival {
  scan::VisitRecord first;  ///< what the others agree with
  int visits = 0;           ///< that count, this one included
  base::Time counted{};     ///< when the last one that counts was made
};

/// What came of a visit.
struct VisitOutcome {
  enum class Kind {
    good,
    unproven,  ///< nothing speaks against it, but there is none yet that it could agree with
    bad,
    replaces,  ///< it becomes the standard, and every pose so far is taken again
  };
  Kind kind = Kind::bad;
  VisitVerdict verdict;  ///< `what`: what is wrong; of one that replaces the standard, why
};

/// Two visits in succession that agree make the first standard: no excursion of the light that is over by
/// then is taken for its level. One that was made all the same is given up once more visits in succession
/// agree with each other than `agreed` with it, each `again_s` after the one before; where no pose relies on
/// it (`agreed` is 0), two suffice. A visit in a room that is not dark never counts for another standard.
/// `rival` is carried from visit to visit; `strict` as in judge_visit().
[[nodiscard]] VisitOutcome weigh_visit(const machine::ReferenceConfig& config,
                                       const std::optional<scan::VisitRecord>& standard, int agreed,
                                       std::optional<Rival>& rival, const scan::VisitRecord& now,
                                       bool strict);

/// The rival as weigh_visit() left it after the visits since the last good one.
[[nodiscard]] std::optional<Rival> rival_of(const machine::ReferenceConfig& config,
                                            const scan::VisitsSoFar& visits, int agreed);

}  // namespace rig::daemon
