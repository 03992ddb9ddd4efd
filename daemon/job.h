// A job, pose by pose: move, expose, store, commit; retry and give up.
#pragma once

#include "daemon/action.h"
#include "daemon/motion.h"
#include "daemon/state.h"

namespace rig::daemon {

/// Does whatever the job can do next; called after every event.
void advance_job(const Setup& setup, State& state, Actions& actions);

void on_job_opened(const Setup& setup, State& state, Actions& actions, const JobOpened& opened);
/// The motion of a job's pose or its homing ended.
void on_job_motion_end(const Setup& setup, State& state, Actions& actions, const MotionEnd& end);
void on_job_frame(State& state, Actions& actions, const PendingFrame& pending, const FrameFetched& fetched);
/// The frame is no good: its pose is taken again, or abandoned after its last attempt. The rig may have gone
/// on to the next pose already.
void on_job_frame_refused(State& state, Actions& actions, const PendingFrame& pending,
                          const std::string& reason);
void on_frame_stored(State& state, const FrameStored& stored);
void on_pose_committed(const Setup& setup, State& state, Actions& actions, const PoseCommitted& committed);

/// Removes the frames of the pose in flight, which is no longer; one that is complete and on its way to the
/// journal stays there.
void discard_takes(State& state, Actions& actions);

/// The pose in flight is taken again later, as if it had not begun; what is complete and on its way to the
/// disk stays.
void give_back(State& state, Actions& actions);

/// Null: there is none.
[[nodiscard]] JobEntry* find_job(State& state, std::uint64_t id);

/// The report of a job that has ended.
[[nodiscard]] TellOfJob report_of_ended(const State& state, const JobEntry& job);

/// Ends a job for good.
void end_job(const Setup& setup, State& state, Actions& actions, std::uint64_t id, JobEntry::State how,
             const std::string& reason);

}  // namespace rig::daemon
