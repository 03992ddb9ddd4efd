// A Parker Compumotor 6000 / 6K controller at the end of a serial line: ASCII commands in lines, several
// axes, answers that begin with "*" and say, at error level 4, whose they are, and prompts.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "sim/wire/answers.h"
#include "sim/wire/motor.h"
#include "sim/wire/pty.h"

namespace rig::sim::wire {

class Sixk {
 public:
  static constexpr std::size_t kMostAxes = 8;

  struct AxisSetup {
    bool servo = false;
    int resolution = 25000;          ///< counts a turn, DRES of a stepper and ERES of a servo
    int low = -60000, high = 60000;  ///< its hard stops, counts from home
    int stands_at = 0;               ///< at power-up
    int encoder_per_turn = 4000;     ///< of a stepper with one
  };
  struct Setup {
    std::filesystem::path link;
    std::vector<AxisSetup> axes{AxisSetup{}, AxisSetup{}};
    int unit = 0;  ///< its address; commands for others are not for it
    std::string revision = "92-016740-01-5.1.0 6K";
    std::chrono::milliseconds start_lag{30};  ///< after GO until the status says that it moves
    std::chrono::milliseconds lateness{300};
  };

  explicit Sixk(Setup setup);
  ~Sixk();
  Sixk(const Sixk&) = delete;
  Sixk& operator=(const Sixk&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return line_.path(); }

  /// Faults on command. Axes are counted from 1.
  void spoil(Answers::Spoil how, int answers);
  void cut() { line_.cut(); }
  void restore() { line_.restore(); }
  /// The power fails for a moment: position, homing and every setting are forgotten.
  void power_cycle();
  void press(std::size_t axis, bool high, bool pressed);
  /// The drive's fault output, until it is taken back.
  void set_drive_fault(std::size_t axis, bool on);
  /// The motor stalls on its way, or a servo strays from where it should be: bits of the status that stay
  /// until the drive is enabled again.
  void stall(std::size_t axis);
  void lose_position(std::size_t axis);
  /// No home switch is found: a search runs from one end to the other and stops.
  void hide_home(std::size_t axis, bool hidden);
  /// The encoder is turned by so many of its counts against the motor.
  void slip_encoder(std::size_t axis, int counts);
  /// As after power-up, in the middle, the wire whole and no fault.
  void make_fresh();

  /// The truth, and what has arrived.
  [[nodiscard]] double position(std::size_t axis);  ///< of the mechanics, counts from home
  [[nodiscard]] bool moving(std::size_t axis);
  [[nodiscard]] int stops(std::size_t axis);
  [[nodiscard]] bool energised(std::size_t axis);
  [[nodiscard]] std::vector<std::string> heard();  ///< the last lines, several hundred of them
  void forget_heard();

 private:
  using Time = Motor::Time;
  enum class Homing { none, seeking, turned, leaving };
  struct AxisState {
    explicit AxisState(const AxisSetup& setup);
    const AxisSetup setup;
    Motor motor;
    double offset = 0;          // of the counter: counter = mechanics - offset
    double encoder_offset = 0;  // in encoder counts
    int slip = 0;
    double distance = 0, velocity = 1, acceleration = 10, deceleration = 10;
    double home_velocity = 1, home_acceleration = 10;
    int resolution = 25000;
    int hard_limits = 3;
    bool absolute = false, continuous = false, drive = false;
    bool homed = false, stalled = false, strayed = false, faulty = false;
    bool pressed_low = false, pressed_high = false, home_hidden = false;
    Homing homing = Homing::none;
    bool homing_upwards = true;
    bool was_moving = false;
    std::optional<Time> lags_until;
    int stops = 0;
  };
  struct Reply {
    std::string text;      // behind "*"; none where empty
    bool refused = false;  // the prompt is "?"
  };

  void run();
  void step(Time now);
  void step_axis(Time now, AxisState& axis);
  void power_up(Time now);
  void line(Time now, const std::string& text);
  void execute(Time now, const std::string& command);
  [[nodiscard]] Reply obey(Time now, std::size_t axis, const std::string& name, const std::string& value);
  [[nodiscard]] Reply obey_all(Time now, const std::string& name, const std::string& value);
  [[nodiscard]] Reply go(Time now, const std::string& mask);
  [[nodiscard]] Reply home(Time now, const std::string& mask);
  void stop(Time now, const std::string& mask, bool kill);
  void answer(Time now, const std::string& name, const Reply& reply);
  void drive_off(Time now, AxisState& axis);
  /// Bits by fours: "0001_0000".
  [[nodiscard]] static std::string groups(const std::vector<bool>& bits);
  [[nodiscard]] std::string status(Time now, AxisState& axis) const;
  [[nodiscard]] double counter(Time now, AxisState& axis) const;
  [[nodiscard]] bool any_moving(Time now);

  const Setup setup_;
  Pty line_;
  std::mutex mutex_;
  Answers answers_;
  std::vector<AxisState> axes_;
  std::string input_;
  std::vector<std::string> buffered_;  // commands without "!" wait until nothing moves
  bool echo_ = true, continuous_execution_ = false;
  int error_level_ = 4;
  std::string end_ = "\r";
  std::vector<std::string> heard_;
  std::atomic<bool> quit_ = false;
  std::thread thread_;
};

}  // namespace rig::sim::wire
