// Whether a motor stands, by its position alone.
#pragma once

#include <cstdint>
#include <optional>

#include "core/base/clock.h"

namespace rig::drivers::cia402 {

class Standstill {
 public:
  /// A motor that has just been told to move may stand for a moment.
  void commanded(base::Time now) { since_ = now; }
  void saw(std::int32_t position, base::Time now) {
    changed_ = position_ && distance(*position_, position) > kJitter;
    if (!position_ || changed_) since_ = now;
    // A motor that creeps gets out of the jitter after some time.
    if (!position_ || changed_) position_ = position;
  }
  /// Whether the last look differed from the one before.
  [[nodiscard]] bool changed() const { return changed_; }
  /// Neither moved nor commanded for long enough to be sure.
  [[nodiscard]] bool is_sure(base::Time now) const { return position_ && now - since_ >= kSure; }

 private:
  // An encoder between two counts shows now the one, now the other.
  static constexpr std::int64_t kJitter = 2;
  static constexpr base::Duration kSure = std::chrono::milliseconds(100);
  static std::int64_t distance(std::int32_t a, std::int32_t b) {
    const std::int64_t d = std::int64_t{a} - b;
    return d < 0 ? -d : d;
  }

  std::optional<std::int32_t> position_;
  bool changed_ = false;
  base::Time since_{};
};

}  // namespace rig::drivers::cia402
