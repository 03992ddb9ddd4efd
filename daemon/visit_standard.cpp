#include "daemon/visit_standard.h"

#include <algorithm>

namespace rig::daemon {

using Kind = VisitOutcome::Kind;

VisitOutcome weigh_visit(const machine::ReferenceConfig& config,
                         const std::optional<scan::VisitRecord>& standard, int agreed,
                         std::optional<Rival>& rival, const scan::VisitRecord& now, bool strict) {
  const bool usable = judge_visit(config, std::nullopt, now, false).what.empty();
  VisitOutcome outcome{Kind::bad, judge_visit(config, standard, now, strict)};
  if (standard && outcome.verdict.what.empty()) {
    rival.reset();
    outcome.kind = Kind::good;
    return outcome;
  }
  if (!usable || !outcome.verdict.room_dark) {
    rival.reset();
    return outcome;
  }
  if (!rival) {
    rival = Rival{now, 1, now.when};
    if (!standard) outcome.kind = Kind::unproven;
    return outcome;
  }
  VisitVerdict against = judge_visit(config, rival->first, now, false);
  if (!against.what.empty()) {
    if (!standard) {
      against.what = "it does not agree with the visit before: " + against.what;
      outcome.verdict = against;
    }
    // The darker one stays.
    if (against.room_dark) rival = Rival{now, 1, now.when};
    return outcome;
  }
  // Restarts of rigd make visits, too, which show nothing but one and the same excursion.
  if (agreed == 0 || now.when - rival->counted >= base::seconds(config.again_s)) {
    ++rival->visits;
    rival->counted = now.when;
  }
  if (rival->visits <= std::max(agreed, 1)) return outcome;
  if (standard) {
    outcome.kind = Kind::replaces;
    outcome.verdict.what = fmt::format(
        "{} visits agree with each other and not with the first: every pose is taken again in this light "
        "({})",
        rival->visits, outcome.verdict.what);
  } else {
    outcome = {Kind::good, against};
  }
  rival.reset();
  return outcome;
}

std::optional<Rival> rival_of(const machine::ReferenceConfig& config, const scan::VisitsSoFar& visits,
                              int agreed) {
  std::optional<Rival> rival;
  // None of them was good, however strict it was judged.
  for (const scan::VisitRecord& visit : visits.since_good)
    (void)weigh_visit(config, visits.first, agreed, rival, visit, true);
  return rival;
}

}  // namespace rig::daemon
