// What a unit is asked and told at the beginning of a connection.
#include <cmath>

#include "core/base/units.h"
#include "drivers/ptu_axis/session.h"

namespace rig::drivers::ptu {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;
using Is = Steps::Is;

namespace {

constexpr double kArcsecPerRadian = 180 * 3600 / base::kPi;
// Between the unit's resolution and the owner's idea of it, relative.
constexpr double kScaleAgrees = 1e-3;
constexpr double kSameScale = 1e-9;

}  // namespace

void Session::add_order(std::string command) {
  steps_.add([this, command = std::move(command)]() -> Result<Is> {
    if (auto ok = link_.order(command); !ok) return pass(ok);
    return Is::done;
  });
}

void Session::add_number(std::string query, std::function<Result<void>(double)> take) {
  steps_.add([this, query = std::move(query), take = std::move(take)]() -> Result<Is> {
    const auto number = link_.number(query);
    if (!number) return pass(number);
    if (auto ok = take(*number); !ok) return pass(ok);
    return Is::done;
  });
}

// A command whose reply takes so long that calls must not wait for it.
void Session::add_awaited(const std::string& command, std::chrono::milliseconds within) {
  steps_.add([this, command, within]() -> Result<Is> {
    if (auto ok = link_.send(command); !ok) return pass(ok);
    awaited_until_ = clock_.now() + within;
    return Is::done;
  });
  steps_.add([this, command, within]() -> Result<Is> {
    auto reply = link_.reply_to_sent();
    if (!reply) return pass(reply);
    if (*reply && (*reply)->kind == Reply::Kind::error) {
      return fail(ErrorCode::device,
                  fmt::format("the pan-tilt unit answers '{}' with '{}'", command, (*reply)->text),
                  link_.path());
    }
    if (*reply) return Is::done;
    if (clock_.now() < awaited_until_) return Is::waiting;
    return fail(
        ErrorCode::lost,
        fmt::format("the pan-tilt unit has not answered '{}' within {} s", command, within.count() / 1000),
        link_.path());
  });
}

// A setting for which the unit computes new tables for seconds. Whether it says "*" before or after that is
// not known; it is through when it answers a query.
void Session::add_tabled(const std::string& command) {
  add_awaited(command, settings_.tables_within);
  add_awaited(axis_command(axes_.front(), "P"), settings_.tables_within);
}

void Session::add_rest() {
  steps_.add([this]() -> Result<Is> {
    bool rest = true;
    for (Axis& axis : axes_) {
      if (auto ok = look(axis); !ok) return pass(ok);
      rest = rest && axis.motion == Motion::rest;
    }
    return rest ? Is::done : Is::waiting;
  });
}

void Session::add_limits(Axis& axis) {
  const auto into = [](int& place) {
    return [&place](double value) -> Result<void> {
      place = static_cast<int>(std::lround(value));
      return {};
    };
  };
  add_number(axis_command(axis, "N"), into(axis.low));
  add_number(axis_command(axis, "X"), into(axis.high));
}

void Session::add_base(Axis& axis, int is) {
  steps_.add([this, &axis, is]() -> Result<Is> {
    const auto wanted = axis.settings.axis.scale.rate(*axis.settings.base_velocity_rad_s);
    if (!wanted) return pass(wanted);
    if (*wanted != is) add_tabled(axis_command(axis, fmt::format("B{}", *wanted)));
    return Is::done;
  });
}

void Session::add_acceleration(Axis& axis, int wanted) {
  if (axis.acceleration == wanted) return;
  add_tabled(axis_command(axis, fmt::format("A{}", wanted)));
  steps_.add([&axis, wanted]() -> Result<Is> {
    axis.acceleration = wanted;
    return Is::done;
  });
}

Result<void> Session::take_resolution(std::size_t index, double arcsec) {
  Axis& axis = axes_[index];
  if (!(arcsec > 0)) {
    return fail(ErrorCode::device,
                fmt::format("the pan-tilt unit says that a step is {} seconds of arc", arcsec), link_.path());
  }
  const double counts_per_rad = kArcsecPerRadian / arcsec;
  const double counts_per_deg = base::radians(1) * counts_per_rad;
  const auto believed = axis.settings.counts_per_deg;
  if (believed && std::abs(counts_per_deg / *believed - 1) > kScaleAgrees) {
    return fail(ErrorCode::bad_input,
                fmt::format("counts_per_deg is {}, and the unit says {:.6g}", *believed, counts_per_deg),
                axis.settings.where, "leave it out: the unit is asked");
  }
  auto& earlier = resolutions_[index];
  if (earlier && std::abs(counts_per_rad / *earlier - 1) > kSameScale) {
    return fail(
        ErrorCode::device,
        fmt::format("the pan-tilt unit that came back has {:.6g} steps a degree, before it had {:.6g}",
                    counts_per_deg, base::radians(1) * *earlier),
        link_.path(), "another unit, or its step mode was changed: start again");
  }
  earlier = counts_per_rad;
  axis.settings.axis.scale.counts_per_rad = counts_per_rad;
  return {};
}

// Believed once it was answered twice on end: the replies to what an earlier connection asked may still be
// coming. The first axis' resolution is what the link finds its way by.
Result<Is> Session::ask_resolution(std::size_t index) {
  constexpr int kTries = 8;
  const std::string query = axis_command(axes_[index], "R");
  const auto text = link_.text(query);
  if (!text) return pass(text);
  const auto arcsec = number_in(*text);
  const bool again = *text == last_resolution_;
  last_resolution_ = *text;
  if (!arcsec || !is_terse(*text) || !again) {
    if (++resolutions_asked_ < kTries) return Is::waiting;
    return fail(ErrorCode::device, fmt::format("the pan-tilt unit answers '{}' with '{}'", query, *text),
                link_.path());
  }
  last_resolution_.clear();
  resolutions_asked_ = 0;
  if (index == 0) marker_ = *text;
  if (auto ok = take_resolution(index, *arcsec); !ok) return pass(ok);
  return Is::done;
}

void Session::plan_set_up() {
  // Whatever it is doing, nobody watches it any more. What stands before the first one in its input, half a
  // command perhaps, spoils that one.
  steps_.add([this]() -> Result<Is> {
    const auto halted = link_.order("H");
    if (!halted && halted.error().code != ErrorCode::device) return pass(halted);
    return Is::done;
  });
  for (const char* command : {"H", "ED", "FT"}) add_order(command);
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    steps_.add([this, i] { return ask_resolution(i); });
  }
  steps_.add([this]() -> Result<Is> {
    link_.set_marker(axis_command(axes_.front(), "R"), marker_);
    link_.expect_terse();
    return Is::done;
  });
  // Speeds are magnitudes, and moves begin when they are commanded.
  for (const char* command : {"CI", "I"}) add_order(command);
  add_rest();
  if (settings_.limits != Limits::user) {
    add_order(settings_.limits == Limits::off ? "LD" : "LE");
  }
  for (Axis& axis : axes_) {
    add_limits(axis);
    if (settings_.limits == Limits::user) {
      steps_.add([this, &axis]() -> Result<Is> {
        const auto low = axis.settings.axis.scale.counts(axis.settings.user_min_rad);
        const auto high = axis.settings.axis.scale.counts(axis.settings.user_max_rad);
        if (!low) return pass(low);
        if (!high) return pass(high);
        axis.low = std::min(*low, *high);
        axis.high = std::max(*low, *high);
        add_order(axis_command(axis, fmt::format("NU{}", axis.low)));
        add_order(axis_command(axis, fmt::format("XU{}", axis.high)));
        return Is::done;
      });
    }
    const auto into = [](int& place) {
      return [&place](double value) -> Result<void> {
        place = static_cast<int>(std::lround(value));
        return {};
      };
    };
    add_number(axis_command(axis, "L"), into(axis.slowest));
    add_number(axis_command(axis, "U"), into(axis.fastest));
    if (axis.settings.base_velocity_rad_s) {
      add_number(axis_command(axis, "B"), [this, &axis](double value) -> Result<void> {
        add_base(axis, static_cast<int>(std::lround(value)));
        return {};
      });
    }
    add_number(axis_command(axis, "A"), [this, &axis](double value) -> Result<void> {
      axis.acceleration = static_cast<int>(std::lround(value));
      const auto wanted = axis.settings.axis.scale.rate(axis.settings.axis.max_acceleration_rad_s2);
      if (!wanted) return pass(wanted);
      add_acceleration(axis, *wanted);
      return {};
    });
  }
  if (settings_.limits == Limits::user) {
    steps_.add([this]() -> Result<Is> {
      add_order("LU");
      return Is::done;
    });
  }
}

}  // namespace rig::drivers::ptu
