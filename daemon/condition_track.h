// What keeps a job from going on, and since when. daemon/conditions.cpp has the table.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "core/base/clock.h"

namespace rig::daemon {

enum class Condition {
  emergency_stop,
  stopped,
  device_lost,
  light,
  disk,
  temperature,
  held,
  sample_change,
  reference,
  room_not_dark,
};
inline constexpr std::size_t kConditionCount = 10;

struct ConditionTrack {
  bool on = false;
  base::Time since{};                 ///< it is on
  std::optional<base::Time> turning;  ///< since when its signal says the opposite of `on`
  std::string reason;                 ///< of the last time it came on
  bool limit_passed = false;
  double limit_s = 0;  ///< longest that it may last, rig time
};

}  // namespace rig::daemon
