// What clients ask for. Every request is answered exactly once, here or when what it began has ended.
#pragma once

#include "daemon/action.h"
#include "daemon/state.h"

namespace rig::daemon {

void on_request(const Setup& setup, State& state, Actions& actions, const RequestReceived& received);

void on_job_created(State& state, Actions& actions, const JobCreated& created);

}  // namespace rig::daemon
