// The state machine of CiA 402: what a statusword says, and which controlword leads on.
#pragma once

#include <cstdint>
#include <optional>

namespace rig::drivers::cia402 {

enum class Power {
  not_ready,  ///< the drive is still starting; also what no state's bits are
  switch_on_disabled,
  ready,
  switched_on,
  operation_enabled,
  quick_stop,
  fault_reaction,
  fault,
};

[[nodiscard]] Power power_of(std::uint16_t statusword);

/// "ready to switch on"
[[nodiscard]] const char* text_of(Power power);

/// Whether the motor has current.
[[nodiscard]] constexpr bool is_energised(Power power) {
  return power == Power::operation_enabled || power == Power::quick_stop || power == Power::fault_reaction;
}

/// Bits of the statusword. What the mode defines is read in the mode that the drive shows (6061) alone.
namespace status {
inline constexpr std::uint16_t kRemote = 1U << 9U;
inline constexpr std::uint16_t kTargetReached = 1U << 10U;
inline constexpr std::uint16_t kInternalLimit = 1U << 11U;
inline constexpr std::uint16_t kSetPointTaken = 1U << 12U;   ///< profile position
inline constexpr std::uint16_t kFollowingError = 1U << 13U;  ///< profile position
inline constexpr std::uint16_t kHomingAttained = 1U << 12U;  ///< homing
inline constexpr std::uint16_t kHomingError = 1U << 13U;     ///< homing
}  // namespace status

/// Controlwords.
namespace control {
inline constexpr std::uint16_t kDisableVoltage = 0x0000;
inline constexpr std::uint16_t kQuickStop = 0x0002;  ///< bit 2 is active low
inline constexpr std::uint16_t kShutdown = 0x0006;
inline constexpr std::uint16_t kSwitchOn = 0x0007;
inline constexpr std::uint16_t kEnableOperation = 0x000F;
inline constexpr std::uint16_t kFaultReset = 0x0080;      ///< its rising edge
inline constexpr std::uint16_t kNewSetPoint = 1U << 4U;   ///< profile position; its rising edge
inline constexpr std::uint16_t kStartHoming = 1U << 4U;   ///< homing
inline constexpr std::uint16_t kChangeAtOnce = 1U << 5U;  ///< profile position
}  // namespace control

inline constexpr std::int8_t kProfilePosition = 1, kHoming = 6;  ///< modes, objects 6060 and 6061

/// The one controlword that leads a step towards operation enabled. Nothing where the drive is there, where
/// it goes on by itself (not ready, fault reaction, a quick stop in which it does not stay: option codes 0 to
/// 3), or where a fault has to be reset first. `stays`: option code 5 to 8.
[[nodiscard]] std::optional<std::uint16_t> towards_operation(Power power, bool stays);

}  // namespace rig::drivers::cia402
