// Stops: seen on the wire, in time, whatever became of the answers before.
#include <algorithm>
#include <cmath>

#include "drivers/conformance/axis_session.h"
#include "drivers/conformance/check_lists.h"

namespace rig::drivers::conformance {

namespace {

using std::chrono::milliseconds;

// Stops an axis that is under way: the command is on the wire within its bound, the device stands soon after.
// Where answers are spoilt the call may outlast the bound, waiting for one: then the command must have been
// seen by the time it returns. What stop() answers is the caller's to judge.
Result<void> stop_on_the_wire(AxisSession& s, std::string_view when, bool spoilt) {
  const int before = s.peer().stops_seen();
  const base::Duration bound = s.test().stop_bound;
  const Stopwatch watch(s.clock());
  auto answer = s.try_stop();
  const bool already = s.peer().stops_seen() > before;
  const bool seen =
      already || s.waiting().until([&] { return s.peer().stops_seen() > before; }, bound, milliseconds(1));
  const base::Duration until_seen = watch.elapsed();
  if (!seen) {
    const bool late = s.waiting().until([&] { return s.peer().stops_seen() > before; }, kLostWithin);
    require_always(late, "{}: stop() answered '{}', and no command to stop ever arrived on the wire", when,
                   answer ? "done" : told(answer.error()));
  }
  require(seen,
          "{}: stop() answered '{}', and {:.3f} s after the call no command to stop had arrived on the wire",
          when, answer ? "done" : told(answer.error()), base::to_seconds(until_seen));
  require(until_seen <= bound || (spoilt && already),
          "{}: the command to stop was seen on the wire {:.3f} s after the call; its bound is {:.3f} s", when,
          base::to_seconds(until_seen), base::to_seconds(bound));
  s.wait_peer_stands(s.braking(), "after stop()");
  return answer;
}

void start_far(AxisSession& s) {
  s.stand_at(0);
  s.start(s.high());
  s.wait_under_way(s.low(), 0.2 * (s.high() - s.low()));
}

// So slowly that it is still under way after a call that has waited for all its answers.
void start_slowly(AxisSession& s) {
  constexpr double kLasting_s = 5;
  const double range = s.high() - s.low();
  s.stand_at(0);
  const double velocity = std::min(range / kLasting_s, s.test().velocity_rad_s);
  must(s.try_move(s.high(), velocity, s.test().acceleration_rad_s2), "move_to");
  s.wait_under_way(s.low(), 0.05 * range);
}

void require_short_of(AxisSession& s, double target, std::string_view when) {
  const double at = s.peer().position_rad();
  require(std::abs(at - target) > 2 * s.step(), "{}: the device went on to its target {}", when, deg(target));
}

Outcome abort_during_a_move(Bench& bench) {
  AxisSession s(bench);
  constexpr int kTimes = 4;
  for (int i = 0; i < kTimes; ++i) {
    start_far(s);
    // As rigd sends it: right behind another transaction.
    (void)s.state();
    must(stop_on_the_wire(s, "during a move", false), "stop");
    require_short_of(s, s.high(), "stopped");
    s.require_true_at_rest(s.wait_until_still(s.braking()), "stopped");
    s.require_stays(milliseconds(300), true, "stopped");
  }
  s.make_ready();
  s.arrive(s.at(0.4));
  return {};
}

Outcome stop_at_rest(Bench& bench) {
  AxisSession s(bench);
  s.stand_at(0.6);
  const double before = s.peer().position_rad();
  for (int i = 0; i < 3; ++i) must(s.try_stop(), "stop at rest");
  s.require_stays(milliseconds(300), true, "after a stop at rest");
  require(std::abs(s.peer().position_rad() - before) <= s.step(),
          "a stop at rest moved the device from {} to {}", deg(before), deg(s.peer().position_rad()));
  const AxisState now = s.wait_until_still(s.braking());
  require(now.homed, "a stop at rest made the axis forget that it is homed");
  require(now.fault.empty(), "a stop at rest shows as a fault: {}", now.fault);
  s.arrive(s.at(0.4));
  return {};
}

Outcome stop_on_a_bad_wire(Bench& bench) {
  AxisSession s(bench);
  constexpr int kAll = 12;
  int shown = 0;
  for (const auto& [how, name] :
       {std::pair{Spoil::missing, "missing"}, std::pair{Spoil::garbage, "garbled"}}) {
    // The answer to the stop itself.
    start_slowly(s);
    if (!s.wire().spoil(how, 1)) {
      must(s.try_stop(), "stop");
      continue;
    }
    ++shown;
    (void)stop_on_the_wire(s, fmt::format("with a {} answer to the stop", name), true);
    s.recover(fmt::format("after a {} answer to a stop", name));
    require_short_of(s, s.high(), "stopped");
    // The answer to the transaction before it.
    start_slowly(s);
    (void)s.wire().spoil(how, 1);
    (void)s.try_state();
    (void)stop_on_the_wire(s, fmt::format("after a {} answer to a reading", name), true);
    s.recover(fmt::format("after a {} answer to a reading", name));
    require_short_of(s, s.high(), "stopped");
    // Nothing comes through for a while.
    start_slowly(s);
    (void)s.wire().spoil(how, kAll);
    (void)s.try_state();
    (void)stop_on_the_wire(s, fmt::format("with every answer {}", name), true);
    s.recover(fmt::format("after {} {} answers", kAll, name));
    require_short_of(s, s.high(), "stopped");
    s.require_true_at_rest(s.wait_until_still(s.braking()), "stopped on a bad wire");
  }
  if (shown == 0) not_proven("this bench cannot spoil answers");
  return {};
}

}  // namespace

std::vector<Check> axis_stop_checks() {
  return {{"axis: abort during a move", abort_during_a_move},
          {"axis: a stop at rest is harmless", stop_at_rest},
          {"axis: a stop on a bad wire", stop_on_a_bad_wire}};
}

}  // namespace rig::drivers::conformance
