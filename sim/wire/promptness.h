// A simulated device has no processor of its own, and is to answer as if it had.
#pragma once

#include <pthread.h>
#include <sched.h>

namespace rig::sim::wire {

/// The calling thread runs before those that compute, so that a busy machine does not make its device late.
/// Where the system does not allow it (it takes root) everything stays as it is.
inline void answer_promptly() {
  sched_param lowest{};
  lowest.sched_priority = ::sched_get_priority_min(SCHED_RR);
  (void)::pthread_setschedparam(::pthread_self(), SCHED_RR, &lowest);
}

}  // namespace rig::sim::wire
