// What a job looks at beside its poses: whether the sample stands where it stood, whether it is the right
// one, and whether light and room are as they were (dark frame and reference patches). No pose begins
// meanwhile.
#pragma once

#include "daemon/action.h"
#include "daemon/motion.h"
#include "daemon/state.h"

namespace rig::daemon {

/// Notes what the opened job has to look at first; tells where something cannot be looked at.
void plan_visits(const Setup& setup, State& state, Actions& actions, const JobOpened& opened);

/// Whether a visit is under way or has to be made before the next pose, and before the job may end.
[[nodiscard]] bool visit_comes_first(const Setup& setup, const State& state);

/// Begins the visit that is due, or does what the one under way can do next. Only while no pose is in flight.
/// One that the keep-out zones do not let the rig make here is put off until the next pose is taken.
void advance_visit(const Setup& setup, State& state, Actions& actions);

void on_visit_motion_end(const Setup& setup, State& state, Actions& actions, const MotionEnd& end);
void on_visit_frame(const Setup& setup, State& state, Actions& actions, const FrameFetched& fetched);
void on_visit_frame_refused(State& state, Actions& actions, const std::string& reason);
void on_look_judged(const Setup& setup, State& state, Actions& actions, const LookJudged& judged);

/// The job waits for a person, who has seen for himself when he releases it.
void hold_for_person(State& state, Actions& actions, const std::string& reason);

/// After a bad visit and its pause another one is due, and what the bad one suspended is released.
void end_pause_after_bad_visit(State& state);

}  // namespace rig::daemon
