// Whether the motor moves: not what a status bit says at the moment, but what bits and readback prove
// together.
//
// A status read right after a command may still be that of the motion before ("complete"), because the drive
// has acknowledged the words but not acted on them. So after a command the axis counts as moving until
// 1. the drive is known to have taken it: a bit that could not have this value before it took it (running
//    where it stood; complete, or homed, fallen or risen), or the readback has left the place it stood at, or
//    `take_ms` have passed, which the profile states as the longest that the drive needs;
// 2. then, it says that it does not run, and that the motion is complete (homing: that it is homed; or it has
//    an alarm). A drive that stops short of its target, at a limit switch say, may never say "complete":
//    after `finish_ms` without running that is believed, too;
// 3. then, the readback is at the target or has stood still for `still_ms`, each within `tolerance_counts`.
#pragma once

#include <optional>

#include "core/base/clock.h"
#include "drivers/modbus_axis/reading.h"

namespace rig::drivers::modbus {

class MotionWatch {
 public:
  explicit MotionWatch(const MotionTimes& times) : times_(times) {}

  /// A command goes to the drive; `before` is what it said before that. Called again when its last word has
  /// been acknowledged, the times count from there.
  void move(base::Time now, const Reading& before, double target_counts);
  void home(base::Time now, const Reading& before);
  void stop(base::Time now);
  /// The drive was gone: what was commanded says nothing any more.
  void forget();

  /// Of a new reading. A motion that is found over is forgotten with that.
  [[nodiscard]] bool moving(base::Time now, const Reading& reading);
  /// Homing was commanded and has not been found over.
  [[nodiscard]] bool homing() const { return command_ == Command::home; }
  /// A homing was found over that no alarm broke off, and there has been no alarm since.
  [[nodiscard]] bool homed_here() const { return homed_here_; }

 private:
  enum class Command { none, move, home, stop };
  void begin(Command command, base::Time now, const Reading& before);
  [[nodiscard]] bool runs(const Reading& reading) const;
  [[nodiscard]] bool proves_taken(const Reading& reading) const;
  [[nodiscard]] bool still(base::Time now) const;
  [[nodiscard]] bool commanded_motion(base::Time now, const Reading& reading);

  const MotionTimes times_;
  Command command_ = Command::none;
  base::Time began_{};
  Reading before_;
  double target_counts_ = 0;
  bool taken_ = false;
  std::optional<base::Time> idle_since_;
  bool homed_here_ = false;

  std::optional<double> stands_at_;
  base::Time stands_since_{};
};

}  // namespace rig::drivers::modbus
