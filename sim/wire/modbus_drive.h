// What Modbus drives of every make have in common for a test: the switches on their case and the hand on
// their plug. Counts are the drive's own.
#pragma once

#include "sim/wire/modbus_frame.h"

namespace rig::sim::wire {

class ModbusDrive : public ModbusRegisters {
 public:
  [[nodiscard]] virtual double position() = 0;  ///< what its readback shows
  [[nodiscard]] virtual bool moving() = 0;
  [[nodiscard]] virtual bool homed() = 0;
  [[nodiscard]] virtual bool enabled() = 0;
  /// Commands to stop so far.
  [[nodiscard]] virtual int stops_seen() = 0;

  /// The limit switch on the side of higher, or lower, counts.
  virtual void set_limit(bool high, bool active) = 0;
  /// The cause of an alarm, which stays until it is taken away; the alarm itself stays until it is reset.
  virtual void set_alarm_cause(bool on) = 0;
  /// Off and on again: registers as from the factory, at rest where it stands.
  virtual void power_cycle() = 0;
  /// As delivered: power-cycled, and standing in the middle of its travel without a fault.
  virtual void reset() = 0;
};

}  // namespace rig::sim::wire
