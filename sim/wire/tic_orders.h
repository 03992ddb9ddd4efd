// A simulated Tic's faults in words, a line each, for rig-sim-tic.
#pragma once

#include <string>
#include <string_view>

#include "core/base/result.h"
#include "sim/wire/tic.h"

namespace rig::sim::wire {

/// Does what a line says: "limit forward on", "limit reverse off", "kill on", "driver_error on", "err_line
/// on", "vin 5000", "power_cycle", "put 1200". "state" is answered with a line that says how the Tic stands,
/// any other with an empty text.
[[nodiscard]] base::Result<std::string> carry_out_order(Tic& tic, std::string_view line);

/// "0x5F=8": a setting's offset and its value.
[[nodiscard]] base::Result<void> change_setting(TicSettingBytes& settings, std::string_view text);

}  // namespace rig::sim::wire
