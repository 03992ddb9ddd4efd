#include "drivers/sixk_axis/controller.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/units.h"
#include "drivers/common/rounding.h"

namespace rig::drivers::sixk {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;
using Is = Steps::Is;
using std::chrono::milliseconds;

namespace {

// A call's share of being set up.
constexpr milliseconds kBudget{300};
// After GO and HOM the status takes this long to show that the axis moves.
constexpr base::Duration kStartLag = milliseconds(150);
// The farthest target that D takes.
constexpr std::int32_t kFarthest = 999'999'999;
constexpr double kSteps = 1e4;  // of V and A: four digits behind the point

Result<void> within_reach(std::int32_t target) {
  if (std::abs(target) <= kFarthest) return {};
  return fail(ErrorCode::bad_input,
              fmt::format("{} counts are beyond what the controller can be sent to", target));
}

}  // namespace

Controller::Controller(const Settings& settings, std::vector<Reference>& references, Link link,
                       base::Clock& clock)
    : settings_(settings), references_(references), link_(std::move(link)), clock_(clock) {
  for (const ControllerAxis& axis : settings.axes) {
    axes_.emplace_back();
    axes_.back().settings = axis;
  }
  plan_set_up();
}

void Controller::add_order(int axis, std::string command, bool needed) {
  steps_.add([this, axis, command = std::move(command), needed]() -> Result<Is> {
    const auto ok = link_.order(axis, command);
    if (!ok && (needed || ok.error().code != ErrorCode::device)) return pass(ok);
    return Is::done;
  });
}

// Believed once it was answered twice on end: before, answers to what an earlier connection asked may still
// be coming. The link finds its way by it.
Result<Is> Controller::ask_revision() {
  constexpr int kTries = 8;
  const auto revision = link_.ask(0, "TREV");
  if (!revision) return pass(revision);
  const bool again = !revision->empty() && *revision == revision_;
  revision_ = *revision;
  if (again) {
    link_.set_marker(revision_);
    return Is::done;
  }
  if (++revisions_asked_ < kTries) return Is::waiting;
  return fail(ErrorCode::device, fmt::format("the controller answers TREV with '{}'", revision_),
              link_.path());
}

Result<Is> Controller::ask_resolution(Axis& axis) {
  const char* name = axis.settings.servo ? "ERES" : "DRES";
  const auto counts = link_.number(axis.settings.number, name);
  if (!counts) return pass(counts);
  if (!(*counts >= 1)) {
    return fail(
        ErrorCode::device,
        fmt::format("the controller says that {} of axis {} is {}", name, axis.settings.axis.name, *counts),
        link_.path());
  }
  axis.counts_per_turn = *counts;
  if (axis.settings.resolution && *axis.settings.resolution != *counts) {
    return fail(ErrorCode::bad_input,
                fmt::format("counts_per_turn of axis {} is {}, and {} of the controller is {}",
                            axis.settings.axis.name, *axis.settings.resolution, name, *counts),
                link_.path(), "leave it out, or put the controller's command into set_up");
  }
  return Is::done;
}

void Controller::plan_set_up() {
  // At which error level the controller is, and whether it echoes, shows only once it was told.
  steps_.add([this]() -> Result<Is> {
    if (auto ok = link_.clear_line(); !ok) return pass(ok);
    for (const std::string& command :
         {fmt::format("ERRLVL{}", settings_.error_level), fmt::format("ECHO{}", settings_.echo ? 1 : 0),
          std::string("EOT13,10,0")}) {
      if (auto ok = link_.shout(command); !ok) return pass(ok);
    }
    return Is::done;
  });
  steps_.add([this] { return ask_revision(); });
  // Distances in counts, speeds in turns of the motor. A model without scaling does not know the command.
  add_order(0, "SCALE0", false);
  for (const std::string& command : settings_.set_up) add_order(0, command, true);
  for (Axis& axis : axes_) {
    const int n = axis.settings.number;
    add_order(n, "MA1", true);
    add_order(n, "MC0", false);
    add_order(n, axis.settings.hard_limits ? "LH3" : "LH0", true);
    steps_.add([this, &axis] { return ask_resolution(axis); });
    steps_.add([this, &axis, n]() -> Result<Is> {
      const auto now = link_.status(n);
      if (!now) return pass(now);
      axis.shows_mode = now->absolute;
      return Is::done;
    });
  }
}

Result<bool> Controller::set_up() {
  if (set_up_) return true;
  auto done = steps_.advance(kBudget);
  if (done) {
    set_up_ = *done;
    return done;
  }
  // What could not be understood may move all the same.
  for (std::size_t i = 0; i < axes_.size(); ++i) (void)shout_stop(i);
  return done;
}

std::string Controller::mask(const Axis& axis, char others, char own) const {
  std::string text(static_cast<std::size_t>(axis.settings.number), others);
  text.back() = own;
  return text;
}

std::string Controller::stop_command(const Axis& axis) const {
  return (settings_.kill ? "K" : "S") + mask(axis, '0', '1');
}

Result<void> Controller::shout_stop(std::size_t index) {
  return link_.shout(stop_command(axes_[index]));
}

AxisCapabilities Controller::capabilities(std::size_t index) const {
  const ControllerAxis& axis = axes_[index].settings;
  AxisCapabilities can;
  can.resolution_rad = axis.axis.scale.resolution_rad();
  // Of what is read: a coarser encoder proves no more.
  if (axis.encoder) can.resolution_rad = std::max(can.resolution_rad, axis.encoder->resolution_rad());
  can.max_velocity_rad_s = axis.axis.max_velocity_rad_s;
  can.max_acceleration_rad_s2 = axis.axis.max_acceleration_rad_s2;
  can.has_limit_switches = axis.hard_limits;
  can.homing_velocity_rad_s = axis.home_velocity_rad_s;
  return can;
}

Result<std::string> Controller::turns(const Axis& axis, double rad_per_s, std::string_view what) const {
  const double per_turn = axis.counts_per_turn / axis.settings.axis.scale.counts_per_rad;
  const double steps = rounded(rad_per_s / per_turn * kSteps, Rounding::down);
  constexpr double kMost = 9999.9999;
  if (!(steps >= 1) || steps > kMost * kSteps) {
    return fail(ErrorCode::bad_input,
                fmt::format("a {} of {:.4g} turns a second is nothing the controller takes", what,
                            rad_per_s / per_turn),
                link_.path());
  }
  return fmt::format("{:.4f}", steps / kSteps);
}

// What the controller says of an axis, and that it is still the one that was set up.
Result<Status> Controller::status(std::size_t index) {
  Axis& axis = axes_[index];
  auto now = link_.status(axis.settings.number);
  if (!now) return now;
  if (axis.shows_mode && !now->absolute) {
    return fail(ErrorCode::lost, "the controller has been switched off and on, or somebody else commands it",
                link_.path());
  }
  if (axis.settings.servo) return now;
  // Without current, or when it was left behind, a motor stands anywhere, and its counted steps say
  // otherwise.
  if (now->stalled) references_[index].lose("the motor has stalled");
  if (now->drive_fault || now->shut_down) references_[index].lose("the drive was without power");
  return now;
}

Result<std::int32_t> Controller::read_position(const Axis& axis) {
  const bool encoder = axis.settings.servo || axis.settings.encoder.has_value();
  const auto counts = link_.number(axis.settings.number, encoder ? "TPE" : "TPM");
  if (!counts) return pass(counts);
  constexpr double kMost = std::numeric_limits<std::int32_t>::max();
  if (std::abs(*counts) > kMost) {
    return fail(
        ErrorCode::device,
        fmt::format("the controller says that axis {} stands at {} counts", axis.settings.axis.name, *counts),
        link_.path());
  }
  return static_cast<std::int32_t>(std::lround(*counts));
}

// True: the search for home is under way. Once it is over its outcome is settled.
Result<bool> Controller::look_after_homing(std::size_t index, const Status& now) {
  Axis& axis = axes_[index];
  if (!axis.homing) return false;
  if (now.moving || clock_.now() - *axis.homing < kStartLag) return true;
  const int n = axis.settings.number;
  if (now.homed) {
    if (axis.settings.preset_at_home) {
      if (auto ok = link_.order(n, "PSET0"); !ok) return pass(ok);
    }
    // The controller leaves an encoder's position as it is.
    if (axis.settings.encoder) {
      if (auto ok = link_.order(n, "PESET0"); !ok) return pass(ok);
    }
    references_[index].found();
  } else {
    axis.fault = "its search for home has ended without finding it";
  }
  axis.homing.reset();
  return false;
}

Result<AxisState> Controller::state(std::size_t index) {
  Axis& axis = axes_[index];
  const auto now = status(index);
  if (!now) return pass(now);
  const auto homing = look_after_homing(index, *now);
  if (!homing) return pass(homing);
  const auto counts = read_position(axis);
  if (!counts) return pass(counts);

  AxisState state;
  const CountScale& scale = axis.settings.encoder ? *axis.settings.encoder : axis.settings.axis.scale;
  state.position_rad = scale.radians(*counts);
  state.enabled = !now->shut_down;
  if (axis.sent && (now->moving || clock_.now() - axis.sent->at >= kStartLag)) axis.sent.reset();
  const double away =
      axis.sent ? std::abs(state.position_rad - axis.settings.axis.scale.radians(axis.sent->target)) : 0;
  state.moving = now->moving || *homing || away > capabilities(index).resolution_rad;
  state.homed = now->homed && !*homing && !references_[index].is_lost();
  const bool reversed = axis.settings.axis.scale.reversed;
  state.at_high_limit = reversed ? now->negative_limit : now->positive_limit;
  state.at_low_limit = reversed ? now->positive_limit : now->negative_limit;
  state.fault = fault_of(*now);
  if (state.fault.empty()) state.fault = axis.fault;
  return state;
}

Result<void> Controller::enable(std::size_t index, bool on) {
  Axis& axis = axes_[index];
  axis.sent.reset();
  if (!on) {
    axis.homing.reset();
    if (!axis.settings.servo) references_[index].lose("its drive was switched off");
    return link_.order(axis.settings.number, "DRIVE0");
  }
  axis.fault.clear();
  return link_.order(axis.settings.number, "DRIVE1");
}

Result<void> Controller::home(std::size_t index) {
  Axis& axis = axes_[index];
  const std::string& name = axis.settings.axis.name;
  const auto now = status(index);
  if (!now) return pass(now);
  if (now->shut_down) {
    return fail(ErrorCode::refused, fmt::format("axis {} is not energised", name), link_.path());
  }
  if (now->moving)
    return fail(ErrorCode::busy, fmt::format("axis {} moves", name), link_.path(), "stop it first");
  const auto velocity = turns(axis, axis.settings.home_velocity_rad_s, "home velocity");
  if (!velocity) return pass(velocity);
  const auto acceleration = turns(axis, axis.settings.home_acceleration_rad_s2, "home acceleration");
  if (!acceleration) return pass(acceleration);
  const int n = axis.settings.number;
  if (auto ok = link_.order(n, "HOMV" + *velocity); !ok) return ok;
  if (auto ok = link_.order(n, "HOMA" + *acceleration); !ok) return ok;
  if (axis.settings.home_final_velocity_rad_s) {
    const auto last = turns(axis, *axis.settings.home_final_velocity_rad_s, "final home velocity");
    if (!last) return pass(last);
    if (auto ok = link_.order(n, "HOMVF" + *last); !ok) return ok;
  }
  // From here on it counts as lost, however this ends.
  references_[index].lose("a search for home was begun");
  axis.fault.clear();
  axis.sent.reset();
  axis.homing = clock_.now();
  const bool upwards = axis.settings.home_upwards != axis.settings.axis.scale.reversed;
  return link_.order(0, "HOM" + mask(axis, 'X', upwards ? '0' : '1'));
}

tl::unexpected<base::Error> Controller::refused(const Axis& axis, const std::string& why,
                                                std::string hint) const {
  return fail(ErrorCode::refused, fmt::format("axis {} {}", axis.settings.axis.name, why), link_.path(),
              std::move(hint));
}

Result<Controller::Rates> Controller::rates(const Axis& axis, double velocity, double acceleration) const {
  const AxisSettings& settings = axis.settings.axis;
  if (!std::isfinite(velocity) || !(velocity > 0) || !std::isfinite(acceleration) || !(acceleration > 0)) {
    return fail(ErrorCode::bad_input, fmt::format("axis {} cannot move with {} rad/s and {} rad/s^2",
                                                  settings.name, velocity, acceleration));
  }
  const auto speed = turns(axis, std::min(velocity, settings.max_velocity_rad_s), "velocity");
  if (!speed) return pass(speed);
  const auto ramp = turns(axis, std::min(acceleration, settings.max_acceleration_rad_s2), "acceleration");
  if (!ramp) return pass(ramp);
  return Rates{*speed, *ramp};
}

Result<Status> Controller::ready_to_go(std::size_t index) {
  const Axis& axis = axes_[index];
  auto now = status(index);
  if (!now) return now;
  if (axis.homing) {
    return fail(ErrorCode::busy, fmt::format("axis {} is homing", axis.settings.axis.name), link_.path());
  }
  std::string fault = fault_of(*now);
  if (fault.empty()) fault = axis.fault;
  if (!fault.empty()) return refused(axis, "has a fault: " + fault, "enable it again to acknowledge it");
  if (now->shut_down) return refused(axis, "is not energised", "enable it first");
  return now;
}

Result<void> Controller::move_to(std::size_t index, double target_rad, double velocity, double acceleration) {
  Axis& axis = axes_[index];
  const auto sent_at = rates(axis, velocity, acceleration);
  if (!sent_at) return pass(sent_at);
  const auto target = axis.settings.axis.scale.counts(target_rad);
  if (!target) return pass(target);
  if (auto ok = within_reach(*target); !ok) return ok;
  const auto now = ready_to_go(index);
  if (!now) return pass(now);
  if (!now->homed || references_[index].is_lost())
    return refused(axis, "does not know where it stands", "home it first");
  return go(axis, *now, *target, *sent_at);
}

// As a target in the controller's own counting: repeated where an answer was lost, it is the same move.
Result<void> Controller::move_by(std::size_t index, double delta_rad, double velocity, double acceleration) {
  Axis& axis = axes_[index];
  const CountScale& scale = axis.settings.axis.scale;
  const auto sent_at = rates(axis, velocity, acceleration);
  if (!sent_at) return pass(sent_at);
  if (const auto by = scale.distance(delta_rad); !by) return pass(by);
  const auto now = ready_to_go(index);
  if (!now) return pass(now);
  const bool setting_off = axis.sent && clock_.now() - axis.sent->at < kStartLag;
  if (now->moving || setting_off) {
    return fail(ErrorCode::busy, fmt::format("axis {} moves", axis.settings.axis.name), link_.path(),
                "wait for its end, or stop it");
  }
  // What a target is told in: of a stepper its steps, also where an encoder is beside it.
  const auto here = link_.number(axis.settings.number, axis.settings.servo ? "TPE" : "TPM");
  if (!here) return pass(here);
  const auto target = scale.away_from(*here, delta_rad);
  if (!target) return pass(target);
  if (auto ok = within_reach(*target); !ok) return ok;
  return go(axis, *now, *target, *sent_at);
}

Result<void> Controller::go(Axis& axis, const Status& now, std::int32_t target, const Rates& rates) {
  const int n = axis.settings.number;
  for (const std::string& command : {std::string("MA1"), "A" + rates.acceleration, "AD" + rates.acceleration,
                                     "V" + rates.velocity, fmt::format("D{}", target)}) {
    if (auto ok = link_.order(n, command); !ok) return ok;
  }
  axis.sent = Sent{clock_.now(), target};
  auto gone = link_.order(0, "GO" + mask(axis, 'X', '1'));
  if (gone || gone.error().code != ErrorCode::device) return gone;
  axis.sent.reset();
  if (now.positive_limit || now.negative_limit) {
    return refused(axis, "stands on a limit switch: " + gone.error().what, "drive it out");
  }
  return gone;
}

Result<void> Controller::stop(std::size_t index) {
  Axis& axis = axes_[index];
  axis.sent.reset();
  axis.homing.reset();
  return link_.stop(stop_command(axis), "K");
}

}  // namespace rig::drivers::sixk
