#include "sim/wire/ptu.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <fmt/format.h>
#include <utility>

#include "sim/wire/promptness.h"

namespace rig::sim::wire {

using std::chrono::milliseconds;

namespace {

constexpr std::array kLetter{'P', 'T'};
constexpr std::array kWord{"Pan", "Tilt"};
// What waits to be read while the unit is deaf; the rest is not kept.
constexpr std::size_t kInputBuffer = 128;
constexpr std::ptrdiff_t kMostHeard = 1000;
constexpr double kResetAcceleration = 4e5;

std::optional<int> whole_number(std::string_view text) {
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

bool is_delimiter(char c) {
  return c == ' ' || c == '\r';
}

}  // namespace

Ptu::AxisState::AxisState(const AxisSetup& as)
    : setup(as), motor(as.stands_at, {static_cast<double>(as.low), static_cast<double>(as.high)}) {}

Ptu::Ptu(Setup setup)
    : setup_(std::move(setup)),
      line_(setup_.link),
      answers_(line_, setup_.lateness),
      axes_{AxisState(setup_.axes[pan]), AxisState(setup_.axes[tilt])} {
  make_fresh();
  thread_ = std::thread([this] { run(); });
}

Ptu::~Ptu() {
  quit_ = true;
  thread_.join();
}

void Ptu::run() {
  answer_promptly();
  while (!quit_) {
    const std::string bytes = line_.read(milliseconds(2));
    const std::lock_guard lock(mutex_);
    const Time now = std::chrono::steady_clock::now();
    if (echo_ && !deaf(now)) answers_.say(bytes);
    for (const char c : bytes) {
      if (c == '\n' || input_.size() >= kInputBuffer) continue;
      input_.push_back(static_cast<char>(std::toupper(static_cast<unsigned char>(c))));
    }
    step(now);
  }
}

void Ptu::step(Time now) {
  answers_.tick(now);
  step_motors(now);
  if (reset_) {
    if (setup_.halt_ends_reset) take_halts_out_of_reset(now);
    if (reset_) step_reset(now);
  }
  while (!deaf(now)) {
    if (std::exchange(owes_reply_, false)) fine(now);
    if (awaiting_) {
      if (axes_[pan].motor.moving(now) || axes_[tilt].motor.moving(now)) return;
      awaiting_ = false;
      fine(now);
    }
    const auto end = std::find_if(input_.begin(), input_.end(), is_delimiter);
    if (end == input_.end()) return;
    const std::string text(input_.begin(), end);
    input_.erase(input_.begin(), end + 1);
    if (!text.empty()) command(now, text);
  }
}

void Ptu::step_motors(Time now) {
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    AxisState& a = axes_[i];
    const double at = a.motor.position(now);
    const bool moving = a.motor.moving(now);
    const double velocity = a.motor.velocity(now);
    const bool upwards = velocity != 0 ? velocity > 0 : a.motor.target() > at;
    const bool hit = moving && (upwards ? a.pressed_high : a.pressed_low);
    // The mechanics end before the counter has got where it was sent: the steps are lost.
    const bool blocked = a.was_moving && !moving && !reset_ && std::abs(a.desired + a.offset - at) > 0.5 &&
                         (at <= a.setup.low || at >= a.setup.high);
    if (hit || blocked) {
      a.motor.put(now, std::round(at));
      a.desired = counter(now, a);
      answers_.say(fmt::format("!{}{}", kLetter[i], setup_.line_end));
    } else if (a.was_moving && !moving) {
      a.motor.put(now, std::round(at));  // a stepper rests on a step
    }
    a.was_moving = a.motor.moving(now);
  }
}

void Ptu::begin_reset(Time now, std::vector<std::size_t> axes, bool asked) {
  reset_ = Reset{std::move(axes), 0, asked};
  for (const std::size_t i : reset_->axes) axes_[i].low = axes_[i].high = 0;
  start_leg(now);
}

void Ptu::start_leg(Time now) {
  AxisState& a = axes_[reset_->axes.front()];
  const std::array<double, 3> ends{static_cast<double>(a.setup.low), static_cast<double>(a.setup.high), 0};
  a.motor.move_to(now, ends.at(static_cast<std::size_t>(reset_->leg)), setup_.reset_speed,
                  kResetAcceleration);
}

void Ptu::step_reset(Time now) {
  const std::size_t axis = reset_->axes.front();
  AxisState& a = axes_[axis];
  if (a.motor.moving(now)) return;
  // Each stop that it finds is told, all of them in one line with the reply.
  if (reset_->leg < 2) answers_.say(fmt::format("!{}", kLetter[axis]));
  if (++reset_->leg < 3) return start_leg(now);
  a.offset = 0;
  a.desired = 0;
  a.low = a.setup.low;
  a.high = a.setup.high;
  reset_->axes.erase(reset_->axes.begin());
  reset_->leg = 0;
  if (!reset_->axes.empty()) return start_leg(now);
  const bool asked = reset_->asked;
  reset_.reset();
  if (reset_fails_) {
    reset_fails_ = false;
    for (AxisState& each : axes_) each.low = each.high = 0;
    return refuse(now, "Axis error");
  }
  if (asked) {
    fine(now);
  } else {
    answers_.say("*" + setup_.line_end);
  }
}

void Ptu::take_halts_out_of_reset(Time now) {
  for (std::size_t begin = 0; begin < input_.size();) {
    const auto end =
        std::find_if(input_.begin() + static_cast<std::ptrdiff_t>(begin), input_.end(), is_delimiter);
    if (end == input_.end()) return;
    const std::string text(input_.begin() + static_cast<std::ptrdiff_t>(begin), end);
    if (text == "H" || text == "HP" || text == "HT") {
      const AxisState& resetting = axes_[reset_->axes.front()];
      for (AxisState& a : axes_) {
        if (&a == &resetting) a.offset = a.motor.position(now);
      }
      reset_.reset();
      return;  // and the command is carried out with the rest
    }
    begin = static_cast<std::size_t>(end - input_.begin()) + 1;
  }
}

void Ptu::halt(Time now, std::size_t axis) {
  AxisState& a = axes_[axis];
  ++a.halts;
  a.motor.stop(now, a.acceleration);
}

int Ptu::counter(Time now, AxisState& axis) const {
  const double at = axis.motor.position(now) - axis.offset;
  if (!axis.motor.moving(now)) return static_cast<int>(std::lround(at));
  // Only a step that was made counts.
  return static_cast<int>(axis.motor.velocity(now) > 0 ? std::floor(at) : std::ceil(at));
}

void Ptu::power_up(Time now) {
  input_.clear();
  reset_.reset();
  awaiting_ = false;
  owes_reply_ = false;
  busy_until_ = {};
  echo_ = saved_echo_;
  wordy_ = saved_wordy_;
  limits_ = Limits::factory;
  resets_ = {tilt, pan};
  for (AxisState& a : axes_) {
    const double at = std::round(a.motor.position(now));
    a.motor.put(now, at);
    a.offset = at;
    a.desired = 0;
    a.speed = 1000;
    a.acceleration = 2000;
    a.base = 57;
    a.fastest = 2902;
    a.slowest = 31;
    a.low = a.high = 0;
    a.user_low = a.user_high = 0;
    a.hold = 'L';
    a.was_moving = false;
  }
  answers_.say(setup_.banner);
  if (setup_.resets_at_power_up) begin_reset(now, {tilt, pan}, false);
}

void Ptu::spoil(Answers::Spoil how, int answers) {
  const std::lock_guard lock(mutex_);
  answers_.spoil(how, answers);
}

void Ptu::power_cycle() {
  const std::lock_guard lock(mutex_);
  power_up(std::chrono::steady_clock::now());
}

void Ptu::save_modes() {
  const std::lock_guard lock(mutex_);
  saved_echo_ = echo_;
  saved_wordy_ = wordy_;
}

void Ptu::nudge(std::size_t axis, int target) {
  const std::lock_guard lock(mutex_);
  AxisState& a = axes_.at(axis);
  const Time now = std::chrono::steady_clock::now();
  a.desired = target;
  a.motor.move_to(now, target + a.offset, a.speed, a.acceleration);
  a.was_moving = true;
}

void Ptu::press(std::size_t axis, bool high, bool pressed) {
  const std::lock_guard lock(mutex_);
  (high ? axes_.at(axis).pressed_high : axes_.at(axis).pressed_low) = pressed;
}

void Ptu::fail_next_reset() {
  const std::lock_guard lock(mutex_);
  reset_fails_ = true;
}

void Ptu::set_temperature_degF(int degrees) {
  const std::lock_guard lock(mutex_);
  degF_ = degrees;
}

void Ptu::make_fresh() {
  line_.restore();
  const std::lock_guard lock(mutex_);
  const Time now = std::chrono::steady_clock::now();
  answers_.forget();
  saved_echo_ = saved_wordy_ = true;
  reset_fails_ = false;
  degF_ = 86;
  heard_.clear();
  for (AxisState& a : axes_) {
    a.pressed_low = a.pressed_high = false;
    a.motor.put(now, a.setup.stands_at);
  }
  power_up(now);
}

double Ptu::position(std::size_t axis) {
  const std::lock_guard lock(mutex_);
  return axes_.at(axis).motor.position(std::chrono::steady_clock::now());
}

bool Ptu::moving(std::size_t axis) {
  const std::lock_guard lock(mutex_);
  // A pause between two legs of a reset is part of it.
  if (reset_ && std::find(reset_->axes.begin(), reset_->axes.end(), axis) != reset_->axes.end()) return true;
  return axes_.at(axis).motor.moving(std::chrono::steady_clock::now());
}

int Ptu::halts(std::size_t axis) {
  const std::lock_guard lock(mutex_);
  return axes_.at(axis).halts;
}

std::vector<std::string> Ptu::heard() {
  const std::lock_guard lock(mutex_);
  return heard_;
}

void Ptu::forget_heard() {
  const std::lock_guard lock(mutex_);
  heard_.clear();
}

void Ptu::fine(Time now, const std::string& text) {
  answers_.send(now, (text.empty() ? "*" : "* " + text) + setup_.line_end);
}

void Ptu::refuse(Time now, const std::string& why) {
  answers_.send(now, "! " + why + setup_.line_end);
}

void Ptu::number(Time now, const std::string& words, const std::string& value, const std::string& after) {
  fine(now, wordy_ ? words + value + after : value);
}

void Ptu::command(Time now, const std::string& text) {
  heard_.push_back(text);
  if (std::ssize(heard_) > kMostHeard) heard_.erase(heard_.begin(), heard_.begin() + kMostHeard / 2);
  const auto letter = std::find(kLetter.begin(), kLetter.end(), text[0]);
  if (letter == kLetter.end()) return general(now, text);
  const auto axis = static_cast<std::size_t>(letter - kLetter.begin());
  std::size_t letters = 1;
  while (letters < text.size() && std::isalpha(static_cast<unsigned char>(text[letters])) != 0) ++letters;
  const std::string what = text.substr(1, letters - 1);
  const std::string rest = text.substr(letters);
  const auto value = whole_number(rest);
  if (!rest.empty() && !value) return refuse(now, "Illegal argument");
  for_axis(now, axis, what, value);
}

void Ptu::go_to(Time now, std::size_t axis, int target) {
  AxisState& a = axes_[axis];
  const bool user = limits_ == Limits::user;
  const int low = user ? a.user_low : a.low;
  const int high = user ? a.user_high : a.high;
  if (limits_ != Limits::off && target > high) {
    return refuse(now, fmt::format("Maximum allowable {} position is {}", kWord[axis], high));
  }
  if (limits_ != Limits::off && target < low) {
    return refuse(now, fmt::format("Minimum allowable {} position is {}", kWord[axis], low));
  }
  a.desired = target;
  a.motor.move_to(now, target + a.offset, a.speed, a.acceleration);
  // One that stands on a stop and is sent further in has not moved, but it hits it.
  a.was_moving = true;
  fine(now);
}

void Ptu::for_axis(Time now, std::size_t axis, const std::string& what, std::optional<int> value) {
  AxisState& a = axes_[axis];
  const std::string word = kWord[axis];
  const std::string per_second = " positions/sec";
  const auto held = [&](int& place, const std::string& words, const std::string& after) {
    if (!value) return number(now, words, std::to_string(place), after);
    place = *value;
    fine(now);
  };
  // A setting whose tables take their time, and not on the fly.
  const auto tabled = [&](int& place, const std::string& words) {
    if (!value) return number(now, words, std::to_string(place), per_second);
    if (a.motor.moving(now)) return refuse(now, "Cannot be changed on the fly");
    if (*value < 1) return refuse(now, "Illegal argument");
    place = *value;
    busy_until_ = now + setup_.tables;
    owes_reply_ = !setup_.says_done_first;
    if (!owes_reply_) fine(now);
  };
  if (what == "P") {
    if (value) return go_to(now, axis, *value);
    return number(now, fmt::format("Current {} position is ", word), std::to_string(counter(now, a)));
  }
  if (what == "O") {
    if (value) return go_to(now, axis, counter(now, a) + *value);
    return number(now, fmt::format("Target {} position is ", word), std::to_string(std::lround(a.desired)));
  }
  if (what == "S") {
    if (value && *value > a.fastest) {
      return refuse(now, fmt::format("{} speed cannot exceed {} positions/sec", word, a.fastest));
    }
    if (value && *value < a.slowest) {
      return refuse(now, fmt::format("Motor speed cannot be less than {} pos/sec", a.slowest));
    }
    return held(a.speed, fmt::format("Target {} speed is ", word), per_second);
  }
  if (what == "D" && !value) {
    return number(now, fmt::format("Current {} speed is ", word),
                  std::to_string(std::lround(std::abs(a.motor.velocity(now)))), per_second);
  }
  if (what == "A") return tabled(a.acceleration, fmt::format("{} acceleration is ", word));
  if (what == "B") return tabled(a.base, fmt::format("Current {} base speed is ", word));
  if (what == "U") return tabled(a.fastest, fmt::format("Maximum {} speed is ", word));
  if (what == "L") {
    if (value && *value < 31) return refuse(now, "Motor speed cannot be less than 31 pos/sec");
    return held(a.slowest, fmt::format("Minimum {} speed is ", word), per_second);
  }
  if (what == "R" && !value) return number(now, "", a.setup.resolution, setup_.resolution_words);
  if (what == "N" && !value)
    return number(now, fmt::format("Minimum {} position is ", word), std::to_string(a.low));
  if (what == "X" && !value)
    return number(now, fmt::format("Maximum {} position is ", word), std::to_string(a.high));
  if (what == "NU") return held(a.user_low, fmt::format("Minimum user {} position is ", word), "");
  if (what == "XU") return held(a.user_high, fmt::format("Maximum user {} position is ", word), "");
  if ((what == "HR" || what == "HL" || what == "HO") && !value) {
    a.hold = what[1];
    return fine(now);
  }
  refuse(now, "Illegal command");
}

void Ptu::general(Time now, const std::string& text) {
  const auto both = [&](auto&& act) {
    act(std::size_t{pan});
    act(std::size_t{tilt});
  };
  if (text == "H") {
    both([&](std::size_t i) { halt(now, i); });
  } else if (text == "HP" || text == "HT") {
    halt(now, text == "HP" ? pan : tilt);
  } else if (text == "A") {
    awaiting_ = true;
    return;
  } else if (text == "I" || text == "CI") {
    // As it always works here: neither slaved execution nor pure velocity is spoken.
  } else if (text == "ED" || text == "EE") {
    echo_ = text == "EE";
  } else if (text == "FT" || text == "FV") {
    wordy_ = text == "FV";
  } else if (text == "F") {
    return fine(now, wordy_ ? "ASCII verbose mode" : "ASCII terse mode");
  } else if (text == "LE" || text == "LU" || text == "LD") {
    limits_ = text == "LE" ? Limits::factory : text == "LU" ? Limits::user : Limits::off;
  } else if (text == "O") {
    return fine(now, fmt::format("Input 30 VDC @ {} degF", degF_));
  } else if (text == "V") {
    return fine(
        now,
        "Pan-Tilt Controller v2.12.1d1(C14/E), (C)2003 FLIR Commercial Systems, Inc., All Rights Reserved");
  } else if (text == "DS") {
    saved_echo_ = echo_;
    saved_wordy_ = wordy_;
  } else if (text == "R") {
    if (!resets_.empty()) return begin_reset(now, resets_, true);
  } else if (text == "RD" || text == "RP" || text == "RT" || text == "RE") {
    std::vector<std::size_t> which;
    if (text == "RT" || text == "RE") which.push_back(tilt);
    if (text == "RP" || text == "RE") which.push_back(pan);
    if (setup_.one_axis_at_once && !which.empty()) return begin_reset(now, which, true);
    resets_ = which;
  } else {
    return refuse(now, "Illegal command");
  }
  fine(now);
}

}  // namespace rig::sim::wire
