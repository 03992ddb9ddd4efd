#include "drivers/v4l2_camera/measure.h"

#include <algorithm>
#include <chrono>
#include <thread>
#include <vector>

#include "drivers/v4l2_camera/settling.h"

namespace rig::drivers::v4l2 {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;
using Steady = std::chrono::steady_clock;

namespace {

constexpr double kLeastChange = 0.01;  // of the largest sample: smaller is not seen
constexpr double kMost_s = 5;          // for one attempt
// Brighter scenes saturate at the longer exposures.
constexpr int kAttempts = 3;
constexpr double kDarker = 1.0 / 16;

// How often it is set, and how many frames are looked at each time.
struct Plan {
  int changes = 4;
  std::size_t frames = 12;

  [[nodiscard]] double lasts_s(double interval_s) const {
    return (changes + 1) * static_cast<double>(frames) * interval_s;
  }
};

std::chrono::nanoseconds duration(double s) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(s));
}

std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(Steady::now().time_since_epoch()).count();
}

class Watch {
 public:
  Watch(VideoNode& node, Stream& stream, const Settings& settings, const Configured& made)
      : node_(node), stream_(stream), settings_(settings), made_(made) {}

  void expose_for(double exposure_s) { exposure_s_ = exposure_s; }

  // The frames until a change between two values shows; nothing: it does not, or not each time.
  [[nodiscard]] Result<std::optional<int>> settle(const Control& control, double unit_s, double low,
                                                  double high, const Plan& plan) {
    auto levels = levels_after(control, unit_s, low, plan.frames, 0);
    if (!levels) return pass(levels);
    int most = 0;
    for (int i = 0; i < plan.changes; ++i) {
      const double before = levels->back();
      // At another moment between two frames each time.
      const double wait_s = made_.interval_s * i / plan.changes;
      levels = levels_after(control, unit_s, i % 2 == 0 ? high : low, plan.frames, wait_s);
      if (!levels) return pass(levels);
      const double least = kLeastChange * ((1 << settings_.format.bits) - 1);
      const auto settled = settled_at(before, *levels, least);
      if (!settled) return std::optional<int>();
      most = std::max(most, *settled);
    }
    return std::optional<int>(most);
  }

 private:
  // Of frames whose stamp is later than the setting. An exposure counts those that surely began later, which
  // are fewer: so the number that is measured is enough.
  // unit_s: of an exposure control's counts, or 0.
  [[nodiscard]] Result<std::vector<double>> levels_after(const Control& control, double unit_s, double value,
                                                         std::size_t count, double wait_s) {
    std::this_thread::sleep_for(duration(wait_s));
    const auto reads = set_control(node_, control, control.nearest(value));
    if (!reads) return pass(reads);
    if (unit_s > 0) exposure_s_ = *reads * unit_s;
    const std::int64_t set_ns = now_ns();
    std::vector<double> levels;
    auto until = patience();
    while (levels.size() < count) {
      auto filled = stream_.take();
      if (!filled) return pass(filled);
      if (!*filled) {
        if (Steady::now() >= until) return fail(ErrorCode::lost, "it sends no frames");
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        continue;
      }
      const FrameFacts& facts = (*filled)->facts;
      if (facts.stamp_ns >= set_ns && !facts.damaged && facts.bytes >= made_.image_bytes) {
        levels.push_back(mean_level(settings_.format.packing, made_.layout, (*filled)->bytes));
        until = patience();
      }
      if (auto done = stream_.give_back((*filled)->index); !done) return pass(done);
    }
    return levels;
  }

  [[nodiscard]] Steady::time_point patience() const {
    return Steady::now() + std::chrono::seconds(3) + duration(5 * (made_.interval_s + exposure_s_));
  }

  VideoNode& node_;
  Stream& stream_;
  const Settings& settings_;
  const Configured& made_;
  double exposure_s_ = 0;
};

Result<std::optional<int>> settle_exposure(Watch& watch, const Configured& made, const Plan& plan) {
  const Control& control = made.exposure->control;
  const double unit_s = made.exposure->unit_s;
  double high_s = std::min(made.interval_s / 2, made.max_exposure_s);
  for (int attempt = 0; attempt < kAttempts; ++attempt, high_s *= kDarker) {
    const double low_s = std::max(high_s / 8, made.min_exposure_s);
    if (low_s > high_s / 2) break;
    auto settled = watch.settle(control, unit_s, low_s / unit_s, high_s / unit_s, plan);
    if (!settled || *settled) return settled;
  }
  return std::optional<int>();
}

}  // namespace

Result<Measured> measure_settling(VideoNode& node, Stream& stream, const Settings& settings,
                                  const Configured& made) {
  Plan plan;
  if (plan.lasts_s(made.interval_s) > kMost_s) plan = {2, 8};
  if (plan.lasts_s(made.interval_s) > kMost_s) return Measured{{}, "its frames come too slowly"};
  if (!made.exposure && !made.gain) return Measured{0, {}};
  Watch watch(node, stream, settings, made);
  std::optional<int> frames;
  if (made.exposure) {
    const auto settled = settle_exposure(watch, made, plan);
    if (!settled) return pass(settled);
    if (!*settled) return Measured{{}, "the picture is too dark or too bright to see its exposure change"};
    frames = *settled;
  } else {
    watch.expose_for(*settings.fixed_exposure_s);
  }
  if (made.gain) {
    const double range = static_cast<double>(made.gain->max) - made.gain->min;
    const double low = made.gain->min + range / 8, high = made.gain->min + range * 5 / 8;
    const auto settled = watch.settle(*made.gain, 0, low, high, frames ? Plan{2, 8} : plan);
    if (!settled) return pass(settled);
    if (!*settled && !frames) return Measured{{}, "its gain is not seen to change the picture"};
    if (*settled) frames = std::max(frames.value_or(0), **settled);
  }
  return Measured{frames, {}};
}

}  // namespace rig::drivers::v4l2
