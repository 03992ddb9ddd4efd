#include "drivers/ptu_axis/session.h"

#include <algorithm>
#include <cmath>

#include "core/base/units.h"

namespace rig::drivers::ptu {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;
using Is = Steps::Is;
using std::chrono::milliseconds;

namespace {

// A call's share of what is under way.
constexpr milliseconds kBudget{300};
constexpr base::Duration kTemperatureEvery = std::chrono::seconds(10);

// An axis that stands as long has come to rest: at its slowest it would have gone two steps, and it is not
// asked so often that it could not have gone one.
base::Duration still_after(int slowest) {
  constexpr double kLeast_s = 0.1;
  constexpr double kMost_s = 1;
  return base::seconds(std::clamp(2.0 / std::max(slowest, 1), kLeast_s, kMost_s));
}

}  // namespace

Session::Session(const Settings& settings, std::vector<std::optional<double>>& resolutions, Link link,
                 base::Clock& clock)
    : settings_(settings), resolutions_(resolutions), link_(std::move(link)), clock_(clock) {
  for (const UnitAxis& axis : settings.axes) {
    axes_.emplace_back();
    axes_.back().settings = axis;
  }
  plan_set_up();
}

std::string Session::axis_command(const Axis& axis, std::string_view what) const {
  return fmt::format("{}{}", axis.settings.letter, what);
}

Result<bool> Session::progress() {
  if (phase_ == Phase::ready) return true;
  auto done = steps_.advance(kBudget);
  if (done) {
    if (*done) phase_ = Phase::ready;
    return done;
  }
  if (phase_ == Phase::setting_up) {
    // What could not be understood may move all the same.
    (void)link_.shout("H");
    return done;
  }
  if (done.error().code == ErrorCode::lost) return done;
  for (const std::size_t i : busy_) {
    Axis& axis = axes_[i];
    axis.plan.reset();
    axis.fault = done.error().what;
    doubt(axis, Motion::unknown);
    (void)link_.take_limit(axis.settings.letter);
  }
  phase_ = Phase::ready;
  return true;
}

AxisCapabilities Session::capabilities(std::size_t index) const {
  const Axis& axis = axes_[index];
  const AxisSettings& settings = axis.settings.axis;
  AxisCapabilities can;
  can.resolution_rad = settings.scale.resolution_rad();
  can.max_velocity_rad_s =
      std::min(settings.max_velocity_rad_s, axis.fastest / settings.scale.counts_per_rad);
  can.max_acceleration_rad_s2 = settings.max_acceleration_rad_s2;
  // It tells that it hit an end stop, not whether it stands on one.
  can.has_limit_switches = false;
  return can;
}

Result<void> Session::ready_for(const Axis& axis, std::string_view what) {
  const auto done = progress();
  if (!done) return pass(done);
  if (*done) return {};
  return fail(ErrorCode::busy,
              fmt::format("axis {} cannot {} while the unit {}", axis.settings.axis.name, what,
                          phase_ == Phase::resetting ? "resets" : "takes over a new acceleration"),
              link_.path());
}

// Reads where the axis stands and makes up its mind whether it moves.
Result<void> Session::look(Axis& axis) {
  const auto position = link_.number(axis_command(axis, "P"));
  if (!position) return pass(position);
  const auto desired = link_.number(axis_command(axis, "O"));
  if (!desired) return pass(desired);
  const int here = static_cast<int>(std::lround(*position));
  const int there = static_cast<int>(std::lround(*desired));
  const base::Time now = clock_.now();
  switch (axis.motion) {
    case Motion::going:
      if (here == axis.target) {
        axis.motion = Motion::rest;
      } else if (there != axis.target) {
        axis.motion = Motion::halting;  // not by us
        axis.seen = Seen{now, here};
      }
      break;
    case Motion::rest:
      if (here == axis.position && there == axis.desired) break;
      axis.motion = Motion::halting;  // nor this
      axis.seen = Seen{now, here};
      break;
    case Motion::unknown:
      axis.motion = here == there ? Motion::rest : Motion::halting;
      axis.seen = Seen{now, here};
      break;
    case Motion::halting:
      if (!axis.seen || axis.seen->position != here) {
        axis.seen = Seen{now, here};
      } else if (now - axis.seen->since >= still_after(axis.slowest)) {
        axis.motion = Motion::rest;
      }
      break;
  }
  axis.position = here;
  axis.desired = there;
  // One hit before, while the unit was reset, means nothing.
  if (link_.take_limit(axis.settings.letter) && phase_ == Phase::ready) hit_end_stop(axis);
  return {};
}

void Session::doubt(Axis& axis, Motion as) {
  axis.motion = as;
  axis.seen.reset();
}

// As seen last; those that were under way are looked at.
Result<bool> Session::all_at_rest() {
  bool rest = true;
  for (Axis& axis : axes_) {
    if (axis.motion == Motion::rest) continue;
    if (auto ok = look(axis); !ok) return pass(ok);
    rest = rest && axis.motion == Motion::rest;
  }
  return rest;
}

// Within its limits a unit runs into an end stop only when it has lost steps; only a reset helps.
void Session::hit_end_stop(Axis& axis) {
  axis.homed = false;
  axis.along = false;
  if (axis.motion == Motion::rest || axis.direction == 0) {
    axis.fault = "it ran into an end stop while nobody moved it: it has lost its place, home it";
    return;
  }
  ((axis.direction > 0) != axis.settings.axis.scale.reversed ? axis.at_high : axis.at_low) = true;
  doubt(axis, Motion::halting);
}

AxisState Session::believed(const Axis& axis, bool moving) const {
  AxisState state;
  state.position_rad = axis.settings.axis.scale.radians(axis.position);
  state.enabled = axis.enabled;
  state.moving = moving;
  state.homed = axis.homed;
  state.at_low_limit = axis.at_low;
  state.at_high_limit = axis.at_high;
  state.fault = axis.fault;
  state.temperature_c = temperature_c_;
  return state;
}

Result<std::optional<double>> Session::temperature() {
  const base::Time now = clock_.now();
  if (!tells_temperature_ || now < temperature_at_) return temperature_c_;
  const auto text = link_.text("O");
  if (!text && text.error().code == ErrorCode::lost) return pass(text);
  temperature_at_ = now + kTemperatureEvery;
  temperature_c_ = text ? temperature_c_in(*text) : std::nullopt;
  // A model that does not know the question is not asked it again.
  tells_temperature_ = text.has_value();
  return temperature_c_;
}

Result<AxisState> Session::state(std::size_t index) {
  Axis& axis = axes_[index];
  const auto done = progress();
  if (!done) return pass(done);
  // It hears nothing now. What cannot be proven to stand counts as moving.
  if (!*done) return believed(axis, true);
  if (auto ok = look(axis); !ok) return pass(ok);
  if (auto read = temperature(); !read) return pass(read);
  return believed(axis, axis.motion != Motion::rest);
}

Result<void> Session::enable(std::size_t index, bool on) {
  Axis& axis = axes_[index];
  if (auto ok = ready_for(axis, "be switched"); !ok) return ok;
  if (!on && axis.motion != Motion::rest) {
    return fail(ErrorCode::busy, fmt::format("axis {} moves", axis.settings.axis.name), link_.path(),
                "stop it first");
  }
  const char* power = !on ? "HO" : settings_.low_hold_power ? "HL" : "HR";
  if (auto ok = link_.order(axis_command(axis, power)); !ok) return ok;
  axis.enabled = on;
  if (on) axis.fault.clear();
  // Nothing holds it: it may be turned by hand.
  if (!on) axis.homed = axis.along = false;
  return {};
}

Result<void> Session::home(std::size_t index) {
  Axis& axis = axes_[index];
  if (auto ok = ready_for(axis, "be homed"); !ok) return ok;
  if (!axis.enabled) {
    return fail(ErrorCode::refused, fmt::format("axis {} is not energised", axis.settings.axis.name),
                link_.path());
  }
  const auto rest = all_at_rest();
  if (!rest) return pass(rest);
  if (!*rest) return fail(ErrorCode::busy, "the pan-tilt unit moves", link_.path(), "stop it first");
  if (axis.along && axis.homed) {
    axis.along = false;
    return {};
  }
  if (auto ok = keep_limits_again(); !ok) return ok;
  std::vector<std::size_t> reset;
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    if (i == index || settings_.reset == Reset::both) reset.push_back(i);
  }
  const std::string one = axis.settings.letter == 'P' ? "RP" : "RT";
  if (settings_.reset == Reset::mode) {
    if (auto ok = link_.order(one); !ok) return ok;
  }
  for (const std::size_t i : reset) {
    axes_[i].homed = axes_[i].along = false;
    axes_[i].fault.clear();
  }
  busy_ = reset;
  stopped_ = false;
  phase_ = Phase::resetting;
  add_awaited(settings_.reset == Reset::axis ? one : "R", settings_.reset_within);
  steps_.add([this, index]() -> Result<Is> {
    for (const std::size_t i : busy_) {
      Axis& each = axes_[i];
      doubt(each, stopped_ ? Motion::halting : Motion::unknown);
      // The reset's own.
      (void)link_.take_limit(each.settings.letter);
      if (stopped_) continue;
      if (settings_.limits == Limits::factory) add_limits(each);
      each.along = i != index;
    }
    add_rest();
    steps_.add([this]() -> Result<Is> {
      end_reset(busy_, !stopped_);
      return Is::done;
    });
    return Is::done;
  });
  // Sent before this call ends.
  const auto begun = progress();
  if (!begun) return pass(begun);
  return {};
}

void Session::end_reset(const std::vector<std::size_t>& axes, bool homed) {
  for (const std::size_t i : axes) {
    Axis& axis = axes_[i];
    if (homed && settings_.limits == Limits::factory && axis.low >= axis.high) {
      axis.fault =
          fmt::format("after its reset the unit says that it can go from {} to {}", axis.low, axis.high);
      homed = false;
    }
    axis.homed = homed;
    axis.along = axis.along && homed;
    if (homed) axis.at_low = axis.at_high = false;
  }
}

Result<void> Session::stop(std::size_t index) {
  Axis& axis = axes_[index];
  if (phase_ == Phase::ready) {
    if (axis.motion != Motion::rest) doubt(axis, Motion::halting);
    return link_.stop(axis.settings.letter == 'P' ? "HP" : "HT", "H");
  }
  // It may hear nothing before it is through; then its reply shows that it is.
  stopped_ = true;
  return shout_halt();
}

Result<void> Session::shout_halt() {
  return link_.shout("H");
}

}  // namespace rig::drivers::ptu
