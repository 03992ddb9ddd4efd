// What the virtual rig remembers, in a memory-mapped file that outlives rigd and that no kill tears.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>

#include "core/base/result.h"
#include "sim/world.h"

namespace rig::sim {

/// One axis. It goes from `from` to `to` (counts) starting at `start_ns`, with the profile of `velocity` and
/// `acceleration`; once the time of that is over it stands at `to`.
struct AxisMemory {
  std::int64_t from = 0, to = 0;
  std::int64_t start_ns = 0;
  double velocity_rad_s = 0, acceleration_rad_s2 = 0;
  std::int32_t homed = 0, homing = 0, enabled = 0;
  std::int32_t from_above = 0;  ///< direction of the last travel
};

/// Plain data: it is copied to the file byte by byte.
struct Memory {
  std::int64_t now_ns = 0;  ///< virtual time of the last change
  std::array<AxisMemory, kAxes> axes{};
  double light_level = 0;
  std::int64_t light_since_ns = 0;  ///< when the lamp was last switched on
  double lamp_hours = 0;
  std::int32_t shutter_open = 0;
  std::int32_t made = 0;  ///< 0: a new world
};

/// Two slots with a sequence number and a checksum each; the newer valid one counts, the other is written
/// next. A process that dies while writing leaves the older one whole.
class StateFile {
 public:
  [[nodiscard]] static base::Result<StateFile> open(const std::filesystem::path& path);
  StateFile(StateFile&&) noexcept;
  StateFile& operator=(StateFile&&) noexcept;
  ~StateFile();

  [[nodiscard]] Memory load() const;
  void store(const Memory& memory);

 private:
  struct Mapping;
  explicit StateFile(std::unique_ptr<Mapping> mapping);
  std::unique_ptr<Mapping> mapping_;
};

}  // namespace rig::sim
