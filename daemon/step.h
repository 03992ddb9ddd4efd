// The one function that decides. It does no I/O, takes no lock and reads no clock.
#pragma once

#include <optional>

#include "core/base/clock.h"
#include "daemon/action.h"
#include "daemon/event.h"
#include "daemon/state.h"

namespace rig::daemon {

struct Step {
  State state;
  Actions actions;
};

[[nodiscard]] Step step(const Setup& setup, State state, const Event& event);

/// When a Tick is due, and whether it is the rig that is waited for.
struct Wake {
  Time at{};
  base::WaitFor kind = base::WaitFor::person;
};
[[nodiscard]] std::optional<Wake> next_wake(const State& state);

}  // namespace rig::daemon
