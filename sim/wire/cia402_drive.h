// What a drive of CiA 402 does behind its object dictionary: the state machine, profile position and homing,
// and a motor that turns.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>

#include "sim/wire/canopen_dictionary.h"
#include "sim/wire/motor.h"

namespace rig::sim::wire {

/// Positions are of the mechanics, in counts; what the drive reports counts from where it believes its zero
/// is.
class Cia402Drive {
 public:
  using Time = Motor::Time;

  struct Settings {
    double start = 0;
    double low_stop = -60000, high_stop = 60000;      ///< the motor never stands beyond them
    double low_switch = -50000, high_switch = 50000;  ///< limit switches, pressed beyond them
    bool tells_limits = true;                         ///< object 60FD
    bool is_absolute = false;                         ///< the encoder keeps its zero without power
    int referenced_bit = 0;                           ///< of the statusword, a maker's own; 0: none
    bool forgets_attained = false;                    ///< homing attained is gone when the mode changes
    bool leads_back = true;                           ///< from a quick stop straight to operation enabled
    std::chrono::milliseconds transition{2};          ///< that a state takes to change
    std::chrono::milliseconds brake{10};              ///< that letting go of the brake takes
  };

  /// Adds its objects to the dictionary, which outlives it.
  Cia402Drive(const Settings& settings, CanopenDictionary& dictionary);
  Cia402Drive(const Cia402Drive&) = delete;
  Cia402Drive& operator=(const Cia402Drive&) = delete;

  /// Told of each error, and with 0 that the errors are gone.
  std::function<void(std::uint16_t code, std::uint8_t error_register)> on_emergency;

  /// The cycles up to now; also before anything is read or written.
  void tick(Time now);
  /// As freshly powered: settings as the maker left them, no reference unless the encoder is absolute.
  void power_up(Time now);
  void power_down(Time now);
  /// Whether CANopen lets it run; losing that in operation is a fault.
  void set_operational(bool operational);
  /// The controlword, however it came.
  void control(std::uint16_t controlword);

  /// Presses a limit switch by hand.
  void press_limit(bool high, bool pressed) { (high ? high_pressed_ : low_pressed_) = pressed; }
  /// A fault, whose cause lasts until cause_gone(): no reset helps before.
  void trip(std::uint16_t code, std::uint8_t error_register);
  void cause_gone() { has_cause_ = false; }
  void set_following_error(bool on) { following_error_ = on; }

  [[nodiscard]] double position() { return motor_.position(now_); }
  [[nodiscard]] bool moving() { return motor_.moving(now_); }
  /// Controlwords that ordered a quick stop, so far.
  [[nodiscard]] int stops_seen() const { return stops_; }
  [[nodiscard]] bool is_operation_enabled() const { return state_ == State::operation_enabled; }
  [[nodiscard]] std::uint16_t statusword();

 private:
  enum class State {
    not_ready,
    switch_on_disabled,
    ready,
    switched_on,
    operation_enabled,
    quick_stop,
    fault_reaction,
    fault
  };
  enum class Homing { none, seek, release, brake };
  struct SetPoint {
    std::int32_t target;
    double velocity, acceleration;
    bool at_once;
  };

  void add_objects();
  [[nodiscard]] std::int32_t reported();
  [[nodiscard]] bool low_active() { return low_pressed_ || motor_.position(now_) <= settings_.low_switch; }
  [[nodiscard]] bool high_active() { return high_pressed_ || motor_.position(now_) >= settings_.high_switch; }
  [[nodiscard]] bool stands() { return !motor_.moving(now_); }
  [[nodiscard]] double quick_deceleration();

  void go(State to, std::chrono::milliseconds takes);
  void step_state();
  void begin_quick_stop();
  void leave_operation();
  void step_mode();
  void step_set_points();
  void apply(const SetPoint& set_point);
  void keep_limits();
  void start_homing();
  void step_homing();
  [[nodiscard]] double edge_passed(bool low);
  void end_homing(bool attained);

  const Settings settings_;
  CanopenDictionary& objects_;
  Motor motor_;
  Time now_{};
  double zero_ = 0;
  bool knows_zero_ = false;

  State state_ = State::not_ready;
  std::optional<State> to_;
  Time until_{};
  bool is_operational_ = false;
  std::uint16_t control_ = 0;
  int stops_ = 0;

  std::int8_t mode_ = 0;
  std::optional<SetPoint> offered_, next_, active_;
  bool taken_ = false, reached_ = true, limited_ = false, halted_ = false;
  Homing homing_ = Homing::none;
  bool attained_ = false, homing_error_ = false;

  bool low_pressed_ = false, high_pressed_ = false;
  bool following_error_ = false;
  bool has_cause_ = false;
  std::uint16_t error_ = 0;
};

}  // namespace rig::sim::wire
