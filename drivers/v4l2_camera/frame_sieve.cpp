#include "drivers/v4l2_camera/frame_sieve.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace rig::drivers::v4l2 {

namespace {

// A stamp taken by an interrupt is late by what the machine was busy with.
constexpr double kStampJitter_s = 2e-3;
constexpr double kStampShare = 0.05;
// One frame that is too quick is a stamp that was late; so many are a camera that does not expose as it says.
constexpr int kMostQuick = 5;
// Of frame numbers: further ahead is no gap but a stream that began anew.
constexpr std::uint32_t kFurthest = 1U << 31U;

std::int64_t nanoseconds(double s) {
  return static_cast<std::int64_t>(std::ceil(s * 1e9));
}

}  // namespace

void FrameSieve::set(std::int64_t at_ns, double exposure_s, int settle) {
  set_ns_ = at_ns;
  longest_s_ = settle_left_ > 0 ? std::max(longest_s_, exposure_s) : std::max(exposure_s_, exposure_s);
  exposure_s_ = exposure_s;
  settle_left_ = settle;
  quick_in_a_row_ = 0;
}

std::int64_t FrameSieve::earliest_ns(const FrameFacts& facts) const {
  const double before_s = longest_s_ + (facts.stamp_is_start ? 0 : interval_s_);
  return facts.stamp_ns - nanoseconds(before_s);
}

bool FrameSieve::is_too_quick(const FrameFacts& facts) const {
  if (!last_ || facts.sequence != last_->sequence + 1) return false;
  const double after_s = static_cast<double>(facts.stamp_ns - last_->stamp_ns) * 1e-9;
  return after_s < exposure_s_ * (1 - kStampShare) - kStampJitter_s;
}

Judgement FrameSieve::judge(const FrameFacts& facts) {
  if (!facts.monotonic) {
    return {Verdict::bad, "its driver stamps frames by no clock that is known: an old one could not be told"};
  }
  const std::int64_t earliest = earliest_ns(facts);
  if (earliest < set_ns_) return {Verdict::old, {}};
  if (facts.damaged || facts.bytes < image_bytes_) return {Verdict::damaged, {}};
  if (settle_left_ > 0) {
    if (--settle_left_ == 0) longest_s_ = exposure_s_;
    return {Verdict::settling, {}};
  }
  longest_s_ = exposure_s_;
  if (earliest < triggered_ns_) return {Verdict::old, {}};
  if (!is_too_quick(facts)) {
    quick_in_a_row_ = 0;
    return {};
  }
  if (++quick_in_a_row_ < kMostQuick) return {Verdict::too_quick, {}};
  return {Verdict::bad,
          fmt::format("its frames follow each other after {:.1f} ms: they were not exposed for {:.1f} ms, "
                      "which it says they were",
                      static_cast<double>(facts.stamp_ns - last_->stamp_ns) * 1e-6, exposure_s_ * 1e3)};
}

Judgement FrameSieve::look(const FrameFacts& facts) {
  Judgement judgement = judge(facts);
  if (last_) {
    const std::uint32_t gap = facts.sequence - last_->sequence - 1;
    if (gap < kFurthest) judgement.lost = gap;
  }
  last_ = facts;
  return judgement;
}

}  // namespace rig::drivers::v4l2
