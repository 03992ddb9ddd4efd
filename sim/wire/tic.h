// A Pololu Tic as its host sees it over USB: a function of control transfers, with the motor, the switches
// and the supply that hang on it. Written from the user's guide of the Tic (commands, variables, settings,
// error handling, homing); stricter than the real one with requests that are malformed, which it stalls.
//
// Where the guide leaves open what a Tic does, TicHabits chooses.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "sim/wire/usb.h"

namespace rig::sim::wire {

enum class TicProduct : std::uint16_t {
  t825 = 0x00B3,
  t834 = 0x00B5,
  t500 = 0x00BD,
  n825 = 0x00C3,
  t249 = 0x00C9,
  v36 = 0x00CB,  ///< 36v4
};

/// The settings of the Tic by their offsets, as written at the factory and then changed.
inline constexpr std::size_t kTicSettings = 0x70;
using TicSettingBytes = std::array<std::uint8_t, kTicSettings>;
[[nodiscard]] TicSettingBytes tic_factory_settings();

struct TicHabits {
  /// "Halt and hold" and "halt and set position" end a homing; else only an error does.
  bool halt_ends_homing = true;
  /// A limit switch that stops the motor makes the position uncertain.
  bool limit_makes_uncertain = false;
};

struct TicWorld {
  TicProduct product = TicProduct::t825;
  std::uint16_t firmware = 0x0106;  ///< bcdDevice
  std::string serial = "00123456";
  /// In microsteps from where the motor stands at power-up: where the switches become active, and the stops
  /// behind them.
  double reverse_switch_at = -2500, forward_switch_at = 2500;
  double reverse_stop_at = -3000, forward_stop_at = 3000;
  /// Whether switches are wired: forward to pin RX, reverse to pin TX, both closing towards low. The settings
  /// say whether the Tic looks at them.
  bool has_switches = true;
  int vin_mv = 12000;
  TicHabits habits = {};
};

/// Any thread may call anything.
class Tic {
 public:
  using Time = std::chrono::steady_clock::time_point;
  using Clock = std::function<Time()>;

  /// Powered up at this moment.
  explicit Tic(const TicWorld& world, const TicSettingBytes& settings = tic_factory_settings(),
               Clock clock = &std::chrono::steady_clock::now);
  ~Tic();
  Tic(const Tic&) = delete;
  Tic& operator=(const Tic&) = delete;

  /// A control transfer, standard requests included.
  [[nodiscard]] ControlAnswer control(const SetupPacket& setup, std::span<const std::uint8_t> out);

  // What is done to it.
  void press_limit(bool forward, bool active);  ///< beside what the motor's place does
  void press_kill_switch(bool active);          ///< pin SCL, if the settings make it one
  void set_vin_mv(int mv);
  void set_driver_error(bool lasts);  ///< overheated, say; the error stays until it is cleared
  void set_err_line(bool high);       ///< another Tic on the line has an error
  void power_cycle();
  /// The motor is turned by hand or put back, in microsteps from where it stood at power-up.
  void put_motor(double position);

  // What is so, asked beside the driver.
  [[nodiscard]] double motor_position();  ///< in microsteps from where it stood at power-up
  /// What the Tic believes, which is the motor's place but for a constant.
  [[nodiscard]] std::int32_t position();
  [[nodiscard]] double velocity();  ///< microsteps/s
  [[nodiscard]] bool position_uncertain();
  [[nodiscard]] bool energized();
  [[nodiscard]] std::uint16_t error_status();
  /// Commands so far that stop the motor: halt and hold, target velocity 0, de-energize.
  [[nodiscard]] int stops_seen();
  [[nodiscard]] int feeds_seen();  ///< "reset command timeout"
  [[nodiscard]] int setting_writes_seen();
  [[nodiscard]] TicSettingBytes settings();
  void set_settings(const TicSettingBytes& settings);  ///< as by its own tool, and reinitialized

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace rig::sim::wire
