// A drive of Oriental Motor's AZ or CVD kind, as a Modbus slave: numbers of 32 bits, high word first.
#pragma once

#include <chrono>
#include <map>
#include <mutex>
#include <optional>

#include "sim/wire/modbus_drive.h"
#include "sim/wire/motor.h"

namespace rig::sim::wire {

/// Direct data operation from 0x0058 on; inputs at 0x007C (START, ZHOME, STOP, FREE, ALM-RST by level or
/// edge), outputs at 0x007E, alarm at 0x0080, readback at 0x00CC, temperatures from 0x00F8. Its owner has put
/// three functions on other outputs and inputs than the factory: R-IN4 homes to the sensor, R-OUT4 says that
/// the position is known, R-OUT9 and R-OUT10 show the limit switches FW-LS and RV-LS.
///
/// A CVD has no encoder: no detected position, no temperatures, and after a power cycle it does not know
/// where it stands. How it searches home it is told: type at 0x02C1 (here with three sensors, 1, alone: the
/// other types are answered with an alarm when homing begins), direction at 0x02C3. Where its sensor lies the
/// other way it goes to the end of its travel first, and comes back.
class OrientalDrive final : public ModbusDrive {
 public:
  struct Setup {
    double home = 0;  ///< where its home sensor is, counts of its travel
    Motor::Limits travel{-100000, 100000};
    std::chrono::milliseconds reaction{0};  ///< from the trigger to the start; the outputs stay old meanwhile
    bool absolute = false;                  ///< its sensor knows the position after a power cycle, once homed
    bool cvd = false;
  };
  explicit OrientalDrive(const Setup& setup);

  [[nodiscard]] std::optional<Words> read(bool input, std::uint16_t address, std::size_t count) override;
  [[nodiscard]] std::optional<ModbusException> write(std::uint16_t address, const Words& words) override;

  [[nodiscard]] double position() override;
  [[nodiscard]] bool moving() override;
  [[nodiscard]] bool homed() override;
  [[nodiscard]] bool enabled() override;
  [[nodiscard]] int stops_seen() override;
  void set_limit(bool high, bool active) override;
  void set_alarm_cause(bool on) override;
  void power_cycle() override;
  void reset() override;

 private:
  using Time = Motor::Time;

  void power_up(Time now);
  void advance(Time now);
  void trigger(Time now);
  void start(Time now);
  void start_homing(Time now);
  void raise(std::uint32_t alarm, Time now);
  void set_inputs(std::uint16_t inputs, Time now);
  void brake(Time now);
  void refresh(Time now);
  void put_long(std::uint16_t address, std::uint32_t number);
  [[nodiscard]] std::int32_t long_at(std::uint16_t address) const;
  [[nodiscard]] bool energised() const;
  [[nodiscard]] std::uint16_t outputs(Time now);

  const Setup setup_;
  std::mutex mutex_;
  std::map<std::uint16_t, std::uint16_t> registers_;
  Motor motor_;
  double zero_ = 0;
  bool known_ = false;  ///< where it stands
  bool homing_ = false;
  bool comes_back_ = false;  ///< a search for home that has set out the other way
  std::optional<Time> due_;  ///< a triggered operation starts then
  std::uint16_t inputs_ = 0;
  bool reset_word_ = false;
  std::uint32_t alarm_ = 0;
  bool alarm_cause_ = false;
  bool low_limit_ = false, high_limit_ = false;
  int stops_ = 0;
};

}  // namespace rig::sim::wire
