#include "sim/wire/tic.h"

#include <algorithm>
#include <cmath>
#include <mutex>

#include "sim/wire/tic_core.h"

namespace rig::sim::wire {

namespace {

enum Command : std::uint8_t {
  kReinitialize = 0x10,
  kSetSetting = 0x13,
  kExitSafeStart = 0x83,
  kEnergize = 0x85,
  kDeenergize = 0x86,
  kHaltAndHold = 0x89,
  kClearDriverError = 0x8A,
  kResetCommandTimeout = 0x8C,
  kEnterSafeStart = 0x8F,
  kSetCurrentLimit = 0x91,
  kSetDecayMode = 0x92,
  kSetStepMode = 0x94,
  kGoHome = 0x97,
  kSetAgcOption = 0x98,
  kGetVariable = 0xA1,
  kGetVariableAndClear = 0xA2,
  kGetSetting = 0xA8,
  kReset = 0xB0,
  kSetTargetPosition = 0xE0,
  kSetTargetVelocity = 0xE3,
  kSetStartingSpeed = 0xE5,
  kSetMaxSpeed = 0xE6,
  kSetMaxDecel = 0xE9,
  kSetMaxAccel = 0xEA,
  kHaltAndSetPosition = 0xEC,
};

constexpr std::size_t kVariables = 0x5A;
constexpr std::size_t kMostBytes = 128;

template <std::size_t N>
void write(std::array<std::uint8_t, N>& bytes, std::size_t at, std::int64_t value, std::size_t width) {
  const auto bits = static_cast<std::uint64_t>(value);
  for (std::size_t i = 0; i < width; ++i)
    bytes[at + i] = static_cast<std::uint8_t>((bits >> (8 * i)) & 0xFFU);
}

template <std::size_t N>
ControlAnswer part(const std::array<std::uint8_t, N>& all, const SetupPacket& s) {
  const std::size_t end = std::size_t{s.index} + s.length;
  if (s.value != 0 || s.length == 0 || s.length > kMostBytes || end > N) return ControlAnswer::stalled();
  return {ControlAnswer::Kind::done, {all.begin() + s.index, all.begin() + static_cast<std::ptrdiff_t>(end)}};
}

std::string name_of(TicProduct product) {
  switch (product) {
    case TicProduct::t825:
      return "Tic T825";
    case TicProduct::t834:
      return "Tic T834";
    case TicProduct::t500:
      return "Tic T500";
    case TicProduct::n825:
      return "Tic N825";
    case TicProduct::t249:
      return "Tic T249";
    case TicProduct::v36:
      return "Tic 36v4";
  }
  return "Tic";
}

UsbDescription description(const TicWorld& world) {
  constexpr std::uint16_t kPololu = 0x1FFB;
  UsbDescription made = vendor_device({kPololu, static_cast<std::uint16_t>(world.product), world.firmware},
                                      "Pololu Corporation", name_of(world.product), world.serial);
  made.strings.emplace(4, "-");  // the firmware is not modified
  return made;
}

bool is_quick(std::uint8_t command) {
  constexpr std::array kQuick{kReinitialize,        kExitSafeStart,  kEnergize,
                              kDeenergize,          kHaltAndHold,    kClearDriverError,
                              kResetCommandTimeout, kEnterSafeStart, kReset};
  return std::find(kQuick.begin(), kQuick.end(), command) != kQuick.end();
}

bool is_write7(std::uint8_t command) {
  constexpr std::array kWrite7{kSetCurrentLimit, kSetDecayMode, kSetStepMode, kGoHome, kSetAgcOption};
  return std::find(kWrite7.begin(), kWrite7.end(), command) != kWrite7.end();
}

}  // namespace

TicSettingBytes tic_factory_settings() {
  using namespace tic_setting;
  TicSettingBytes s{};
  s[kAutoClearDriverError] = 1;
  write(s, kCommandTimeout, 1000, 2);
  constexpr std::uint8_t k192mA = 6;
  s[kCurrentLimit] = k192mA;
  write(s, kMaxSpeed, 2'000'000, 4);
  write(s, kMaxAccel, 40'000, 4);
  constexpr std::uint8_t kDecelerateToHold = 2;
  s[kSoftErrorResponse] = kDecelerateToHold;
  write(s, kHomingTowards, 1'000'000, 4);
  write(s, kHomingAway, 500'000, 4);
  return s;
}

struct Tic::Impl {
  Impl(const TicWorld& w, const TicSettingBytes& settings, Clock c)
      : world(w), standard(description(w)), clock(std::move(c)), core(w, settings, clock()) {}

  const TicWorld world;
  StandardRequests standard;
  const Clock clock;
  std::mutex mutex;  // guards all below
  TicCore core;
  int stops = 0, feeds = 0, setting_writes = 0;

  /// Whatever is done or asked begins with the time that has passed.
  template <typename Use>
  auto now(Use&& use) {
    const std::lock_guard lock(mutex);
    core.advance(clock());
    return use();
  }

  ControlAnswer quick(std::uint8_t command) {
    switch (command) {
      case kHaltAndHold:
        ++stops;
        core.halt(std::nullopt);
        break;
      case kResetCommandTimeout:
        ++feeds;
        core.reset_command_timeout();
        break;
      case kDeenergize:
        ++stops;
        core.energize(false);
        break;
      case kEnergize:
        core.energize(true);
        break;
      case kExitSafeStart:
        core.exit_safe_start();
        break;
      case kEnterSafeStart:
        core.enter_safe_start();
        break;
      case kClearDriverError:
        core.clear_driver_error();
        break;
      default:  // kReset, kReinitialize
        core.reset();
        break;
    }
    return {};
  }

  ControlAnswer write7(std::uint8_t command, std::uint8_t value) {
    constexpr std::uint8_t kMostStepMode = 9;
    switch (command) {
      case kGoHome:
        if (value > 1) return ControlAnswer::stalled();
        core.go_home(value == 1);
        return {};
      case kSetStepMode:
        if (value > kMostStepMode) return ControlAnswer::stalled();
        core.temporary.step_mode = value;
        return {};
      case kSetCurrentLimit:
        core.temporary.current_limit = value;
        return {};
      case kSetDecayMode:
        core.temporary.decay_mode = value;
        return {};
      default:  // kSetAgcOption
        return world.product == TicProduct::t249 ? ControlAnswer{} : ControlAnswer::stalled();
    }
  }

  ControlAnswer write32(std::uint8_t command, std::uint32_t value) {
    const auto number = static_cast<std::int32_t>(value);
    switch (command) {
      case kSetTargetPosition:
        core.set_target(TicCore::Input::position, number);
        return {};
      case kSetTargetVelocity:
        if (number == 0) ++stops;
        core.set_target(TicCore::Input::velocity, number);
        return {};
      case kHaltAndSetPosition:
        core.halt(number);
        return {};
      case kSetStartingSpeed:
        core.temporary.starting_speed = value;
        return {};
      case kSetMaxSpeed:
        core.set_max_speed(value);
        return {};
      case kSetMaxAccel:
        core.set_max_accel(value);
        return {};
      case kSetMaxDecel:
        core.set_max_decel(value);
        return {};
      default:
        return ControlAnswer::stalled();
    }
  }

  ControlAnswer carry_out(const SetupPacket& s) {
    if (s.length != 0) return ControlAnswer::stalled();
    if (s.request == kSetSetting) {
      if (s.value > 0xFF || s.index >= kTicSettings) return ControlAnswer::stalled();
      core.settings[s.index] = static_cast<std::uint8_t>(s.value);
      ++setting_writes;
      return {};
    }
    if (is_quick(s.request)) {
      return s.value == 0 && s.index == 0 ? quick(s.request) : ControlAnswer::stalled();
    }
    if (is_write7(s.request)) {
      constexpr std::uint16_t kMost = 0x7F;
      if (s.value > kMost || s.index != 0) return ControlAnswer::stalled();
      return write7(s.request, static_cast<std::uint8_t>(s.value));
    }
    return write32(s.request, s.value | (static_cast<std::uint32_t>(s.index) << 16U));
  }

  std::array<std::uint8_t, kVariables> variables() {
    std::array<std::uint8_t, kVariables> v{};
    const bool to_position = core.planning() == TicCore::Planning::position;
    const bool to_velocity = core.planning() == TicCore::Planning::velocity;
    v[0x00] = static_cast<std::uint8_t>(core.operation());
    v[0x01] = core.flags();
    write(v, 0x02, core.errors(), 2);
    write(v, 0x04, core.occurred(), 4);
    v[0x09] = static_cast<std::uint8_t>(core.planning());
    write(v, 0x0A, to_position ? core.target() : 0, 4);
    write(v, 0x0E, to_velocity ? core.target() : 0, 4);
    write(v, 0x12, core.temporary.starting_speed, 4);
    write(v, 0x16, core.temporary.max_speed, 4);
    write(v, 0x1A, core.temporary.max_decel, 4);
    write(v, 0x1E, core.temporary.max_accel, 4);
    write(v, 0x22, core.position(), 4);
    constexpr double kSpeedUnits = 10000;
    write(v, 0x26, std::lround(core.velocity() * kSpeedUnits), 4);
    write(v, 0x2A, to_position ? core.target() : 0, 4);
    write(v, 0x33, core.outside.vin_mv, 2);
    write(v, 0x35, core.up_time().count(), 4);
    constexpr std::int64_t kNoInput = 0xFFFF;
    for (const unsigned at : {0x3DU, 0x3FU, 0x41U, 0x43U, 0x45U, 0x4DU, 0x4FU}) write(v, at, kNoInput, 2);
    v[0x49] = core.temporary.step_mode;
    v[0x4A] = core.temporary.current_limit;
    v[0x4B] = core.temporary.decay_mode;
    v[0x4C] = static_cast<std::uint8_t>(core.input());
    write(v, 0x51, core.input_value(), 4);
    return v;
  }

  ControlAnswer read(const SetupPacket& s) {
    switch (s.request) {
      case kGetSetting:
        return part(core.settings, s);
      case kGetVariable:
        return part(variables(), s);
      case kGetVariableAndClear: {
        ControlAnswer answer = part(variables(), s);
        if (answer.kind == ControlAnswer::Kind::done) core.forget_occurred();
        return answer;
      }
      default:
        return ControlAnswer::stalled();
    }
  }

  ControlAnswer control(const SetupPacket& s) {
    constexpr std::uint8_t kVendorOut = 0x40, kVendorIn = 0xC0;
    if (auto answered = standard.answer(s)) return *std::move(answered);
    if (s.request_type == kVendorOut) return carry_out(s);
    if (s.request_type == kVendorIn) return read(s);
    return ControlAnswer::stalled();
  }
};

Tic::Tic(const TicWorld& world, const TicSettingBytes& settings, Clock clock)
    : impl_(std::make_unique<Impl>(world, settings, std::move(clock))) {}
Tic::~Tic() = default;

ControlAnswer Tic::control(const SetupPacket& setup, std::span<const std::uint8_t> /*out*/) {
  return impl_->now([&] { return impl_->control(setup); });
}
void Tic::press_limit(bool forward, bool active) {
  impl_->now([&] {
    (forward ? impl_->core.outside.forward_pressed : impl_->core.outside.reverse_pressed) = active;
  });
}
void Tic::press_kill_switch(bool active) {
  impl_->now([&] { impl_->core.outside.kill_pressed = active; });
}
void Tic::set_vin_mv(int mv) {
  impl_->now([&] { impl_->core.outside.vin_mv = mv; });
}
void Tic::set_driver_error(bool lasts) {
  impl_->now([&] { impl_->core.outside.driver_error = lasts; });
}
void Tic::set_err_line(bool high) {
  impl_->now([&] { impl_->core.outside.err_line_high = high; });
}
void Tic::power_cycle() {
  impl_->now([&] { impl_->core.power_up(); });
}
void Tic::put_motor(double position) {
  impl_->now([&] { impl_->core.put_motor(position); });
}
double Tic::motor_position() {
  return impl_->now([&] { return impl_->core.motor_position(); });
}
std::int32_t Tic::position() {
  return impl_->now([&] { return impl_->core.position(); });
}
double Tic::velocity() {
  return impl_->now([&] { return impl_->core.velocity(); });
}
bool Tic::position_uncertain() {
  return impl_->now([&] { return impl_->core.uncertain(); });
}
bool Tic::energized() {
  return impl_->now([&] { return impl_->core.energized(); });
}
std::uint16_t Tic::error_status() {
  return impl_->now([&] { return static_cast<std::uint16_t>(impl_->core.errors()); });
}
int Tic::stops_seen() {
  return impl_->now([&] { return impl_->stops; });
}
int Tic::feeds_seen() {
  return impl_->now([&] { return impl_->feeds; });
}
int Tic::setting_writes_seen() {
  return impl_->now([&] { return impl_->setting_writes; });
}
TicSettingBytes Tic::settings() {
  return impl_->now([&] { return impl_->core.settings; });
}
void Tic::set_settings(const TicSettingBytes& settings) {
  impl_->now([&] {
    impl_->core.settings = settings;
    impl_->core.reset();
  });
}

}  // namespace rig::sim::wire
