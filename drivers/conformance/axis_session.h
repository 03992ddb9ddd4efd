// An axis on its bench, as the checks use it.
#pragma once

#include <functional>

#include "drivers/conformance/opened.h"

namespace rig::drivers::conformance {

/// Every function fails the check where what it promises does not come true.
class AxisSession {
 public:
  /// The check does not concern a bench without an axis. Opens the module.
  explicit AxisSession(Bench& bench);

  [[nodiscard]] AxisPeer& peer() { return *test_.peer; }
  [[nodiscard]] Wire& wire() { return bench_.wire(); }
  [[nodiscard]] Axis& axis() { return opened_.device(); }
  [[nodiscard]] Waiting& waiting() { return waiting_; }
  [[nodiscard]] base::Clock& clock() { return bench_.clock(); }
  [[nodiscard]] const AxisUnderTest& test() const { return test_; }
  [[nodiscard]] const AxisCapabilities& capabilities() const { return capabilities_; }
  [[nodiscard]] double low() const { return test_.low_rad; }
  [[nodiscard]] double high() const { return test_.high_rad; }
  /// The point that lies at this share of the way from low to high.
  [[nodiscard]] double at(double share) const { return low() + share * (high() - low()); }
  /// How far two honest opinions of a position may lie apart: one step.
  [[nodiscard]] double step() const { return capabilities_.resolution_rad; }

  void close() { opened_.close(); }
  void open() { opened_.open(); }
  void open_after(End end) { end == End::closed ? opened_.open() : opened_.open_after_kill(waiting_); }
  /// The module ends when the device has gone so much of the way from low to high. It ends open to a move of
  /// its own: nobody stops it.
  void end_in_a_move(End end, double share);

  /// Energised, homed and at rest, asked for again where it is not.
  void make_ready();
  /// Ready, and standing at a share of the way.
  void stand_at(double share);

  /// The calls, each within its bound; the answer is the caller's to judge.
  [[nodiscard]] Result<void> try_move(double target_rad);
  [[nodiscard]] Result<void> try_move(double target_rad, double velocity, double acceleration);
  [[nodiscard]] Result<void> try_jog(double by_rad, double velocity, double acceleration);
  [[nodiscard]] Result<void> try_home();
  [[nodiscard]] Result<void> try_enable(bool on);
  [[nodiscard]] Result<void> try_stop();
  [[nodiscard]] Result<AxisState> try_state();

  [[nodiscard]] AxisState state();
  /// Starts a move that has to be accepted.
  void start(double target_rad);
  /// Follows a move that was accepted until the axis says that it stands; fails as soon as it says so while
  /// the device is under way or elsewhere.
  void follow_to(double target_rad);
  void arrive(double target_rad) {
    start(target_rad);
    follow_to(target_rad);
  }
  /// Until state() says that it does not move.
  AxisState wait_until_still(base::Duration within);
  /// Until homing that was started has ended well.
  AxisState wait_until_homed();
  /// Until the device itself moves, and has gone `at_least_rad` from `from_rad`.
  void wait_under_way(double from_rad, double at_least_rad);
  /// Until the device itself stands; state() is not asked.
  void wait_peer_stands(base::Duration within, std::string_view after);

  /// The state is what the device is: the position within a step where it claims to be homed, and moving
  /// where the device moved before and after the look.
  void require_true(const AxisState& state, std::string_view when);
  /// The same of a device that stands.
  void require_true_at_rest(const AxisState& state, std::string_view when);
  /// Never faster than asked, and never there sooner than velocity and acceleration allow: of a move over
  /// this distance that `start` begins.
  void require_slow_enough(double distance_rad, double velocity, double acceleration,
                           const std::function<void()>& start);
  /// The device does not move for so long, while state() is asked or not.
  void require_stays(base::Duration how_long, bool asked, std::string_view when);
  /// An axis that is not homed refuses absolute moves itself, and does not move. Nothing where it is.
  void require_refusal_unless_homed(std::string_view when);

  /// Until state() succeeds again, several times on end: what is left of spoilt answers goes by meanwhile.
  void recover(std::string_view after);

  /// The longest that a move so far may take with the bench's velocity and acceleration.
  [[nodiscard]] base::Duration longest(double distance_rad) const;
  /// Of braking from the bench's velocity.
  [[nodiscard]] base::Duration braking() const;

 private:
  Bench& bench_;
  const AxisUnderTest test_;
  Waiting waiting_;
  Opened<Axis> opened_;
  AxisCapabilities capabilities_;
};

/// In degrees, for messages.
[[nodiscard]] std::string deg(double rad);

/// From rest to rest over a distance: a trapezoid of speed, or a triangle.
[[nodiscard]] double travel_s(double distance_rad, double velocity, double acceleration);

}  // namespace rig::drivers::conformance
