// The GenICam description of the simulated camera: Aravis' own and what we add to it.
#pragma once

#include <cstdint>
#include <string>

namespace rig::sim::wire {

// Registers of what is added, where Aravis' camera has plain memory.
inline constexpr std::uint32_t kTemperatureRegister = 0x4000;  ///< hundredths of a degree
inline constexpr std::uint32_t kReadyRegister = 0x4004;        ///< 1: it waits for a trigger
inline constexpr std::uint32_t kStatusSelectorRegister = 0x4008;
inline constexpr std::uint32_t kLatchRegister = 0x4010;
inline constexpr std::uint32_t kClockRegister = 0x4018;  ///< 8 bytes, ns

[[nodiscard]] std::string extended_genicam(std::string xml);

}  // namespace rig::sim::wire
