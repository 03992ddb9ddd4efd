// A device that is gone in every state, and comes back to the same Device object.
#include <cmath>

#include "drivers/conformance/axis_session.h"
#include "drivers/conformance/check_lists.h"

namespace rig::drivers::conformance {

namespace {

using base::ErrorCode;
using std::chrono::milliseconds;
using std::chrono::seconds;

void cut(AxisSession& s) {
  if (!s.wire().cut()) not_proven("this bench cannot cut the wire");
}

void wait_until_lost(AxisSession& s, std::string_view when) {
  std::string last;
  const bool lost = s.waiting().until(
      [&] {
        const auto now = s.try_state();
        last = now ? "a state" : told(now.error());
        return !now && now.error().code == ErrorCode::lost;
      },
      kLostWithin, milliseconds(50));
  require(lost, "{}: {:.0f} s after the wire was cut state() answers {} instead of lost", when,
          base::to_seconds(kLostWithin), last);
}

// Every call says so, in time.
void require_lost(AxisSession& s, std::string_view when) {
  wait_until_lost(s, when);
  const auto lost_too = [&](const char* call, const base::Result<void>& answer) {
    require(!answer, "{}: {} succeeded with the wire cut", when, call);
    require(answer.error().code == ErrorCode::lost || answer.error().code == ErrorCode::refused,
            "{}: with the wire cut {} answered {} instead of lost", when, call, told(answer.error()));
  };
  lost_too("move_to", s.try_move(s.at(0.5)));
  lost_too("home", s.try_home());
  lost_too("stop", s.try_stop());
  const auto still = s.try_state();
  require(!still && still.error().code == ErrorCode::lost, "{}: with the wire cut state() answered {} again",
          when, still ? "a state" : told(still.error()));
}

// Answers again by itself; knows nothing that it did not read; starts nothing.
AxisState require_back(AxisSession& s, std::string_view when) {
  const bool rested = !s.peer().moving();
  const double rest = s.peer().position_rad();
  require(s.wire().restore(), "the bench cannot restore the wire that it cut");
  s.recover(fmt::format("{}, and back", when));
  require_always(!rested || (!s.peer().moving() && std::abs(s.peer().position_rad() - rest) <= s.step()),
                 "{}, and back: the device stood at {}, and its return moved it to {}", when, deg(rest),
                 deg(s.peer().position_rad()));
  s.wait_peer_stands(s.longest(s.high() - s.low()), "after the wire was restored");
  const double stands = s.peer().position_rad();
  s.require_stays(milliseconds(700), true, fmt::format("{}, and back", when));
  require(std::abs(s.peer().position_rad() - stands) <= s.step(), "{}, and back: the device moved by itself",
          when);
  AxisState now = s.wait_until_still(s.braking());
  s.require_true_at_rest(now, fmt::format("{}, and back", when));
  s.require_refusal_unless_homed(fmt::format("{}, and back", when));
  return now;
}

void require_use(AxisSession& s) {
  s.make_ready();
  s.arrive(s.at(0.25));
  s.arrive(s.at(0.75));
}

Outcome lost_at_rest(Bench& bench) {
  AxisSession s(bench);
  s.stand_at(0.4);
  for (int i = 0; i < 2; ++i) {
    cut(s);
    require_lost(s, "lost at rest");
    (void)require_back(s, "lost at rest");
    require_use(s);
  }
  return {};
}

void cut_in_a_move(AxisSession& s) {
  s.arrive(s.low());
  s.start(s.high());
  s.wait_under_way(s.low(), 0.2 * (s.high() - s.low()));
  cut(s);
}

Outcome lost_in_a_move(Bench& bench) {
  AxisSession s(bench);
  s.make_ready();
  // Back once it stands, wherever that is: it goes on nowhere.
  cut_in_a_move(s);
  wait_until_lost(s, "lost in a move");
  s.wait_peer_stands(s.longest(s.high() - s.low()), "after its wire was cut in a move");
  (void)require_back(s, "lost in a move");
  require_use(s);
  // Asked for everything meanwhile.
  cut_in_a_move(s);
  require_lost(s, "lost in a move");
  (void)require_back(s, "lost in a move");
  require_use(s);
  // Back before the move would have ended: it moves or stands, as the state says.
  cut_in_a_move(s);
  (void)s.try_state();
  (void)require_back(s, "lost for a moment in a move");
  require_use(s);
  return {};
}

Outcome lost_while_homing(Bench& bench) {
  AxisSession s(bench);
  // From power-up: had it been homed before, a false claim would tell the truth by chance.
  must(s.try_enable(true), "enable(true)");
  must(s.try_home(), "home");
  const bool under_way =
      s.waiting().until([&] { return s.peer().moving(); }, milliseconds(500), milliseconds(2));
  if (!under_way) not_proven("homing is over at once: there is nothing to lose it in");
  cut(s);
  require_lost(s, "lost while homing");
  (void)require_back(s, "lost while homing");
  require_use(s);
  return {};
}

Outcome lost_with_its_reference(Bench& bench) {
  AxisSession s(bench);
  s.stand_at(0.6);
  cut(s);
  if (!s.peer().forget_reference()) {
    if (s.capabilities().keeps_position_unpowered) does_not_concern("it always knows its position");
    not_proven("this bench cannot make the device forget where it stands");
  }
  require_lost(s, "lost with its power");
  const AxisState now = require_back(s, "lost with its power");
  require_always(!now.homed,
                 "the device lost its power and its reference, and state() says homed once it is back");
  require_use(s);
  return {};
}

Outcome absent_at_opening(Bench& bench) {
  AxisSession s(bench);
  s.stand_at(0.5);
  s.close();
  cut(s);
  require_told_or_lost(bench);
  require(s.wire().restore(), "the bench cannot restore the wire that it cut");
  s.open();
  s.recover("opened again with the device back");
  require_use(s);
  return {};
}

}  // namespace

std::vector<Check> axis_lost_checks() {
  return {{"axis: lost at rest and back", lost_at_rest},
          {"axis: lost in a move and back", lost_in_a_move},
          {"axis: lost while homing and back", lost_while_homing},
          {"axis: lost with its reference and back", lost_with_its_reference},
          {"axis: absent at opening", absent_at_opening}};
}

}  // namespace rig::drivers::conformance
