#include "drivers/v4l2_camera/loss_report.h"

namespace rig::drivers::v4l2 {

namespace {

constexpr std::chrono::seconds kSayEvery{10};

}  // namespace

void LossReport::note(const Judgement& judgement, bool expected) {
  if (!expected) lost_ += judgement.lost;
  if (judgement.verdict == Verdict::damaged) ++damaged_;
  if (lost_ == 0 && damaged_ == 0) return;
  const auto now = std::chrono::steady_clock::now();
  if (said_at_ && now < *said_at_ + kSayEvery) return;
  said_at_ = now;
  log_(base::LogLevel::warning,
       fmt::format("{}: {} frames were lost and {} damaged on their way; others were taken in their place",
                   called_, lost_, damaged_));
  lost_ = damaged_ = 0;
}

}  // namespace rig::drivers::v4l2
