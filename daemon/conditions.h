// The conditions that suspend a job and release it by themselves: one table, one evaluator.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/base/clock.h"
#include "daemon/action.h"
#include "daemon/state.h"

namespace rig::daemon {

/// Looks at every condition of the table: what came on suspends the active job (or latches the stop), what
/// went off releases it, what lasts longer than rig.toml allows holds or fails it. Called after every event.
void watch_conditions(const Setup& setup, State& state, Actions& actions);

/// "light", as in messages.
[[nodiscard]] std::string_view condition_name(Condition condition);

/// Those that keep the active job from going on.
struct ActiveCondition {
  Condition condition;
  const ConditionTrack* track;
};
[[nodiscard]] std::vector<ActiveCondition> active_conditions(const State& state);

/// Whether the suspended job waits for the rig or the world of things rather than for a person.
[[nodiscard]] bool waits_for_rig(const State& state);

/// The job that rigd is at: opened, or about to be opened again after a stop. Null: none.
[[nodiscard]] const JobEntry* active_job(const State& state);

}  // namespace rig::daemon
