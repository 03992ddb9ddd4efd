// Where the checks of each concern are.
#pragma once

#include <vector>

#include "drivers/conformance/suite.h"

namespace rig::drivers::conformance {

[[nodiscard]] std::vector<Check> module_checks();
[[nodiscard]] std::vector<Check> axis_move_checks();
[[nodiscard]] std::vector<Check> axis_stop_checks();
[[nodiscard]] std::vector<Check> axis_reference_checks();
[[nodiscard]] std::vector<Check> axis_jog_checks();
[[nodiscard]] std::vector<Check> axis_limit_checks();
[[nodiscard]] std::vector<Check> axis_wire_checks();
[[nodiscard]] std::vector<Check> axis_lost_checks();
[[nodiscard]] std::vector<Check> camera_frame_checks();
[[nodiscard]] std::vector<Check> camera_fault_checks();
[[nodiscard]] std::vector<Check> light_checks();
[[nodiscard]] std::vector<Check> lines_checks();

}  // namespace rig::drivers::conformance
