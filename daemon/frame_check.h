// What cannot be a frame is refused: rather once more than one wrong picture among thousands.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "core/machine/rig_config.h"
#include "daemon/action.h"
#include "daemon/state.h"

namespace rig::daemon {

/// Why these pixels cannot come from this sensor: samples beyond its bits, or lines of zeros though its black
/// level lies well above. Empty where nothing speaks against them.
[[nodiscard]] std::string damage_in(const machine::CameraConfig& camera,
                                    std::span<const std::uint16_t> pixels);

/// Why a fetched frame is not the one that was asked for: its pixels, an exposure that is none or far from
/// the one asked for, the number of a frame that came before. Empty where it is.
[[nodiscard]] std::string why_refused(const State& state, const PendingFrame& pending,
                                      const FrameFetched& fetched);

/// Gives the pending frame up. A job's pose is taken again (or abandoned, after its last attempt), a snap
/// fails. After kRefusedInARow frames one after the other the fault is the camera's, and everything stops.
void refuse_frame(const Setup& setup, State& state, Actions& actions, const std::string& reason);

inline constexpr int kRefusedInARow = 5;

}  // namespace rig::daemon
