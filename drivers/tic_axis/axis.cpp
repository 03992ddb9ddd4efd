#include "drivers/tic_axis/axis.h"

#include <cstdlib>
#include <limits>
#include <thread>

namespace rig::drivers::tic {

using base::ErrorCode;
using base::fail;
using base::LogLevel;
using base::pass;
using base::Result;
using std::chrono::milliseconds;

namespace {

constexpr milliseconds kLook{2};
constexpr milliseconds kStartsWithin{100};  // the guide: 10 ms; safe start stays open for 200
constexpr milliseconds kHaltsWithin{30};

// Reads until `there` or until the time is over; the last reading.
template <typename There>
Result<Variables> read_until(Link& link, milliseconds within, There&& there) {
  const Deadline deadline = std::min<Deadline>(std::chrono::steady_clock::now() + within, link.call_ends());
  while (true) {
    auto now = link.variables();
    if (!now || there(*now) || std::chrono::steady_clock::now() >= deadline) return now;
    std::this_thread::sleep_for(kLook);
  }
}

bool turns(const Variables& now) {
  return now.velocity != 0 || now.homing;
}

// The direction in which the motor is planned to turn from here: -1, 0 or 1.
int planned_direction(const Variables& now) {
  if (now.planning == Planning::target_position) {
    // The Tic counts round: the difference says the way.
    const auto way = static_cast<std::int32_t>(static_cast<std::uint32_t>(now.target_position) -
                                               static_cast<std::uint32_t>(now.position));
    return way > 0 ? 1 : way < 0 ? -1 : 0;
  }
  if (now.planning == Planning::target_velocity) {
    return now.target_velocity > 0 ? 1 : now.target_velocity < 0 ? -1 : 0;
  }
  return 0;
}

bool blocked(const Variables& now, int direction) {
  return (direction > 0 && now.forward_limit) || (direction < 0 && now.reverse_limit);
}

bool moving(const Variables& now) {
  if (turns(now)) return true;
  const int direction = planned_direction(now);
  return now.runs() && direction != 0 && !blocked(now, direction);
}

std::string volts(const Variables& now) {
  constexpr double kPerVolt = 1000;
  return fmt::format("{:.1f} V", now.vin_mv / kPerVolt);
}

// Why the Tic does not run, in words.
std::string why_not(const Variables& now) {
  const std::uint32_t errors = now.error_status & ~error::safe_start;
  std::string text =
      errors == 0 ? fmt::format("it is in state '{}'", name_of(now.operation)) : error_text(errors);
  if ((errors & error::low_vin) != 0) text += fmt::format(" ({})", volts(now));
  return text;
}

tl::unexpected<base::Error> not_running(const Variables& now, const std::string& where) {
  if ((now.error_status & error::faults) != 0) return fail(ErrorCode::device, why_not(now), where);
  return fail(ErrorCode::refused, "the motor is not enabled: " + why_not(now), where, "enable it first");
}

}  // namespace

TicAxis::TicAxis(TicSettings tic, ModuleSettings module, base::Clock& clock, Session::Log log)
    : tic_(std::move(tic)),
      module_(std::move(module)),
      log_(std::move(log)),
      connection_([this] { return Session::open(tic_, module_, heart_, log_, call_ends_); }, clock) {
  heart_.beat();
  const auto met = with([](Session&) -> Result<void> { return {}; });
  if (!met) log_(LogLevel::warning, fmt::format("axis {}: {}", tic_.axis.name, met.error().text()));
}

bool TicAxis::Errand::done(const Variables& now) const {
  if (turns(now)) return false;
  return target ? now.position == *target : !now.position_uncertain;
}

template <typename Use>
auto TicAxis::with(Use&& use, Call call) -> decltype(use(std::declval<Session&>())) {
  heart_.beat();
  call_ends_ = module_.retry.call_ends();
  auto session = connection_.get();
  if (session) (*session)->link().begin_call(call_ends_, call == Call::stop);
  // A stop does not wait for that.
  if (session && call != Call::stop && !(*session)->mismatch().empty() && (*session)->is_mended(tic_)) {
    connection_.close();
    session = connection_.get();
    if (session) (*session)->link().begin_call(call_ends_);
  }
  if (!session) return pass(session);
  const Settings& settings = (*session)->settings();
  has_switches_ = settings.forward_limit_pins != 0 || settings.reverse_limit_pins != 0;
  if (tic_.homing == Homing::forward || tic_.homing == Homing::reverse) {
    constexpr double kPerMicrostep = 10000;
    homing_velocity_rad_s_ = std::max(settings.homing_speed_towards, settings.homing_speed_away) /
                             kPerMicrostep * tic_.axis.scale.resolution_rad();
  }
  auto answer = use(**session);
  // One that is silent is spoken to further: a stop must reach it without a greeting before.
  if ((*session)->link().gone()) connection_.close();
  return answer;
}

AxisCapabilities TicAxis::capabilities() const {
  return {tic_.axis.scale.resolution_rad(),
          tic_.axis.max_velocity_rad_s,
          tic_.axis.max_acceleration_rad_s2,
          false,
          has_switches_,
          homing_velocity_rad_s_};
}

Result<void> TicAxis::acknowledge(Link& link, const Variables& now) {
  if (untold_ == 0 && (now.errors_occurred & error::faults) == 0) return {};
  untold_ = 0;
  const auto taken = link.take_errors_occurred();
  if (!taken) return pass(taken);
  return {};
}

Result<void> TicAxis::enable(bool on) {
  return with([&](Session& session) -> Result<void> {
    Link& link = session.link();
    const std::string& where = link.identity().where;
    if (!on) return let_go(link);
    if (!session.mismatch().empty()) return fail(ErrorCode::device, session.mismatch(), where);
    const auto before = link.variables();
    if (!before) return pass(before);
    if (auto ok = acknowledge(link, *before); !ok) return ok;
    if (before->runs() && before->energized) return {};
    if ((before->error_status & error::motor_driver) != 0) {
      if (auto ok = link.quick(Command::clear_driver_error); !ok) return ok;
    }
    // A target from before an error is still there, and the Tic would go on to it.
    if (auto ok = link.write32(Command::set_target_velocity, 0); !ok) return ok;
    if (auto ok = link.quick(Command::energize); !ok) return ok;
    if (auto ok = link.quick(Command::exit_safe_start); !ok) return ok;
    const auto after = read_until(link, kStartsWithin, [](const Variables& now) {
      return now.operation == Operation::normal && now.energized;
    });
    if (!after) return pass(after);
    if (!after->runs())
      return fail(ErrorCode::device, "the motor cannot be enabled: " + why_not(*after), where);
    return {};
  });
}

Result<void> TicAxis::let_go(Link& link) {
  if (auto ok = link.quick(Command::deenergize); !ok) return ok;
  const auto after = read_until(link, kHaltsWithin, [](const Variables& now) { return !now.energized; });
  if (!after) return pass(after);
  if (after->energized) return fail(ErrorCode::device, "it stays energised", link.identity().where);
  return {};
}

Result<void> TicAxis::send_rates(Link& link, const Variables& now, std::uint32_t speed, std::uint32_t accel) {
  if (now.max_accel != accel) {
    if (auto ok = link.write32(Command::set_max_accel, accel); !ok) return ok;
  }
  if (now.max_decel != accel) {
    if (auto ok = link.write32(Command::set_max_decel, accel); !ok) return ok;
  }
  if (now.max_speed == speed) return {};
  return link.write32(Command::set_max_speed, speed);
}

Result<void> TicAxis::go_home(Session& session, const Variables& found) {
  Link& link = session.link();
  const std::string& where = link.identity().where;
  if (!found.runs()) return not_running(found, where);
  const auto ready =
      read_until(link, kStartsWithin, [](const Variables& v) { return v.operation == Operation::normal; });
  if (!ready) return pass(ready);
  const Variables& now = *ready;
  // The speed of the last move would bound the homing's own.
  const auto speed = tic_speed(tic_.axis.scale, tic_.axis.max_velocity_rad_s);
  if (!speed) return pass(speed);
  const auto accel = tic_accel(tic_.axis.scale, tic_.axis.max_acceleration_rad_s2);
  if (!accel) return pass(accel);
  if (auto ok = send_rates(link, now, *speed, *accel); !ok) return ok;
  // A Tic that does not carry the command out says nothing.
  const bool forward = tic_.homing == Homing::forward;
  if (auto ok = link.write7(Command::go_home, forward ? 1 : 0); !ok) return ok;
  errand_ = Errand{};
  const auto began = [&now](const Variables& v) {
    return v.homing || (now.position_uncertain && !v.position_uncertain);
  };
  const auto after = read_until(link, kStartsWithin, began);
  if (!after) return pass(after);
  if (!began(*after)) return fail(ErrorCode::device, "it does not begin to home: " + why_not(*after), where);
  return {};
}

Result<void> TicAxis::set_here(Session& session, const Variables& now) {
  Link& link = session.link();
  const std::string& where = link.identity().where;
  const char* which = tic_.switch_is_forward ? "forward" : "reverse";
  const bool on_it = tic_.switch_is_forward ? now.forward_limit : now.reverse_limit;
  const bool on_other = tic_.switch_is_forward ? now.reverse_limit : now.forward_limit;
  if (turns(now)) return fail(ErrorCode::refused, "the motor turns", where, "stop it first");
  if (!on_it) {
    return fail(ErrorCode::refused, fmt::format("the axis is not on its {} limit switch", which), where,
                "bring it there by hand, then home it");
  }
  if (on_other) {
    return fail(ErrorCode::device, "both limit switches are active, which cannot be", where,
                "look at their wires");
  }
  return link.write32(Command::halt_and_set_position, 0);
}

Result<void> TicAxis::home() {
  return with([&](Session& session) -> Result<void> {
    Link& link = session.link();
    const std::string& where = link.identity().where;
    if (!session.mismatch().empty()) return fail(ErrorCode::device, session.mismatch(), where);
    const auto now = link.variables();
    if (!now) return pass(now);
    if (auto ok = acknowledge(link, *now); !ok) return ok;
    switch (tic_.homing) {
      case Homing::none:
        return fail(ErrorCode::refused, "this axis has no homing", where, "set 'homing' in rig.toml");
      case Homing::set_here:
        return set_here(session, *now);
      case Homing::forward:
      case Homing::reverse:
        return go_home(session, *now);
    }
    return {};
  });
}

Result<void> TicAxis::move_to(double target_rad, double velocity_rad_s, double acceleration_rad_s2) {
  const auto target = tic_.axis.scale.counts(target_rad);
  if (!target) return pass(target);
  const auto speed = tic_speed(tic_.axis.scale, velocity_rad_s);
  if (!speed) return pass(speed);
  const auto accel = tic_accel(tic_.axis.scale, acceleration_rad_s2);
  if (!accel) return pass(accel);
  return with([&](Session& session) -> Result<void> {
    const auto now = ready_for_target(session);
    if (!now) return pass(now);
    if (now->position_uncertain)
      return fail(ErrorCode::refused, "the axis is not homed", session.link().identity().where,
                  "home it first");
    return go(session.link(), *now, *target, *speed, *accel);
  });
}

Result<void> TicAxis::move_by(double delta_rad, double velocity_rad_s, double acceleration_rad_s2) {
  const CountScale& scale = tic_.axis.scale;
  if (const auto by = scale.distance(delta_rad); !by) return pass(by);
  const auto speed = tic_speed(scale, velocity_rad_s);
  if (!speed) return pass(speed);
  const auto accel = tic_accel(scale, acceleration_rad_s2);
  if (!accel) return pass(accel);
  return with([&](Session& session) -> Result<void> {
    const auto now = ready_for_target(session);
    if (!now) return pass(now);
    if (moving(*now))
      return fail(ErrorCode::busy, "the axis moves", session.link().identity().where,
                  "wait for its end, or stop it");
    const auto target = scale.away_from(now->position, delta_rad);
    if (!target) return pass(target);
    return go(session.link(), *now, *target, *speed, *accel);
  });
}

Result<Variables> TicAxis::ready_for_target(Session& session) {
  Link& link = session.link();
  const std::string& where = link.identity().where;
  if (!session.mismatch().empty()) return fail(ErrorCode::device, session.mismatch(), where);
  auto now = link.variables();
  if (!now) return now;
  if (auto ok = acknowledge(link, *now); !ok) return pass(ok);
  if (now->homing)
    return fail(ErrorCode::busy, "the axis is being homed", where, "wait for its end, or stop it");
  return now;
}

Result<void> TicAxis::go(Link& link, const Variables& now, std::int32_t target, std::uint32_t speed,
                         std::uint32_t accel) {
  const std::string& where = link.identity().where;
  if (!now.runs()) return not_running(now, where);
  const std::int64_t way = std::int64_t{target} - now.position;
  if (std::abs(way) > std::numeric_limits<std::int32_t>::max()) {
    return fail(ErrorCode::bad_input, "so far that the Tic would go the other way round", where);
  }
  if (blocked(now, way > 0 ? 1 : way < 0 ? -1 : 0)) {
    return fail(ErrorCode::refused,
                fmt::format("the axis stands on its {} limit switch and would be driven further in",
                            way > 0 ? "forward" : "reverse"),
                where, "drive it out; if it is out, mend the switch");
  }
  if (auto ok = send_rates(link, now, speed, accel); !ok) return ok;
  if (auto ok = link.write32(Command::set_target_position, target); !ok) return ok;
  errand_ = Errand{target};
  return {};
}

Result<void> TicAxis::stop() {
  return with(
      [&](Session& session) -> Result<void> {
        Link& link = session.link();
        // First of all, because it is never wrong: it brakes, forgets the target, and costs no reference.
        const auto braked = link.write32(Command::set_target_velocity, 0);
        if (!braked && braked.error().code == ErrorCode::lost) {
          // Silent, but perhaps not deaf; a homing heeds nothing less than this.
          if (!link.gone()) (void)link.quick_once(Command::halt_and_hold);
          return braked;
        }
        const auto now = link.variables();
        if (!now && link.gone()) return pass(now);
        // A motor that stands is not halted: that would cost its reference for nothing.
        const bool stands = braked && now && !turns(*now);
        const bool brakes = braked && now && !now->homing && tic_.stop == Stop::decelerate;
        if (!stands && !brakes) {
          if (auto ok = halt(link); !ok) return ok;
        }
        // What becomes of that is not what a stop is about.
        if (now) (void)acknowledge(link, *now);
        return {};
      },
      Call::stop);
}

Result<void> TicAxis::halt(Link& link) {
  if (auto ok = link.quick(Command::halt_and_hold); !ok) return ok;
  const auto after = read_until(link, kHaltsWithin, [](const Variables& v) { return !turns(v); });
  if (!after) return pass(after);
  if (!turns(*after)) return {};
  log_(LogLevel::error, fmt::format("axis {}: it does not halt; it is de-energised", tic_.axis.name));
  return link.quick(Command::deenergize);
}

std::string TicAxis::fault_of(const Session& session, const Variables& now) {
  std::string text = session.mismatch();
  const auto add = [&text](const std::string& what) { text += (text.empty() ? "" : "; ") + what; };
  // A command timeout that passed while nothing was asked of the axis stopped nothing, and is no fault.
  if (errand_ && errand_->done(now)) errand_.reset();
  const std::uint32_t counted = errand_ ? error::faults : error::faults & ~error::command_timeout;
  const std::uint32_t present = now.error_status & counted;
  if (present != 0) {
    std::string what = error_text(present);
    if ((present & error::low_vin) != 0) what += fmt::format(" ({})", volts(now));
    add(what);
  }
  untold_ |= now.errors_occurred & counted;
  if (const std::uint32_t past = untold_ & ~present; past != 0) add("it was stopped by: " + error_text(past));
  constexpr double kPerVolt = 1000;
  if ((present & error::low_vin) == 0 && now.vin_mv < tic_.min_vin_v * kPerVolt) {
    add(fmt::format("its supply is {}, min_vin_v is {:g}", volts(now), tic_.min_vin_v));
  }
  return text;
}

Result<AxisState> TicAxis::state() {
  return with([&](Session& session) -> Result<AxisState> {
    Link& link = session.link();
    const auto read = link.variables();
    if (!read) return pass(read);
    const Variables& now = *read;
    // A plan that a limit switch holds up is dropped: a switch that bounces must not let it go on.
    const int direction = planned_direction(now);
    if (!now.homing && direction != 0 && blocked(now, direction)) {
      if (auto ok = link.write32(Command::set_target_velocity, 0); !ok) return pass(ok);
    }
    AxisState state;
    state.position_rad = tic_.axis.scale.radians(now.position);
    state.enabled = now.energized && now.runs();
    state.moving = moving(now);
    state.homed = !now.position_uncertain && !now.homing;
    state.at_high_limit = tic_.axis.scale.reversed ? now.reverse_limit : now.forward_limit;
    state.at_low_limit = tic_.axis.scale.reversed ? now.forward_limit : now.reverse_limit;
    state.fault = fault_of(session, now);
    if (!state.moving) errand_.reset();
    return state;
  });
}

}  // namespace rig::drivers::tic
