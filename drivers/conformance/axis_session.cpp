#include "drivers/conformance/axis_session.h"

#include <cmath>

#include "core/base/units.h"

namespace rig::drivers::conformance {

using base::ErrorCode;
using base::seconds;

namespace {

constexpr base::Duration kHomedWithin = std::chrono::seconds(60);
// A stepper's own rounding of a position that was commanded exactly.
constexpr double kLastBits_rad = 1e-9;
// Speeds are judged with this much room: a drive rounds its ramps to its own clock.
constexpr double kSpeedRoom = 1.05;

AxisUnderTest axis_of(Bench& bench) {
  auto test = bench.axis();
  if (!test) does_not_concern("no axis");
  require(test->peer != nullptr && test->low_rad < test->high_rad && test->velocity_rad_s > 0 &&
              test->acceleration_rad_s2 > 0,
          "the bench does not say how its axis is to be moved");
  return *test;
}

}  // namespace

std::string deg(double rad) {
  return fmt::format("{:.6g} deg", rad * 180 / base::kPi);
}

double travel_s(double distance_rad, double velocity, double acceleration) {
  const double distance = std::abs(distance_rad);
  if (distance * acceleration < velocity * velocity) return 2 * std::sqrt(distance / acceleration);
  return distance / velocity + velocity / acceleration;
}

AxisSession::AxisSession(Bench& bench)
    : bench_(bench), test_(axis_of(bench)), waiting_(bench.clock()), opened_(bench, test_.device) {
  capabilities_ = axis().capabilities();
}

base::Duration AxisSession::longest(double distance_rad) const {
  constexpr double kSpare_s = 2;
  return seconds(1.5 * travel_s(distance_rad, test_.velocity_rad_s, test_.acceleration_rad_s2) + kSpare_s);
}

base::Duration AxisSession::braking() const {
  constexpr double kSpare_s = 1;
  return seconds(1.5 * test_.velocity_rad_s / test_.acceleration_rad_s2 + kSpare_s);
}

Result<void> AxisSession::try_move(double target_rad) {
  return try_move(target_rad, test_.velocity_rad_s, test_.acceleration_rad_s2);
}

Result<void> AxisSession::try_move(double target_rad, double velocity, double acceleration) {
  return timed(clock(), kAxisCall, "move_to",
               [&] { return axis().move_to(target_rad, velocity, acceleration); });
}

Result<void> AxisSession::try_jog(double by_rad, double velocity, double acceleration) {
  return timed(clock(), kAxisCall, "move_by", [&] { return axis().move_by(by_rad, velocity, acceleration); });
}

Result<void> AxisSession::try_home() {
  return timed(clock(), kAxisCall, "home", [&] { return axis().home(); });
}

Result<void> AxisSession::try_enable(bool on) {
  return timed(clock(), kAxisCall, "enable", [&] { return axis().enable(on); });
}

Result<void> AxisSession::try_stop() {
  return timed(clock(), kAxisCall, "stop", [&] { return axis().stop(); });
}

Result<AxisState> AxisSession::try_state() {
  return timed(clock(), kAxisCall, "state", [&] { return axis().state(); });
}

AxisState AxisSession::state() {
  return must(try_state(), "state");
}

void AxisSession::start(double target_rad) {
  must(try_move(target_rad), fmt::format("move_to {}", deg(target_rad)));
}

AxisState AxisSession::wait_until_still(base::Duration within) {
  AxisState now;
  const bool still = waiting_.until(
      [&] {
        now = state();
        return !now.moving;
      },
      within);
  require(still, "after {:.1f} s state() still says that the axis moves, at {}", base::to_seconds(within),
          deg(now.position_rad));
  return now;
}

AxisState AxisSession::wait_until_homed() {
  AxisState now;
  const bool homed = waiting_.until(
      [&] {
        now = state();
        require(now.fault.empty(), "while homing state() shows a fault: {}", now.fault);
        return now.homed && !now.moving;
      },
      kHomedWithin);
  require(homed, "{:.0f} s after home() state() says {}homed and {}moving, at {}",
          base::to_seconds(kHomedWithin), now.homed ? "" : "not ", now.moving ? "" : "not ",
          deg(now.position_rad));
  return now;
}

void AxisSession::make_ready() {
  AxisState now = wait_until_still(longest(high() - low()));
  require(now.fault.empty(), "the axis shows a fault where the device has none: {}", now.fault);
  must(try_enable(true), "enable(true)");
  now = state();
  require(now.enabled, "state() says not enabled after enable(true) succeeded");
  if (!now.homed) {
    must(try_home(), "home");
    now = wait_until_homed();
  }
  require_true_at_rest(now, "after homing");
}

void AxisSession::stand_at(double share) {
  make_ready();
  arrive(at(share));
}

void AxisSession::end_in_a_move(End end, double share) {
  const double gone = share * (high() - low());
  if (end == End::killed) {
    const auto victim =
        opened_.start_victim(MoveTask{low(), high(), test_.velocity_rad_s, test_.acceleration_rad_s2});
    wait_under_way(low(), gone);
    victim->kill();
    return;
  }
  arrive(low());
  start(high());
  wait_under_way(low(), gone);
  close();
}

void AxisSession::follow_to(double target_rad) {
  const base::Duration within = longest(state().position_rad - target_rad);
  const AxisState end = wait_until_still(within);
  // Asked after state(): what said "stands" first must stand now as well.
  const bool moving = peer().moving();
  const double truth = peer().position_rad();
  require_always(!moving, "state() says that the move to {} is over while the device is moving, at {}",
                 deg(target_rad), deg(truth));
  require(std::abs(end.position_rad - target_rad) <= step() + kLastBits_rad,
          "the move to {} ended at {} by state(): {} apart, a step is {}", deg(target_rad),
          deg(end.position_rad), deg(end.position_rad - target_rad), deg(step()));
  require(std::abs(truth - target_rad) <= step() + kLastBits_rad,
          "the move to {} ended, and the device stands at {}: {} apart, a step is {}", deg(target_rad),
          deg(truth), deg(truth - target_rad), deg(step()));
  require(end.fault.empty(), "after the move to {} state() shows a fault: {}", deg(target_rad), end.fault);
}

void AxisSession::wait_under_way(double from_rad, double at_least_rad) {
  const bool off = waiting_.until(
      [&] { return peer().moving() && std::abs(peer().position_rad() - from_rad) >= at_least_rad; },
      longest(high() - low()), std::chrono::milliseconds(2));
  require(off, "the device did not set off: it is at {}, {} from where it stood", deg(peer().position_rad()),
          deg(peer().position_rad() - from_rad));
}

void AxisSession::wait_peer_stands(base::Duration within, std::string_view after) {
  const bool stands = waiting_.until([&] { return !peer().moving(); }, within, std::chrono::milliseconds(2));
  require(stands, "{:.1f} s {} the device still moves, at {}", base::to_seconds(within), after,
          deg(peer().position_rad()));
}

void AxisSession::require_true(const AxisState& now, std::string_view when) {
  if (peer().moving()) return;  // its position changes between the two looks
  if (now.moving) {
    // It may have come to rest between the two looks: then the next look says so.
    const AxisState next = state();
    require(!next.moving, "{}: state() says moving, and the device stands at {}", when,
            deg(peer().position_rad()));
    return require_true_at_rest(next, when);
  }
  require_true_at_rest(now, when);
}

void AxisSession::require_true_at_rest(const AxisState& now, std::string_view when) {
  require(!now.moving, "{}: state() says moving, and the device stands at {}", when,
          deg(peer().position_rad()));
  require_always(!peer().moving(), "{}: state() says not moving, and the device moves, at {}", when,
                 deg(peer().position_rad()));
  if (!now.homed) return;  // its position means nothing yet
  const double truth = peer().position_rad();
  require_always(std::abs(now.position_rad - truth) <= step() + kLastBits_rad,
                 "{}: state() says homed and at {}, and the device stands at {}: {} apart, a step is {}",
                 when, deg(now.position_rad), deg(truth), deg(now.position_rad - truth), deg(step()));
}

void AxisSession::require_slow_enough(double distance_rad, double velocity, double acceleration,
                                      const std::function<void()>& start) {
  struct Look {
    base::Time before, after;
    double at;
  };
  const auto look = [&] {
    const base::Time before = waiting_.now();
    const double at = peer().position_rad();
    return Look{before, waiting_.now(), at};
  };
  const double distance = std::abs(distance_rad);
  const base::Time began = waiting_.now();
  Look last = look();
  start();
  const double shortest_s = travel_s(distance, velocity, acceleration) / kSpeedRoom;
  double fastest = 0;
  const bool over = waiting_.until(
      [&] {
        const bool moves = state().moving;
        const Look now = look();
        // The longest time that can lie between the two positions: speed is never overrated.
        const double apart_s = base::to_seconds(now.after - last.before);
        if (apart_s > 0.1) {
          fastest = std::max(fastest, (std::abs(now.at - last.at) - step()) / apart_s);
          last = now;
        }
        return !moves;
      },
      seconds(2 * travel_s(distance, velocity, acceleration) + 2));
  require(over, "a move of {} with {}/s has not ended", deg(distance), deg(velocity));
  const double took_s = base::to_seconds(waiting_.now() - began);
  require(fastest <= velocity * kSpeedRoom, "asked for at most {}/s, the device moves with {}/s",
          deg(velocity), deg(fastest));
  require(took_s >= shortest_s,
          "a move of {} with at most {}/s and {}/s^2 takes {:.3f} s at least, and was over after {:.3f} s",
          deg(distance), deg(velocity), deg(acceleration), shortest_s, took_s);
}

void AxisSession::require_stays(base::Duration how_long, bool asked, std::string_view when) {
  const double from = peer().position_rad();
  const bool left = waiting_.until(
      [&] {
        if (asked) (void)try_state();
        return peer().moving() || std::abs(peer().position_rad() - from) > step() + kLastBits_rad;
      },
      how_long);
  require_always(!left, "{}: the device moves by itself, from {} to {}", when, deg(from),
                 deg(peer().position_rad()));
}

void AxisSession::recover(std::string_view after) {
  constexpr int kOnEnd = 3;
  int fine = 0;
  std::string last = "nothing";
  const bool back = waiting_.until(
      [&] {
        const auto now = try_state();
        if (!now) last = told(now.error());
        fine = now ? fine + 1 : 0;
        return fine >= kOnEnd;
      },
      kBackWithin, std::chrono::milliseconds(50));
  require(back, "{}: {:.0f} s later state() still answers {}", after, base::to_seconds(kBackWithin), last);
}

void AxisSession::require_refusal_unless_homed(std::string_view when) {
  const AxisState now = state();
  if (now.homed || capabilities_.keeps_position_unpowered) return;
  const double from = peer().position_rad();
  const double target = std::abs(from - low()) > std::abs(from - high()) ? low() : high();
  const auto refused = [&](bool powered) {
    const auto moved = try_move(target);
    require_always(!moved, "{}: not homed, and move_to was accepted", when);
    const ErrorCode code = moved.error().code;
    require(code == ErrorCode::refused || (!powered && code == ErrorCode::device),
            "{}: not homed, and move_to answered {} instead of refused", when, told(moved.error()));
    require_stays(std::chrono::milliseconds(300), false, when);
  };
  // A drive without power may say that first.
  refused(now.enabled);
  if (now.enabled) return;
  must(try_enable(true), fmt::format("enable(true) {}", when));
  if (!state().homed) refused(true);
}

}  // namespace rig::drivers::conformance
