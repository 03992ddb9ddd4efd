// What comes of a reference visit whose frames were looked at: its verdict, its record in the journal, and
// what the job does about it.
#pragma once

#include <string>

#include "daemon/action.h"
#include "daemon/state.h"

namespace rig::daemon {

/// Goes on from the visits that the opened job's journal has.
void resume_reference_visits(const Setup& setup, State& state, const scan::VisitsSoFar& so_far);

/// Judges the visit under way by its looks, which are all there, ends it, and has it recorded.
void judge_reference_visit(const Setup& setup, State& state, Actions& actions);

/// The same for one that could not be made.
void record_failed_visit(State& state, Actions& actions, const std::string& reason);

void on_visit_recorded(const Setup& setup, State& state, Actions& actions, const VisitRecorded& recorded);

}  // namespace rig::daemon
