// What a 6000 controller does for each command.
#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <fmt/format.h>

#include "sim/wire/sixk.h"

namespace rig::sim::wire {

namespace {

constexpr const char* kPromptFine = "\r\n> ";
constexpr const char* kPromptBad = "\r\n? ";

// The commands it knows. A name is the longest one that a line begins with: "HOMX1" is HOM with a mask.
constexpr std::array<std::string_view, 36> kNames{
    "COMEXC", "COMEXS", "ERRLVL", "ERRBAD", "AXSDEF", "HOMBAC", "HOMEDG", "HOMDF", "HOMVF",
    "HOMAD",  "ERROK",  "SCALE",  "DRIVE",  "PESET",  "LSPOS",  "LSNEG",  "ECHO",  "HOMV",
    "HOMA",   "PSET",   "DRES",   "ERES",   "TREV",   "HOM",    "TAS",    "TPM",   "TPE",
    "EOT",    "BOT",    "MA",     "MC",     "LH",     "LS",     "AD",     "GO",    "V"};
constexpr std::array<std::string_view, 4> kLetters{"A", "D", "S", "K"};

std::string_view name_of(std::string_view command) {
  for (const std::string_view name : kNames) {
    if (command.starts_with(name)) return name;
  }
  for (const std::string_view name : kLetters) {
    if (command.starts_with(name)) return name;
  }
  return {};
}

std::optional<double> number(std::string_view text) {
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  double value = 0;
  const auto [end, error] =
      std::from_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

bool is_mask(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c == '0' || c == '1' || c == 'X'; });
}

}  // namespace

void Sixk::execute(Time now, const std::string& command) {
  std::string rest = command;
  std::optional<std::size_t> axis;
  if (!rest.empty() && std::isdigit(static_cast<unsigned char>(rest.front())) != 0) {
    axis = static_cast<std::size_t>(rest.front() - '0');
    rest.erase(0, 1);
  }
  const std::string name(name_of(rest));
  const std::string value = rest.substr(name.size());
  // In an answer the command stands as it came, without what it was given.
  const std::string shown = command.substr(0, command.size() - value.size());
  if (name.empty()) return answer(now, shown, {"UNDEFINED LABEL", true});
  if (axis && (*axis == 0 || *axis > axes_.size())) return answer(now, shown, {"INVALID AXIS", true});
  answer(now, shown, axis ? obey(now, *axis - 1, name, value) : obey_all(now, name, value));
}

void Sixk::answer(Time now, const std::string& name, const Reply& reply) {
  const bool full = error_level_ == 4;
  std::string bytes;
  if (!reply.text.empty() && (full || !reply.refused)) {
    if (reply.refused) bytes += "\r\n";
    bytes += "*" + (full && !reply.refused ? name : std::string()) + reply.text + end_;
  }
  if (full) bytes += reply.refused ? kPromptBad : kPromptFine;
  if (!bytes.empty()) answers_.send(now, bytes);
}

Sixk::Reply Sixk::obey(Time now, std::size_t index, const std::string& name, const std::string& value) {
  AxisState& a = axes_[index];
  const std::string mask(index, 'X');
  if (name == "TAS" && value.empty()) return {status(now, a)};
  if (name == "TPM" && value.empty()) return {fmt::format("{:+d}", std::lround(counter(now, a)))};
  if (name == "TPE" && value.empty()) {
    const double turns = a.motor.position(now) / a.resolution;
    const double counts =
        a.setup.servo ? counter(now, a) : turns * a.setup.encoder_per_turn - a.encoder_offset + a.slip;
    return {fmt::format("{:+d}", std::lround(counts))};
  }
  if (name == "GO" && value.empty()) return go(now, mask + "1");
  if (name == "HOM") return home(now, mask + value);
  if (name == "S" || name == "K") {
    stop(now, std::string(index, '0') + "1", name == "K");
    return {};
  }
  const auto given = number(value);
  if (!value.empty() && !given) return {"INVALID DATA", true};
  const auto real = [&](double& place, double least) -> Reply {
    if (!given) return {fmt::format("{:.4f}", place)};
    if (*given < least) return {"INVALID DATA", true};
    place = *given;
    return {};
  };
  const auto flag = [&](bool& place) -> Reply {
    if (!given) return {place ? "1" : "0"};
    if (*given != 0 && *given != 1) return {"INVALID DATA", true};
    place = *given == 1;
    return {};
  };
  if (name == "D") {
    if (!given) return {fmt::format("{:+d}", std::lround(a.distance))};
    a.distance = std::trunc(*given);
    return {};
  }
  if (name == "V") return real(a.velocity, 0);
  if (name == "A") {
    if (given && *given > 0) a.deceleration = *given;
    return real(a.acceleration, 0.0001);
  }
  if (name == "AD") return real(a.deceleration, 0.0001);
  if (name == "HOMV") return real(a.home_velocity, 0);
  if (name == "HOMA") return real(a.home_acceleration, 0.0001);
  if (name == "MA") return flag(a.absolute);
  if (name == "MC") return flag(a.continuous);
  if (name == (a.setup.servo ? "ERES" : "DRES")) {
    if (!given) return {std::to_string(a.resolution)};
    a.resolution = static_cast<int>(*given);
    return {};
  }
  if (name == "LH") {
    if (!given) return {std::to_string(a.hard_limits)};
    a.hard_limits = static_cast<int>(*given);
    return {};
  }
  if (name == "DRIVE") {
    if (!given) return {a.drive ? "1" : "0"};
    if (*given == 0) {
      drive_off(now, a);
      return {};
    }
    if (a.faulty) return {"DRIVE FAULT", true};
    a.drive = true;
    a.stalled = a.strayed = false;
    return {};
  }
  if (name == "PSET" && given) {
    a.offset = a.motor.position(now) - *given;
    return {};
  }
  if (name == "PESET" && given) {
    a.encoder_offset = a.motor.position(now) / a.resolution * a.setup.encoder_per_turn - *given;
    a.slip = 0;
    return {};
  }
  if (name == "HOMVF" || name == "HOMAD" || name == "HOMBAC" || name == "HOMDF" || name == "HOMEDG" ||
      name == "LS" || name == "LSPOS" || name == "LSNEG") {
    return {};  // of no consequence here
  }
  return {"INVALID COMMAND", true};
}

