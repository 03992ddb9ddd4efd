// Orders in words to simulated CANopen nodes.
#pragma once

#include <string>
#include <string_view>

#include "sim/wire/canopen_station.h"

namespace rig::sim::wire {

/// What obey() understands, a line each.
[[nodiscard]] const char* canopen_orders();

/// Carries out one line; "ok", what was asked for, or "error: ..." with the reason.
[[nodiscard]] std::string obey(CanopenStation& station, std::string_view line);

}  // namespace rig::sim::wire
