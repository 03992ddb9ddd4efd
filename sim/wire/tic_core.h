// What goes on inside a simulated Tic: errors and operation states, safe start, the command timeout, limit
// switches, homing and the motor. Tic (tic.h) puts the control transfers around it.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "sim/wire/motor.h"
#include "sim/wire/tic.h"

namespace rig::sim::wire {

/// Offsets of the settings that the simulation obeys.
namespace tic_setting {
inline constexpr std::size_t kControlMode = 0x01, kDisableSafeStart = 0x03, kIgnoreErrLine = 0x04,
                             kAutoClearDriverError = 0x08, kCommandTimeout = 0x09, kSwitchPolarity = 0x36,
                             kCurrentLimit = 0x40, kStepMode = 0x41, kDecayMode = 0x42, kStartingSpeed = 0x43,
                             kMaxSpeed = 0x47, kMaxDecel = 0x4B, kMaxAccel = 0x4F, kSoftErrorResponse = 0x53,
                             kSoftErrorPosition = 0x54, kKillSwitchMap = 0x5D, kForwardMap = 0x5F,
                             kReverseMap = 0x60, kHomingTowards = 0x61, kHomingAway = 0x65;
}  // namespace tic_setting

/// Not for several threads. Times are given; all functions but advance() speak of the time it last reached.
class TicCore {
 public:
  using Time = Tic::Time;

  enum class Operation : std::uint8_t {
    reset = 0,
    deenergized = 2,
    soft_error = 4,
    waiting_for_err_line = 6,
    starting_up = 8,
    normal = 10,
  };
  enum class Planning : std::uint8_t { off = 0, position = 1, velocity = 2 };
  enum class Input : std::uint8_t { halt = 2, position = 3, velocity = 4 };

  /// What can be overridden until the next reset; loaded from the settings.
  struct Temporary {
    std::uint8_t step_mode = 0, current_limit = 0, decay_mode = 0;
    std::uint32_t starting_speed = 0, max_speed = 0, max_decel = 0, max_accel = 0;
  };
  /// What the world does to it.
  struct Outside {
    bool forward_pressed = false, reverse_pressed = false, kill_pressed = false;
    bool driver_error = false;  ///< its cause lasts
    bool err_line_high = false;
    int vin_mv = 0;
  };

  TicCore(const TicWorld& world, const TicSettingBytes& settings, Time now);

  void advance(Time until);
  void power_up();

  // Commands.
  void set_target(Input kind, std::int32_t value);
  void halt(std::optional<std::int32_t> set_position);
  void energize(bool on);
  void exit_safe_start();
  void enter_safe_start();
  void go_home(bool forward);
  void reset_command_timeout();
  void clear_driver_error();
  void reset();
  void set_max_speed(std::uint32_t speed);
  void set_max_accel(std::uint32_t accel);
  void set_max_decel(std::uint32_t decel);

  // What it says of itself.
  [[nodiscard]] Operation operation() const { return operation_; }
  [[nodiscard]] std::uint32_t errors() const { return errors_; }
  [[nodiscard]] std::uint32_t occurred() const { return occurred_; }
  void forget_occurred() { occurred_ = 0; }
  [[nodiscard]] std::uint8_t flags();
  [[nodiscard]] bool energized() const { return coils_; }
  [[nodiscard]] bool uncertain() const { return uncertain_; }
  [[nodiscard]] Planning planning() const { return planning_; }
  [[nodiscard]] std::int32_t target() const { return target_; }
  [[nodiscard]] Input input() const { return input_; }
  [[nodiscard]] std::int32_t input_value() const { return input_value_; }
  [[nodiscard]] std::int32_t position();
  [[nodiscard]] double velocity() { return motor_.velocity(now_); }  ///< microsteps/s
  [[nodiscard]] double motor_position() { return motor_.position(now_); }
  [[nodiscard]] std::chrono::milliseconds up_time() const;
  void put_motor(double position);

  TicSettingBytes settings;
  Temporary temporary;
  Outside outside;

 private:
  enum class Homing { none, towards, waiting, away };

  void step();
  void load_settings();
  void heard();
  void watch_limits();
  void watch_errors();
  void choose_operation();
  void respond_softly();
  void advance_homing();
  void let_go();
  void halt_abruptly();
  void halt_input();
  void obey();
  void resume_planned();
  void run(std::int32_t velocity);
  void go_to(std::int32_t position);
  void run_home(std::size_t speed_at, bool forward);
  void refresh_motion();
  [[nodiscard]] Operation demanded() const;
  [[nodiscard]] bool serial_control() const;
  [[nodiscard]] bool limit(bool forward);
  [[nodiscard]] bool blocked(double direction);
  [[nodiscard]] double accel() const;
  [[nodiscard]] double decel() const;

  const TicWorld world_;
  Motor motor_;  // in microsteps from where it stood at the very first power-up
  Time now_, powered_at_{}, last_command_{}, safe_start_open_until_{}, starting_until_{}, homing_until_{};
  double offset_ = 0;  // the motor's place where the Tic's count is 0
  Operation operation_ = Operation::reset;
  std::uint32_t errors_ = 0, occurred_ = 0;
  bool deenergized_ = false, driver_error_ = false, timed_out_ = false;
  bool forced_safe_start_ = false, coils_ = false, uncertain_ = true;
  Input input_ = Input::halt;
  std::int32_t input_value_ = 0;
  Planning planning_ = Planning::off;
  std::int32_t target_ = 0;  // of the planning
  Homing homing_ = Homing::none;
  bool homing_forward_ = false;
};

}  // namespace rig::sim::wire
