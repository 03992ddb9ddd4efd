// The inputs that rigd reads: when they are looked at, and what is made of what they say.
#pragma once

#include <string>

#include "daemon/action.h"
#include "daemon/state.h"

namespace rig::daemon {

/// A regular look at all devices of lines.
void ask_lines(const Setup& setup, State& state, Actions& actions);

/// Takes in what was read. An axis that it shows to have run into a limit switch stops everything; the
/// emergency stop is for conditions.cpp to latch.
void on_lines_read(const Setup& setup, State& state, Actions& actions, const LinesRead& read);

/// What the limit lines of a device that failed said is not known any more. Another device is none of its
/// business.
void forget_limit_lines(const Setup& setup, State& state, const std::string& device);

/// While axes that have limit lines move, but for homing: reads those every 50 ms, and stops everything where
/// no reading came that was asked for in the last lines_ms.
void watch_limit_lines(const Setup& setup, State& state, Actions& actions);

}  // namespace rig::daemon
