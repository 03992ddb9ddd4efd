// Homing, and what an axis that does not know where it stands must not do.
#include "drivers/conformance/axis_session.h"
#include "drivers/conformance/check_lists.h"

namespace rig::drivers::conformance {

namespace {

using base::ErrorCode;
using std::chrono::milliseconds;

Outcome homing(Bench& bench) {
  AxisSession s(bench);
  const AxisState found = s.state();
  must(s.try_enable(true), "enable(true)");
  const auto begun = s.try_home();
  if (!begun && begun.error().code == ErrorCode::refused && found.homed &&
      s.capabilities().keeps_position_unpowered) {
    does_not_concern("an axis that always knows its position does not home");
  }
  must(begun, "home");
  const bool homed = s.waiting().until(
      [&] {
        const AxisState now = s.state();
        require(now.fault.empty(), "while homing state() shows a fault: {}", now.fault);
        const bool claims = now.homed && !now.moving;
        // Asked after state(): what was over then is over now.
        require_always(!claims || !s.peer().moving(),
                       "state() says homed and not moving while the device moves, at {}",
                       deg(s.peer().position_rad()));
        return claims;
      },
      std::chrono::seconds(60));
  require(homed, "homing has not ended after 60 s");
  s.require_true_at_rest(s.state(), "homed");
  s.require_stays(milliseconds(300), true, "homed");
  s.arrive(s.at(0.3));
  // A second time, from elsewhere.
  must(s.try_home(), "home a second time");
  s.require_true_at_rest(s.wait_until_homed(), "homed a second time");
  s.arrive(s.at(0.6));
  return {};
}

Outcome refusal_before_homing(Bench& bench) {
  AxisSession s(bench);
  s.close();
  if (!s.peer().forget_reference()) {
    if (s.capabilities().keeps_position_unpowered) does_not_concern("it always knows its position");
    not_proven("this bench cannot make the device forget where it stands");
  }
  s.open();
  require_always(!s.state().homed, "freshly powered up, and state() says homed");
  must(s.try_enable(true), "enable(true)");
  s.require_refusal_unless_homed("never homed");
  // Homed once, then its power fails for a moment while the driver looks on.
  s.stand_at(0.4);
  require(s.peer().forget_reference(), "the bench cannot cycle the power a second time");
  const bool noticed = s.waiting().until(
      [&] {
        const auto now = s.try_state();
        return now && !now->homed;
      },
      kShownWithin);
  require(noticed, "{:.0f} s after a power cycle state() still says homed", base::to_seconds(kShownWithin));
  s.require_refusal_unless_homed("after a power cycle");
  s.make_ready();
  s.arrive(s.at(0.7));
  return {};
}

Outcome abort_of_homing(Bench& bench) {
  AxisSession s(bench);
  s.stand_at(0.9);
  must(s.try_home(), "home");
  const bool under_way =
      s.waiting().until([&] { return s.peer().moving(); }, milliseconds(500), milliseconds(2));
  if (!under_way) not_proven("homing is over at once: there is nothing to abort");
  const int before = s.peer().stops_seen();
  must(s.try_stop(), "stop while homing");
  require(
      s.waiting().until([&] { return s.peer().stops_seen() > before; }, s.test().stop_bound, milliseconds(1)),
      "stop() while homing returned, and no command to stop arrived on the wire");
  s.wait_peer_stands(s.braking(), "after stop() while homing");
  const AxisState end = s.wait_until_still(s.braking());
  require_always(!end.homed, "homing was stopped half way, and state() says homed");
  s.require_stays(milliseconds(500), true, "homing stopped");
  require_always(!s.state().homed, "homing was stopped half way, and state() says homed later on");
  s.require_refusal_unless_homed("homing stopped half way");
  s.make_ready();
  s.arrive(s.at(0.5));
  return {};
}

}  // namespace

std::vector<Check> axis_reference_checks() {
  return {{"axis: homing", homing},
          {"axis: refusal before homing", refusal_before_homing},
          {"axis: abort of homing", abort_of_homing}};
}

}  // namespace rig::drivers::conformance