Sixk::Reply Sixk::obey_all(Time now, const std::string& name, const std::string& value) {
  if (name == "TREV" && value.empty()) return {setup_.revision};
  if (name == "AXSDEF" && value.empty()) {
    std::vector<bool> servo;
    for (const AxisState& a : axes_) servo.push_back(a.setup.servo);
    return {groups(servo)};
  }
  if (name == "GO") return go(now, value.empty() ? std::string(axes_.size(), '1') : value);
  if (name == "HOM") return home(now, value);
  if (name == "S" || name == "K") {
    if (!is_mask(value)) return {"INVALID DATA", true};
    stop(now, value.empty() ? std::string(axes_.size(), '1') : value, name == "K");
    return {};
  }
  if (name == "MA" || name == "MC" || name == "DRIVE" || name == "LH") {
    for (std::size_t i = 0; i < value.size() && i < axes_.size(); ++i) {
      if (value[i] == 'X') continue;
      if (auto reply = obey(now, i, name, value.substr(i, 1)); reply.refused) return reply;
    }
    return {};
  }
  if (name == "EOT") {
    end_.clear();
    for (std::size_t at = 0; at < value.size();) {
      const std::size_t comma = std::min(value.find(',', at), value.size());
      const auto code = number(value.substr(at, comma - at));
      if (!code) return {"INVALID DATA", true};
      if (*code != 0) end_.push_back(static_cast<char>(*code));
      at = comma + 1;
    }
    return {};
  }
  const auto given = number(value);
  if (name == "ERRLVL") {
    if (!given) return {std::to_string(error_level_)};
    if (*given != 1 && *given != 4) return {"INVALID DATA", true};  // the levels that this one speaks
    error_level_ = static_cast<int>(*given);
    return {};
  }
  if (name == "ECHO" && given) {
    echo_ = *given == 1;
    return {};
  }
  if (name == "COMEXC" && given) {
    continuous_execution_ = *given == 1;
    return {};
  }
  if (name == "SCALE" && given && *given == 0) return {};
  if (name == "COMEXS" || name == "BOT" || name == "ERROK" || name == "ERRBAD") return {};
  return {"INVALID COMMAND", true};
}

Sixk::Reply Sixk::go(Time now, const std::string& mask) {
  if (!is_mask(mask) || mask.size() > kMostAxes) return {"INVALID DATA", true};
  for (std::size_t i = 0; i < mask.size() && i < axes_.size(); ++i) {
    if (mask[i] != '1') continue;
    AxisState& a = axes_[i];
    if (!a.drive) return {"DRIVE SHUTDOWN", true};
    const double here = a.motor.position(now);
    const double target = a.absolute ? a.distance + a.offset : here + a.distance;
    if (a.hard_limits != 0 && ((target > here && a.pressed_high) || (target < here && a.pressed_low))) {
      return {fmt::format("INVALID CONDITIONS FOR COMMAND-AXIS {}", i + 1), true};
    }
    if (!a.motor.moving(now)) a.lags_until = now + setup_.start_lag;
    a.motor.move_to(now, target, a.velocity * a.resolution, a.acceleration * a.resolution);
    a.was_moving = true;
  }
  return {};
}

Sixk::Reply Sixk::home(Time now, const std::string& mask) {
  if (mask.empty() || !is_mask(mask) || mask.size() > kMostAxes) return {"INVALID DATA", true};
  for (std::size_t i = 0; i < mask.size() && i < axes_.size(); ++i) {
    if (mask[i] == 'X') continue;
    AxisState& a = axes_[i];
    if (!a.drive) return {"DRIVE SHUTDOWN", true};
    a.homed = false;
    a.homing_upwards = mask[i] == '0';
    a.homing = Homing::seeking;
    a.lags_until = now + setup_.start_lag;
    a.motor.run(now, (a.homing_upwards ? 1 : -1) * a.home_velocity * a.resolution,
                a.home_acceleration * a.resolution);
    a.was_moving = true;
  }
  return {};
}

void Sixk::stop(Time now, const std::string& mask, bool kill) {
  buffered_.clear();
  for (std::size_t i = 0; i < mask.size() && i < axes_.size(); ++i) {
    if (mask[i] != '1') continue;
    AxisState& a = axes_[i];
    ++a.stops;
    a.homing = Homing::none;
    a.lags_until.reset();
    if (kill) {
      a.motor.put(now, std::round(a.motor.position(now)));
    } else {
      a.motor.stop(now, a.deceleration * a.resolution);
    }
  }
}

}  // namespace rig::sim::wire
