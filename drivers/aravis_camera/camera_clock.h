// From the camera's clock to this machine's.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/base/clock.h"
#include "drivers/aravis_camera/glib.h"

namespace rig::drivers::aravis {

/// A camera that can latch its clock is asked for it now and then; of one that cannot nothing is known.
class CameraClock {
 public:
  CameraClock(ArvDevice* device, base::Clock& clock);

  /// Asks for it; the error of half the time that this takes goes into what time_of() says, where that is
  /// less than what is known already. A camera without a latch: does nothing.
  [[nodiscard]] base::Result<void> latch();
  /// When, by our clock, the camera's stood at so many nanoseconds.
  [[nodiscard]] std::optional<base::Time> time_of(std::uint64_t camera_ns) const;
  /// How far off time_of() may be, for the time that a latch() takes and for how long ago that was.
  [[nodiscard]] base::Duration error() const;
  /// Nanoseconds of so many counts of the camera's clock.
  [[nodiscard]] std::uint64_t nanoseconds(std::uint64_t counts) const;

 private:
  ArvDevice* const device_;  // outlives this
  base::Clock& clock_;
  std::string command_, value_;  // empty: it has none
  std::uint64_t counts_per_s_ = 1'000'000'000;
  std::optional<base::Duration> offset_;  // ours minus the camera's
  base::Time latched_{};
  base::Duration error_{};
};

}  // namespace rig::drivers::aravis
