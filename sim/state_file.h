// What the virtual rig remembers, in a memory-mapped file that outlives rigd and that no kill tears.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>

#include "core/base/result.h"
#include "sim/world.h"

namespace rig::sim {

/// One axis. From `start_ns` on it goes from `from_rad` to the count `to`; sim/ride.h knows how. Once the
/// time of that is over it stands there.
struct AxisMemory {
  double from_rad = 0;
  std::int64_t to = 0;
  std::int64_t start_ns = 0;
  double velocity_rad_s = 0, acceleration_rad_s2 = 0;
  std::int32_t braking = 0;  ///< slows down from velocity_rad_s instead of starting from rest
  std::int32_t homed = 0, homing = 0, enabled = 0;
  std::int32_t from_above = 0;  ///< direction of the last travel
  std::int32_t again = 0;       ///< once at rest, moves on to `next`
  std::int64_t next = 0;
  double next_velocity_rad_s = 0, next_acceleration_rad_s2 = 0;
  double slip_rad = 0;  ///< how far lost steps have put the axis from where its readback says
};

/// Plain data: it is copied to the file byte by byte.
struct Memory {
  std::int64_t now_ns = 0;  ///< virtual time of the last change
  std::array<AxisMemory, kAxes> axes{};
  double light_level = 0;
  std::int64_t light_since_ns = 0;  ///< when the lamp was last switched on
  double lamp_hours = 0;            ///< until then
  std::int32_t shutter_open = 0;
  std::int32_t made = 0;     ///< 0: a new world
  std::int64_t made_ns = 0;  ///< when it was made
};

/// Two slots with a sequence number and a checksum each; the newer valid one counts, the other is written
/// next. A process that dies while writing leaves the older one whole.
class StateFile {
 public:
  /// Makes the file where there is none. A file in which neither slot is valid, though something was written,
  /// is an error: going on from zero would lie about where the axes stand.
  [[nodiscard]] static base::Result<StateFile> open(const std::filesystem::path& path);
  StateFile(StateFile&&) noexcept;
  StateFile& operator=(StateFile&&) noexcept;
  ~StateFile();

  /// What was stored last; a Memory with `made` 0 where nothing was.
  [[nodiscard]] Memory load() const;

  /// Safe from the death of the process at once.
  void store(const Memory& memory);
  /// Safe from the death of the machine too, when it returns.
  [[nodiscard]] base::Result<void> flush();

 private:
  struct Mapping;
  explicit StateFile(std::unique_ptr<Mapping> mapping);
  std::unique_ptr<Mapping> mapping_;
};

}  // namespace rig::sim
