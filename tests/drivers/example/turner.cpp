#include "tests/drivers/example/turner.h"

#include <cctype>
#include <cstdio>
#include <fmt/format.h>
#include <utility>

namespace rig::sim::wire {

using std::chrono::milliseconds;
using Steady = std::chrono::steady_clock;

namespace {

// Hard stops at -60 and 60 degrees.
constexpr double kEnd = 60 * Turner::kCountsPerDegree;
constexpr double kMiddle = 5 * Turner::kCountsPerDegree;
constexpr double kHomingSpeed = 20 * Turner::kCountsPerDegree;
constexpr double kBrake = 400 * Turner::kCountsPerDegree;
// Beyond a driver's deadline of 100 ms, and before that of its second attempt.
constexpr milliseconds kLate{150};

unsigned sum_of(const std::string& bytes) {
  unsigned sum = 0;
  for (const char byte : bytes) sum += static_cast<unsigned char>(byte);
  return sum & 0xFFU;
}

}  // namespace

Turner::Turner(std::filesystem::path link) : motor_(kMiddle, {-kEnd, kEnd}), pty_(std::move(link)) {
  power_up();
  thread_ = std::thread([this] { serve(); });
}

Turner::~Turner() {
  over_ = true;
  thread_.join();
}

void Turner::serve() {
  constexpr milliseconds kTurn{2};
  while (!over_) {
    take_in(pty_.read(kTurn));
    send_due();
  }
}

void Turner::take_in(const std::string& bytes) {
  const std::lock_guard lock(mutex_);
  for (const char byte : bytes) {
    if (byte != '\n') {
      come_ += byte;
      continue;
    }
    std::string line = answer(std::exchange(come_, {}));
    if (line.empty()) continue;
    Coming coming{Steady::now(), line};
    if (spoilt_ > 0) {
      --spoilt_;
      if (how_ == Answers::missing) continue;
      if (how_ == Answers::two_of_three && spoilt_ % 3 != 0) continue;
      if (how_ == Answers::garbage) coming.bytes = "0Q 77\x80 3f*\n";
      if (how_ == Answers::late) coming.at += kLate;
      if (how_ == Answers::doubled) coming.bytes += line;
    }
    coming_.push_back(std::move(coming));
  }
}

void Turner::send_due() {
  std::string due;
  {
    const std::lock_guard lock(mutex_);
    const auto now = Steady::now();
    for (auto it = coming_.begin(); it != coming_.end();) {
      if (it->at > now) {
        ++it;
        continue;
      }
      due += it->bytes;
      it = coming_.erase(it);
    }
  }
  pty_.write(due);
}

// A request with a wrong sum, or without a tag, is noise: it is not answered.
std::string Turner::answer(const std::string& line) {
  const auto star = line.rfind('*');
  if (star == std::string::npos || line.size() != star + 3) return {};
  const std::string body = line.substr(0, star);
  if (fmt::format("{:02X}", sum_of(body)) != line.substr(star + 1)) return {};
  if (body.size() < 2 || std::isdigit(static_cast<unsigned char>(body[0])) == 0) return {};
  const std::string answer = body.substr(0, 1) + carry_out(body.substr(1));
  return fmt::format("{}*{:02X}\n", answer, sum_of(answer));
}

std::string Turner::carry_out(const std::string& text) {
  end_homing();
  if (text == "Q") return report();
  if (text == "S") {
    ++stops_;
    stop_motor();
    return "S ok";
  }
  if (text == "E 0" || text == "E 1") {
    energised_ = text == "E 1";
    if (!energised_) stop_motor();
    if (energised_) fault_ = fault_lasts_;
    if (fault_) energised_ = false;
    return fault_ ? "E no fault" : "E ok";
  }
  if (text == "H") {
    if (!energised_) return fault_ ? "H no fault" : "H no off";
    homed_ = false;
    homing_ = true;
    motor_.move_to(Steady::now(), 0, kHomingSpeed, kBrake);
    return "H ok";
  }
  if (!text.empty() && text[0] == 'M') return move(text);
  return fmt::format("{} no command", text.substr(0, 1));
}

std::string Turner::move(const std::string& text) {
  int counts = 0;
  int speed = 0;
  int acceleration = 0;
  char more = 0;
  if (std::sscanf(text.c_str(), "M %d %d %d%c", &counts, &speed, &acceleration, &more) != 3)
    return "M no command";
  if (fault_) return "M no fault";
  if (!energised_) return "M no off";
  if (homing_) return "M no busy";
  if (!homed_) return "M no unhomed";
  const auto now = Steady::now();
  const double target = counts + zero_;
  const double here = motor_.position(now);
  if (speed <= 0 || acceleration <= 0 || target < -kEnd || target > kEnd) return "M no range";
  if ((high_ && target > here) || (low_ && target < here)) return "M no limit";
  motor_.move_to(now, target, speed, acceleration);
  return "M ok";
}

std::string Turner::report() {
  const auto now = Steady::now();
  const auto bit = [](bool on, int value) { return on ? value : 0; };
  const int flags = bit(motor_.moving(now), 1) | bit(homed_, 2) | bit(energised_, 4) | bit(low_, 8) |
                    bit(high_, 16) | bit(fault_, 32);
  return fmt::format("Q {:.0f} {}", motor_.position(now) - zero_, flags);
}

void Turner::end_homing() {
  if (!homing_ || motor_.moving(Steady::now())) return;
  homing_ = false;
  homed_ = true;
  zero_ = 0;
}

void Turner::stop_motor() {
  homing_ = false;
  motor_.stop(Steady::now(), kBrake);
}

void Turner::spoil(Answers how, int count) {
  const std::lock_guard lock(mutex_);
  how_ = how;
  spoilt_ = count;
}

void Turner::power_up() {
  const std::lock_guard lock(mutex_);
  const auto now = Steady::now();
  motor_.put(now, motor_.position(now));
  zero_ = motor_.position(now);
  energised_ = homed_ = homing_ = false;
  fault_ = fault_lasts_;
}

void Turner::reset() {
  restore();
  {
    const std::lock_guard lock(mutex_);
    motor_.put(Steady::now(), kMiddle);
    fault_lasts_ = low_ = high_ = false;
    spoilt_ = 0;
    coming_.clear();
    come_.clear();
  }
  power_up();
}

void Turner::press_limit(bool high, bool pressed) {
  const std::lock_guard lock(mutex_);
  (high ? high_ : low_) = pressed;
  const auto now = Steady::now();
  if (pressed && motor_.moving(now) && (motor_.velocity(now) > 0) == high) stop_motor();
}

void Turner::set_fault(bool on) {
  const std::lock_guard lock(mutex_);
  fault_lasts_ = on;
  if (!on) return;
  fault_ = true;
  energised_ = false;
  stop_motor();
}

double Turner::true_counts() {
  const std::lock_guard lock(mutex_);
  return motor_.position(Steady::now());
}

bool Turner::moving() {
  const std::lock_guard lock(mutex_);
  return motor_.moving(Steady::now());
}

}  // namespace rig::sim::wire
