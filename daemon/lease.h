// Control of the rig: one client at a time may command, and everybody sees which. A client is a name (of a
// key, or of a local user), so that all programs of one person share it. Measured in wall time.
#pragma once

#include "core/base/result.h"
#include "daemon/action.h"

namespace rig::daemon {

/// Any request is a sign of life of its sender.
void hear(const Setup& setup, State& state, Actions& actions, const RequestReceived& received);

/// Frees control whose holder was not heard of for `setup.rig.access.release_after_s`, unless something it
/// asked for is still under way.
void release_silent(const Setup& setup, State& state, Actions& actions);

/// For a command: takes control where it is free. An Error names who has it.
[[nodiscard]] base::Result<void> use_control(State& state, Actions& actions, const RequestReceived& received);

[[nodiscard]] bool is_about_control(const protocol::Request& request);
/// Answers TakeControl, ReleaseControl, HandOver and GetControl.
void on_control_request(const Setup& setup, State& state, Actions& actions, const RequestReceived& received);

/// Its key was taken off the list: it loses control too.
void on_client_revoked(State& state, Actions& actions, const ClientRevoked& revoked);

[[nodiscard]] protocol::Control make_control(const Setup& setup, const State& state);

}  // namespace rig::daemon
