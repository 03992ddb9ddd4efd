// Moves by a distance: what a person needs to see which way an axis turns before it is homed.
#include <cmath>
#include <limits>

#include "drivers/conformance/axis_session.h"
#include "drivers/conformance/check_lists.h"

namespace rig::drivers::conformance {

namespace {

using base::ErrorCode;
using std::chrono::milliseconds;

// Of the way from low to high. The device stands in the middle.
constexpr double kJog = 0.1;
constexpr double kLongJog = 0.3;

struct Jogging {
  AxisSession& s;
  const double velocity, acceleration;
  const bool homed;  // as it was before

  [[nodiscard]] Result<void> jog(double by_rad) const { return s.try_jog(by_rad, velocity, acceleration); }

  void require_as_before(const AxisState& now, std::string_view when) const {
    require(now.fault.empty(), "{}: state() shows a fault: {}", when, now.fault);
    require(now.homed == homed, "{}: state() says {}homed, and before it said {}homed", when,
            now.homed ? "" : "not ", homed ? "" : "not ");
  }

  // Both the device and what the axis tells change by so much, and no more.
  void arrive_by(double by_rad) const {
    const std::string what = fmt::format("a jog of {}", deg(by_rad));
    const double told = s.state().position_rad;
    const double stood = s.peer().position_rad();
    s.require_slow_enough(by_rad, velocity, acceleration, [&] { must(jog(by_rad), what); });
    const AxisState end = s.state();
    s.require_true_at_rest(end, what);
    require_as_before(end, what);
    const double went = s.peer().position_rad() - stood;
    require(std::abs(went - by_rad) <= 2 * s.step(), "{}: the device went {}", what, deg(went));
    const double says = end.position_rad - told;
    require(std::abs(says - by_rad) <= 2 * s.step(), "{}: state() changed by {}", what, deg(says));
    s.require_stays(milliseconds(200), true, what);
  }

  void refuse_nonsense() const {
    constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
    constexpr double kForEver = std::numeric_limits<double>::infinity();
    const double by = kJog * (s.high() - s.low());
    require(!s.try_jog(kNoNumber, velocity, acceleration), "a jog by what is no number was accepted");
    require(!s.try_jog(kForEver, velocity, acceleration), "a jog for ever was accepted");
    require(!s.try_jog(by, kNoNumber, acceleration), "a jog with a velocity that is no number was accepted");
    require(!s.try_jog(by, velocity, kNoNumber), "a jog with an acceleration that is no number was accepted");
    s.require_stays(milliseconds(300), true, "after jogs that were refused");
  }

  void stop_under_way() const {
    const double by = kLongJog * (s.high() - s.low());
    const double from = s.peer().position_rad();
    must(jog(by), "a long jog");
    s.wait_under_way(from, 0.1 * by);
    const auto second = jog(by);
    require(!second && second.error().code == ErrorCode::busy, "a jog while it moves is busy; it {}",
            second ? "was accepted" : "answered " + told(second.error()));
    const int before = s.peer().stops_seen();
    must(s.try_stop(), "stop in a jog");
    require(s.waiting().until([&] { return s.peer().stops_seen() > before; }, s.test().stop_bound,
                              milliseconds(1)),
            "stop() in a jog returned, and no command to stop arrived on the wire");
    s.wait_peer_stands(s.braking(), "after stop() in a jog");
    const AxisState end = s.wait_until_still(s.braking());
    require_as_before(end, "after stop() in a jog");
    const double went = s.peer().position_rad() - from;
    require(went < by - s.step(), "stop() in a jog of {}: the device went {} all the same", deg(by),
            deg(went));
    s.require_stays(milliseconds(300), true, "after stop() in a jog");
  }
};

Outcome jog_before_homing(Bench& bench) {
  AxisSession s(bench);
  s.close();
  const bool forgot = s.peer().forget_reference();
  s.open();
  must(s.try_enable(true), "enable(true)");
  const AxisState found = s.wait_until_still(s.longest(s.high() - s.low()));
  require(!forgot || !found.homed, "freshly powered up, and state() says homed");
  const Jogging jogging{s, s.test().velocity_rad_s / 2, s.test().acceleration_rad_s2, found.homed};
  const double by = kJog * (s.high() - s.low());
  const auto first = jogging.jog(by);
  if (!first && first.error().code == ErrorCode::refused) {
    s.require_stays(milliseconds(300), true, "a jog was refused");
    does_not_concern("it is not moved before it is homed");
  }
  must(first, "a first jog");
  (void)s.wait_until_still(s.longest(2 * by));
  jogging.refuse_nonsense();
  jogging.arrive_by(by);
  jogging.arrive_by(-2 * by);
  // One of nothing is over at once.
  jogging.arrive_by(0);
  jogging.stop_under_way();
  s.require_refusal_unless_homed("after jogs");
  s.make_ready();
  s.arrive(s.at(0.7));
  return {};
}

}  // namespace

std::vector<Check> axis_jog_checks() {
  return {{"axis: a jog before homing", jog_before_homing}};
}

}  // namespace rig::drivers::conformance
