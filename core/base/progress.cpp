#include "core/base/progress.h"

#include <cmath>
#include <cstdio>
#include <fmt/format.h>
#include <unistd.h>

namespace rig::base {

std::string format_duration(double seconds) {
  const long s = std::lround(seconds);
  if (s >= 3600) return fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60);
  return fmt::format("{}:{:02}", s / 60, s % 60);
}

Progress::Progress(std::string stage, std::size_t total, std::string unit)
    : stage_(std::move(stage)),
      unit_(std::move(unit)),
      total_(total),
      terminal_(::isatty(STDERR_FILENO) == 1),
      printed_(start_) {}

Progress::~Progress() {
  const std::lock_guard lock(mutex_);
  print(true);
}

void Progress::add(std::size_t n) {
  const std::lock_guard lock(mutex_);
  done_ += n;
  const auto pause = terminal_ ? std::chrono::milliseconds(200) : std::chrono::milliseconds(10000);
  if (Steady::now() - printed_ < pause) return;
  print(false);
}

void Progress::print(bool last) {
  printed_ = Steady::now();
  const double elapsed = std::chrono::duration<double>(printed_ - start_).count();
  const double share = total_ == 0 ? 1.0 : static_cast<double>(done_) / static_cast<double>(total_);
  std::string line = fmt::format("{}: {}/{} {}, {:.0f} %", stage_, done_, total_, unit_, 100.0 * share);
  if (last) {
    line += fmt::format(", {} in all", format_duration(elapsed));
  } else if (share > 0) {
    line += fmt::format(", {} left", format_duration(elapsed * (1.0 - share) / share));
  }
  fmt::print(stderr, "{}{}{}", terminal_ ? "\r\033[K" : "", line, terminal_ && !last ? "" : "\n");
  std::fflush(stderr);
}

}  // namespace rig::base
