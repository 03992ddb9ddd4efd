// A Directed Perception / FLIR pan-tilt unit at the end of a serial line, as its manuals describe it: ASCII
// commands that end with a space or a carriage return, an echo and wordy replies until it is told otherwise,
// a reset that runs both axes into their end stops, and "!P" or "!T" whenever an axis hits one.
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

class Ptu {
 public:
  enum AxisName : std::size_t { pan = 0, tilt = 1 };

  struct AxisSetup {
    std::string resolution = "185.1428";  ///< seconds of arc a position, as it prints it
    int low = -3090, high = 3090;         ///< its end stops, positions from the middle
    int stands_at = 0;                    ///< at power-up
  };
  struct Setup {
    std::filesystem::path link;
    std::array<AxisSetup, 2> axes{AxisSetup{}, AxisSetup{"185.1428", -907, 604, 0}};
    std::string resolution_words = " seconds arc per Pan position";  ///< when wordy; a D300 leaves out "Pan"
    std::string line_end = "\r\n";
    std::string banner = "\r\n\r\n### PAN-TILT CONTROLLER\r\n### v3.3.0\r\nInitializing...*\r\n";
    double reset_speed = 20000;  ///< positions a second
    bool resets_at_power_up = false;
    bool halt_ends_reset = true;            ///< else it hears nothing until a reset is over
    bool one_axis_at_once = false;          ///< RP and RT reset at once; else they say what R resets
    std::chrono::milliseconds tables{100};  ///< a new acceleration, base or upper speed takes so long
    bool says_done_first = false;           ///< its reply to one comes before that time, not after it
    std::chrono::milliseconds lateness{300};
  };

  explicit Ptu(Setup setup);
  ~Ptu();
  Ptu(const Ptu&) = delete;
  Ptu& operator=(const Ptu&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return line_.path(); }

  /// Faults on command.
  void spoil(Answers::Spoil how, int answers);
  void cut() { line_.cut(); }
  void restore() { line_.restore(); }
  /// The power fails for a moment: its position, its reference and what was not saved are forgotten.
  void power_cycle();
  /// As the command DS: echo and wordiness are after a power cycle as they are now.
  void save_modes();
  /// Somebody else at the unit sends an axis somewhere, at its slow speed.
  void nudge(std::size_t axis, int target);
  /// An end stop that is hit before its place, on the side of high positions or of low ones.
  void press(std::size_t axis, bool high, bool pressed);
  /// The next reset ends with an error.
  void fail_next_reset();
  void set_temperature_degF(int degrees);
  /// As after power-up, at rest in the middle, the wire whole and no fault.
  void make_fresh();

  /// The truth, and what has arrived.
  [[nodiscard]] double position(std::size_t axis);  ///< of the mechanics, positions from the middle
  [[nodiscard]] bool moving(std::size_t axis);
  [[nodiscard]] int halts(std::size_t axis);       ///< commands to halt this axis so far
  [[nodiscard]] std::vector<std::string> heard();  ///< the last commands, several hundred of them
  void forget_heard();

 private:
  using Time = Motor::Time;
  enum class Limits { factory, user, off };
  struct AxisState {
    explicit AxisState(const AxisSetup& setup);
    const AxisSetup setup;
    Motor motor;
    double offset = 0;   // of the counter from the mechanics: counter = mechanics - offset
    double desired = 0;  // in the counter's terms
    int speed = 1000, base = 57, slowest = 31, fastest = 2902, acceleration = 2000;
    int low = 0, high = 0, user_low = 0, user_high = 0;  // as a reset found them, and the user's
    char hold = 'L';
    bool pressed_low = false, pressed_high = false;
    bool was_moving = false;
    int halts = 0;
  };
  struct Reset {
    std::vector<std::size_t> axes;  // still to do, the first one being done
    int leg = 0;                    // to the low stop, to the high one, to the middle
    bool asked = true;              // the reply is owed to somebody
  };

  void run();
  void step(Time now);
  void step_motors(Time now);
  void step_reset(Time now);
  void begin_reset(Time now, std::vector<std::size_t> axes, bool asked);
  void start_leg(Time now);
  void halt(Time now, std::size_t axis);
  void take_halts_out_of_reset(Time now);
  void power_up(Time now);
  void command(Time now, const std::string& text);
  void general(Time now, const std::string& text);
  void for_axis(Time now, std::size_t axis, const std::string& what, std::optional<int> value);
  void go_to(Time now, std::size_t axis, int target);
  void fine(Time now, const std::string& text = {});
  void refuse(Time now, const std::string& why);
  void number(Time now, const std::string& words, const std::string& value, const std::string& after = {});
  [[nodiscard]] int counter(Time now, AxisState& axis) const;
  [[nodiscard]] bool deaf(Time now) const { return reset_.has_value() || now < busy_until_; }

  const Setup setup_;
  Pty line_;
  std::mutex mutex_;
  Answers answers_;
  std::array<AxisState, 2> axes_;
  std::string input_;
  bool echo_ = true, wordy_ = true, saved_echo_ = true, saved_wordy_ = true;
  Limits limits_ = Limits::factory;
  std::vector<std::size_t> resets_{tilt, pan};  // what R resets
  std::optional<Reset> reset_;
  bool reset_fails_ = false;
  bool awaiting_ = false;
  Time busy_until_{};
  bool owes_reply_ = false;
  int degF_ = 86;
  std::vector<std::string> heard_;
  std::atomic<bool> quit_ = false;
  std::thread thread_;
};

}  // namespace rig::sim::wire
