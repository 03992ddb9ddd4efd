// The GenICam description of the simulated camera: Aravis' own and what we add to it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace rig::sim::wire {

// Registers of what is added, where Aravis' camera has plain memory.
inline constexpr std::uint32_t kTemperatureRegister = 0x4000;  ///< hundredths of a degree
inline constexpr std::uint32_t kReadyRegister = 0x4004;        ///< 1: it waits for a trigger
inline constexpr std::uint32_t kStatusSelectorRegister = 0x4008;
inline constexpr std::uint32_t kLatchRegister = 0x4010;
inline constexpr std::uint32_t kClockRegister = 0x4018;  ///< 8 bytes, ns

inline constexpr std::uint32_t kChunkModeRegister = 0x4020;
inline constexpr std::uint32_t kChunkSelectorRegister = 0x4024;
inline constexpr std::uint32_t kChunkEnableRegister = 0x4028;

// Chunks, in this order after the image: each 8 bytes, big-endian, and 8 bytes of id and length.
inline constexpr std::uint32_t kImageChunk = 1, kExposureChunk = 0x1001, kTimestampChunk = 0x1002;
inline constexpr std::size_t kChunkBytes = 8 + 16 + 16;  ///< of all three without the image

/// `with_chunks`: it has a chunk mode.
[[nodiscard]] std::string extended_genicam(std::string xml, bool with_chunks);

}  // namespace rig::sim::wire
