// A motor as a drive turns it: trapezoidal moves in real time, in the drive's own counts.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

namespace rig::sim::wire {

/// Not for several threads: its device's lock guards it. Times are given, so that tests need not wait.
class Motor {
 public:
  using Time = std::chrono::steady_clock::time_point;

  struct Limits {
    double low, high;  ///< hard stops, counts: it never stands beyond them
  };
  Motor(double position, Limits limits) : position_(position), limits_(limits) {}

  /// From wherever it is, at whatever speed, to `target`: at most `velocity` (counts/s), changing by
  /// `acceleration` (counts/s^2). A move under way is replaced; it brakes first where it must turn round.
  void move_to(Time now, double target, double velocity, double acceleration);
  /// Turns on at a constant velocity (signed) until told otherwise or a hard stop.
  void run(Time now, double velocity, double acceleration);
  /// Brakes to rest with `deceleration`.
  void stop(Time now, double deceleration);
  /// At rest at once: power is off, or a position is set.
  void put(Time now, double position);

  [[nodiscard]] double position(Time now);
  [[nodiscard]] double velocity(Time now);
  [[nodiscard]] bool moving(Time now);
  /// Where the last move goes, or where it stands.
  [[nodiscard]] double target() const { return target_; }
  [[nodiscard]] const Limits& limits() const { return limits_; }

 private:
  void advance(Time now);

  double position_;
  Limits limits_;
  double speed_ = 0;
  double target_ = 0;
  double cruise_ = 0;
  double acceleration_ = 1;
  enum class Mode { rest, move, run, stop } mode_ = Mode::rest;
  std::optional<Time> at_;
};

}  // namespace rig::sim::wire
