// State as the protocol tells it.
#pragma once

#include <string>

#include "daemon/action.h"
#include "daemon/state.h"
#include "protocol/rig.pb.h"

namespace rig::daemon {

[[nodiscard]] protocol::Reply make_reply(std::uint64_t id, protocol::Outcome outcome,
                                         const std::string& reason = {});
[[nodiscard]] protocol::Status make_status(const Setup& setup, const State& state);
[[nodiscard]] protocol::JobInfo make_job_info(const State& state, const JobEntry& job);
[[nodiscard]] protocol::LightStatus make_light_status(const drivers::LightState& light);
[[nodiscard]] protocol::Mode mode_of(const State& state);

/// Keeps the events of a take that will not be committed: they were told.
void keep_events(const PoseTake& take, Actions& actions);

/// Numbers an event, stamps it and adds its publication. An event of the pose in flight waits there for the
/// pose's commit; every other one is kept at once.
void publish(State& state, Actions& actions, protocol::Event event);
/// The event Alarm.
void publish_alarm(State& state, Actions& actions, const std::string& text);
/// JobChanged, and the job's line in rigd's own state.
void publish_job(State& state, Actions& actions, const JobEntry& job);

}  // namespace rig::daemon
