// Moves: what the axis says of itself is so, it arrives where it was sent, and says so only then.
#include <cmath>
#include <limits>

#include "drivers/conformance/axis_session.h"
#include "drivers/conformance/check_lists.h"

namespace rig::drivers::conformance {

namespace {

using base::ErrorCode;
using std::chrono::milliseconds;

void require_slow_enough(AxisSession& s, double target, double velocity, double acceleration) {
  s.require_slow_enough(target - s.peer().position_rad(), velocity, acceleration,
                        [&] { must(s.try_move(target, velocity, acceleration), "move_to"); });
}

Outcome capabilities_are_true(Bench& bench) {
  AxisSession s(bench);
  const AxisCapabilities& c = s.capabilities();
  require(c.resolution_rad > 0, "the resolution is {} rad", c.resolution_rad);
  require(c.max_velocity_rad_s > 0, "the highest velocity is {} rad/s", c.max_velocity_rad_s);
  require(c.max_acceleration_rad_s2 > 0, "the highest acceleration is {} rad/s^2", c.max_acceleration_rad_s2);
  const double room = s.high() - s.low();
  require(10 * c.resolution_rad < room, "ten steps of {} are more than the bench's {}", deg(c.resolution_rad),
          deg(room));
  s.stand_at(0.5);
  const double before = s.peer().position_rad();
  s.arrive(s.at(0.5) + 10 * c.resolution_rad);
  const double seen = s.peer().position_rad() - before;
  require(std::abs(seen - 10 * c.resolution_rad) <= 2 * c.resolution_rad,
          "ten steps are {}, the device moved by {}", deg(10 * c.resolution_rad), deg(seen));
  s.arrive(s.low());
  const double velocity = std::min(s.test().velocity_rad_s, c.max_velocity_rad_s);
  const double acceleration = std::min(s.test().acceleration_rad_s2, c.max_acceleration_rad_s2);
  require_slow_enough(s, s.high(), velocity, acceleration);
  require_slow_enough(s, s.low(), velocity / 2, acceleration);
  require_slow_enough(s, s.high(), velocity, acceleration / 2);
  return {};
}

Outcome move_arrives(Bench& bench) {
  AxisSession s(bench);
  s.stand_at(0);
  for (const double share : {1.0, 0.0, 0.3, 0.7, 0.1}) s.arrive(s.at(share));
  // A move to where it stands is over at once, too.
  s.arrive(s.at(0.1));
  return {};
}

Outcome new_target_while_moving(Bench& bench) {
  AxisSession s(bench);
  // On in the same direction, and back.
  for (const double second : {0.9, 0.1}) {
    s.stand_at(0);
    s.start(s.at(0.7));
    s.wait_under_way(s.low(), 0.15 * (s.high() - s.low()));
    const auto taken = s.try_move(s.at(second));
    if (taken) {
      s.follow_to(s.at(second));
    } else {
      require(taken.error().code == ErrorCode::busy,
              "a new target while it moves is taken over or refused as busy; it answered {}",
              told(taken.error()));
      s.follow_to(s.at(0.7));
    }
  }
  return {};
}

Outcome command_while_homing(Bench& bench) {
  AxisSession s(bench);
  s.stand_at(0.9);
  must(s.try_home(), "home");
  const bool under_way =
      s.waiting().until([&] { return s.peer().moving(); }, milliseconds(500), milliseconds(2));
  if (!under_way) not_proven("homing is over at once: there is nothing to interrupt");
  const auto taken = s.try_move(s.at(0.5));
  if (taken) {
    s.follow_to(s.at(0.5));
    s.require_true_at_rest(s.state(), "after a move that was taken while homing");
    return {};
  }
  const ErrorCode code = taken.error().code;
  require(code == ErrorCode::busy || code == ErrorCode::refused,
          "a move while homing is taken over, busy or refused; it answered {}", told(taken.error()));
  s.require_true_at_rest(s.wait_until_homed(), "after homing that was asked for a move meanwhile");
  s.arrive(s.at(0.5));
  return {};
}

Outcome disabled_drive(Bench& bench) {
  AxisSession s(bench);
  s.stand_at(0.5);
  must(s.try_enable(false), "enable(false)");
  require(!s.state().enabled, "state() says enabled after enable(false) succeeded");
  const auto moved = s.try_move(s.at(0.8));
  if (moved) {
    s.follow_to(s.at(0.8));
    require(s.state().enabled, "the axis moved, and state() says that it has no power");
  } else {
    require(moved.error().code == ErrorCode::refused || moved.error().code == ErrorCode::device,
            "without power a move is refused or a device error; it answered {}", told(moved.error()));
    s.require_stays(milliseconds(300), true, "after a move was refused for want of power");
  }
  s.make_ready();
  s.arrive(s.at(0.2));
  return {};
}

Outcome nonsense_is_refused(Bench& bench) {
  AxisSession s(bench);
  s.stand_at(0.5);
  const double v = s.test().velocity_rad_s;
  const double a = s.test().acceleration_rad_s2;
  constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
  require(!s.try_move(kNoNumber, v, a), "a move to a target that is no number was accepted");
  require(!s.try_move(std::numeric_limits<double>::infinity(), v, a), "a move for ever was accepted");
  require(!s.try_move(s.at(0.8), kNoNumber, a), "a move with a velocity that is no number was accepted");
  require(!s.try_move(s.at(0.8), v, kNoNumber), "a move with an acceleration that is no number was accepted");
  s.require_stays(milliseconds(300), true, "after moves that were refused");
  s.arrive(s.at(0.8));
  return {};
}

Outcome ended_in_a_move(Bench& bench, End end) {
  const char* const opened = end == End::closed ? "opened again" : "opened after it was killed";
  AxisSession s(bench);
  s.make_ready();
  s.end_in_a_move(end, 0.2);
  // Whether the device ends its move without us or stops: it is at rest before the next opening.
  s.wait_peer_stands(s.longest(s.high() - s.low()), "after the module ended in the middle of a move");
  s.require_stays(milliseconds(200), false, "with the module gone");
  const double stands = s.peer().position_rad();
  s.open_after(end);
  s.require_true_at_rest(s.state(), opened);
  s.require_stays(milliseconds(500), true, opened);
  require_always(std::abs(s.peer().position_rad() - stands) <= s.step(),
                 "opening moved the device from {} to {}", deg(stands), deg(s.peer().position_rad()));
  s.require_refusal_unless_homed(opened);
  s.make_ready();
  s.arrive(s.at(0.3));
  // Opened while it is still under way: it is said to move.
  s.end_in_a_move(end, 0.1);
  s.open_after(end);
  s.require_true(s.state(), fmt::format("{} in the middle of a move", opened));
  must(s.try_stop(), fmt::format("stop {}", opened));
  s.wait_peer_stands(s.braking(), "after stop");
  s.require_true_at_rest(s.wait_until_still(s.braking()), fmt::format("{} and stopped", opened));
  s.make_ready();
  s.arrive(s.at(0.3));
  return {};
}

Outcome closed_in_a_move(Bench& bench) {
  return ended_in_a_move(bench, End::closed);
}

Outcome killed_in_a_move(Bench& bench) {
  return ended_in_a_move(bench, End::killed);
}

Outcome power_cycle_while_away(Bench& bench) {
  AxisSession s(bench);
  s.stand_at(0.3);
  s.close();
  if (!s.peer().forget_reference()) {
    if (s.capabilities().keeps_position_unpowered) does_not_concern("keeps its position without power");
    not_proven("this bench cannot cycle the device's power");
  }
  s.open();
  require_always(!s.state().homed,
                 "state() says homed, and the device lost its reference while the module was closed");
  s.require_refusal_unless_homed("opened after a power cycle");
  s.make_ready();
  s.arrive(s.at(0.7));
  return {};
}

}  // namespace

std::vector<Check> axis_move_checks() {
  return {{"axis: capabilities are true", capabilities_are_true},
          {"axis: a move arrives and proves it", move_arrives},
          {"axis: a new target while moving", new_target_while_moving},
          {"axis: a command while homing", command_while_homing},
          {"axis: no move without power", disabled_drive},
          {"axis: moves that make no sense", nonsense_is_refused},
          {"axis: closed in a move and opened again", closed_in_a_move},
          {"axis: killed in a move and opened again", killed_in_a_move},
          {"axis: a power cycle while away", power_cycle_while_away}};
}

}  // namespace rig::drivers::conformance
