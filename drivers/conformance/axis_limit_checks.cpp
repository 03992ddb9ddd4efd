// Limit switches and faults of the drive itself.
#include <algorithm>
#include <cmath>

#include "drivers/conformance/axis_session.h"
#include "drivers/conformance/check_lists.h"

namespace rig::drivers::conformance {

namespace {

using std::chrono::milliseconds;

// How far a device may go on into a limit switch: it hardly starts.
double no_travel(const AxisSession& s) {
  return std::max(2 * s.step(), 0.002 * (s.high() - s.low()));
}

void wait_for_limit(AxisSession& s, bool high, bool active) {
  const char* side = high ? "high" : "low";
  AxisState now;
  const bool shown = s.waiting().until(
      [&] {
        now = s.state();
        return (high ? now.at_high_limit : now.at_low_limit) == active;
      },
      kShownWithin);
  require(shown, "the switch at the {} side is {}, and {:.0f} s later state() does not say so", side,
          active ? "pressed" : "free", base::to_seconds(kShownWithin));
  require(!active || !(high ? now.at_low_limit : now.at_high_limit),
          "the switch at the {} side is pressed, and state() says that the other one is, too", side);
}

// Out of a limit, which some drives want acknowledged first.
void move_out(AxisSession& s, double target) {
  auto out = s.try_move(target);
  if (!out) {
    must(s.try_enable(true), "enable(true) at a limit");
    out = s.try_move(target);
  }
  must(out, "a move out of a pressed limit switch");
  const base::Duration within = s.longest(s.high() - s.low());
  const bool there = s.waiting().until(
      [&] {
        const AxisState now = s.state();
        return !now.moving && std::abs(s.peer().position_rad() - target) <= 2 * s.step();
      },
      within);
  require(there, "a move out of a pressed limit switch to {} ended at {}", deg(target),
          deg(s.peer().position_rad()));
}

void at_rest_into(AxisSession& s, bool high) {
  const char* side = high ? "high" : "low";
  s.stand_at(0.5);
  (void)s.peer().set_limit(high, true);
  wait_for_limit(s, high, true);
  const double from = s.peer().position_rad();
  const auto further = s.try_move(high ? s.high() : s.low());
  (void)s.waiting().until(
      [&] {
        const double gone = high ? s.peer().position_rad() - from : from - s.peer().position_rad();
        require(gone <= no_travel(s),
                "the switch at the {} side is pressed, and a move into it went on by {}", side, deg(gone));
        return false;
      },
      milliseconds(700));
  require(!s.state().moving, "a move into the pressed switch at the {} side {}, and state() says moving",
          side, further ? "was accepted" : "was refused");
  move_out(s, s.at(high ? 0.3 : 0.7));
  (void)s.peer().set_limit(high, false);
  wait_for_limit(s, high, false);
}

void in_a_move_into(AxisSession& s, bool high) {
  const char* side = high ? "high" : "low";
  s.stand_at(high ? 0 : 1);
  const double from = s.peer().position_rad();
  const double target = high ? s.high() : s.low();
  s.start(target);
  s.wait_under_way(from, 0.2 * (s.high() - s.low()));
  (void)s.peer().set_limit(high, true);
  s.wait_peer_stands(s.braking(), "after its limit switch was pressed");
  require(std::abs(s.peer().position_rad() - target) > 2 * s.step(),
          "the switch at the {} side was pressed in the middle of a move, and it went on to its end", side);
  const AxisState end = s.wait_until_still(s.braking());
  wait_for_limit(s, high, true);
  s.require_true_at_rest(end, "stopped by a limit switch");
  s.require_stays(milliseconds(300), true, "stopped by a limit switch");
  move_out(s, from);
  (void)s.peer().set_limit(high, false);
  wait_for_limit(s, high, false);
}

Outcome limits(Bench& bench) {
  AxisSession s(bench);
  if (!s.peer().set_limit(true, false) || !s.peer().set_limit(false, false)) {
    if (!s.capabilities().has_limit_switches) does_not_concern("no limit switches");
    not_proven("this bench cannot press a limit switch");
  }
  require(s.capabilities().has_limit_switches, "the device has limit switches, and the capabilities deny it");
  for (const bool high : {true, false}) {
    at_rest_into(s, high);
    in_a_move_into(s, high);
  }
  s.make_ready();
  s.arrive(s.at(0.5));
  return {};
}

void wait_for_fault(AxisSession& s, bool shown, std::string_view when) {
  AxisState now;
  const bool so = s.waiting().until(
      [&] {
        now = s.state();
        return now.fault.empty() != shown;
      },
      kShownWithin);
  require(so, "{}: {:.0f} s later state() {}", when, base::to_seconds(kShownWithin),
          shown ? std::string("shows no fault") : "still shows the fault " + now.fault);
}

Outcome drive_fault(Bench& bench) {
  AxisSession s(bench);
  if (!s.peer().reports_faults()) does_not_concern("such a device reports no fault of its own");
  s.stand_at(0.2);
  if (!s.peer().set_fault(true)) not_proven("this bench cannot make the drive report a fault");
  wait_for_fault(s, true, "the drive has a fault");
  const double from = s.peer().position_rad();
  const auto moved = s.try_move(s.at(0.8));
  s.require_stays(milliseconds(500), true, "with a fault of the drive");
  require(!moved || !s.state().fault.empty(),
          "a move was accepted with a fault of the drive, and the fault is gone");
  // Its cause lasts: nobody can acknowledge it away.
  (void)s.try_enable(true);
  s.waiting().pause(milliseconds(300));
  wait_for_fault(s, true, "enable(true) while the cause of the fault lasts");
  (void)s.peer().set_fault(false);
  must(s.try_enable(true), "enable(true) once the cause of the fault is gone");
  wait_for_fault(s, false, "enable(true) once the cause of the fault is gone");
  require(std::abs(s.peer().position_rad() - from) <= 2 * s.step(),
          "acknowledging the fault moved the device from {} to {}", deg(from), deg(s.peer().position_rad()));
  s.stand_at(0);
  // And in the middle of a move.
  s.start(s.high());
  s.wait_under_way(s.low(), 0.2 * (s.high() - s.low()));
  (void)s.peer().set_fault(true);
  wait_for_fault(s, true, "a fault of the drive in the middle of a move");
  s.wait_peer_stands(s.braking(), "after a fault of the drive");
  require(!s.wait_until_still(s.braking()).fault.empty(),
          "the fault is no longer shown once the axis stands");
  (void)s.peer().set_fault(false);
  must(s.try_enable(true), "enable(true) after a fault in the middle of a move");
  wait_for_fault(s, false, "enable(true) after a fault in the middle of a move");
  s.require_stays(milliseconds(300), true, "after a fault was acknowledged");
  s.make_ready();
  s.arrive(s.at(0.6));
  return {};
}

}  // namespace

std::vector<Check> axis_limit_checks() {
  return {{"axis: limits from both sides", limits}, {"axis: a fault of the drive", drive_fault}};
}

}  // namespace rig::drivers::conformance
