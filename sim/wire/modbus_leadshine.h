// A stepper drive of Leadshine's EM2RS / CS-RS kind in PR mode, as a Modbus slave.
#pragma once

#include <chrono>
#include <map>
#include <mutex>
#include <optional>

#include "sim/wire/modbus_drive.h"
#include "sim/wire/motor.h"

namespace rig::sim::wire {

/// Path n in 8 words from 0x6200 + 8 n; 0x6002 starts a path (0x10 + n), homing (0x20), or stops (0x40); the
/// status 0x1003 and the readback 0x1014 tell. After power-up it counts from where it stands and is not
/// enabled: its enabling input is not in use, so that register 0x000F decides alone.
class LeadshineDrive final : public ModbusDrive {
 public:
  struct Setup {
    double home = 0;                        ///< where its home switch is, counts of its travel
    Motor::Limits travel{-60000, 60000};    ///< hard stops
    std::chrono::milliseconds reaction{0};  ///< from the trigger to the start; the status stays old meanwhile
    std::chrono::milliseconds energising{0};  ///< from the command to the current in the motor
  };
  explicit LeadshineDrive(const Setup& setup);

  [[nodiscard]] std::optional<Words> read(bool input, std::uint16_t address, std::size_t count) override;
  [[nodiscard]] std::optional<ModbusException> write(std::uint16_t address, const Words& words) override;
  [[nodiscard]] bool tells_bad_checksum() const override { return true; }

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
  struct Pending {
    std::uint16_t command;
    Time due;
  };

  void power_up(Time now);
  void advance(Time now);
  void carry_out(std::uint16_t command, Time now);
  void start_path(std::size_t path, Time now);
  void halt(Time now);
  [[nodiscard]] std::optional<ModbusException> command(std::uint16_t word, Time now);
  [[nodiscard]] std::optional<ModbusException> control(std::uint16_t word);
  [[nodiscard]] std::uint16_t status() const;
  [[nodiscard]] std::int32_t readback(Time now);
  [[nodiscard]] double counts_per_s(std::uint16_t rpm) const;
  [[nodiscard]] double counts_per_s2(std::uint16_t ms_per_1000rpm) const;
  [[nodiscard]] std::int32_t long_at(std::uint16_t address) const;

  const Setup setup_;
  std::mutex mutex_;
  std::map<std::uint16_t, std::uint16_t> registers_;
  Motor motor_;
  double zero_ = 0;  ///< of its counting, in counts of its travel
  std::optional<Pending> pending_;
  enum class Doing { nothing, path, homing, stopping } doing_ = Doing::nothing;
  bool command_complete_ = false, path_complete_ = false, homing_complete_ = false;
  bool energised_ = false;
  std::optional<Time> energised_by_;  ///< since then, or from then on
  bool alarm_ = false, alarm_cause_ = false;
  bool low_limit_ = false, high_limit_ = false;
  int stops_ = 0;
};

}  // namespace rig::sim::wire
