// The Turner itself, at the end of a serial line: written from its protocol (share/examples/driver/protocol.h
// says it in a comment), not with the driver's code, so that a mistake of one is not repeated by the other.
#pragma once

#include <atomic>
#include <chrono>
#include <deque>
#include <filesystem>
#include <mutex>
#include <string>
#include <thread>

#include "sim/wire/motor.h"
#include "sim/wire/pty.h"

namespace rig::sim::wire {

class Turner {
 public:
  static constexpr double kCountsPerDegree = 100;

  /// The line is made at `link`.
  explicit Turner(std::filesystem::path link);
  ~Turner();
  Turner(const Turner&) = delete;
  Turner& operator=(const Turner&) = delete;

  /// How answers are spoilt on their way, and how many of the next.
  enum class Answers { right, missing, garbage, late, doubled, two_of_three };
  void spoil(Answers how, int count);
  void cut() { pty_.cut(); }
  void restore() { pty_.restore(); }

  /// As after a power cycle, at rest where it is: unhomed, and counting from 0 there.
  void power_up();
  /// At rest in the middle, switches and faults gone, the line whole, and powered up.
  void reset();
  void press_limit(bool high, bool pressed);
  void set_fault(bool on);

  /// The truth: counts from the home switch, whatever the controller believes.
  [[nodiscard]] double true_counts();
  [[nodiscard]] bool moving();
  [[nodiscard]] int stops_seen() const { return stops_; }

 private:
  struct Coming {
    std::chrono::steady_clock::time_point at;
    std::string bytes;
  };

  void serve();
  void take_in(const std::string& bytes);
  void send_due();
  /// What is answered to a request; empty: nothing.
  [[nodiscard]] std::string answer(const std::string& line);
  [[nodiscard]] std::string carry_out(const std::string& text);
  [[nodiscard]] std::string move(const std::string& text);
  [[nodiscard]] std::string report();
  void end_homing();
  void stop_motor();

  std::mutex mutex_;
  Motor motor_;
  double zero_ = 0;  // true counts where it counts 0
  bool energised_ = false, homed_ = false, homing_ = false;
  bool fault_ = false, fault_lasts_ = false;
  bool low_ = false, high_ = false;
  Answers how_ = Answers::right;
  int spoilt_ = 0;
  std::string come_;
  std::deque<Coming> coming_;
  std::atomic<int> stops_ = 0;
  std::atomic<bool> over_ = false;
  Pty pty_;
  std::thread thread_;
};

}  // namespace rig::sim::wire
