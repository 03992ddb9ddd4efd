// Which of the frames of a camera that runs free is the one that was asked for.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

namespace rig::drivers::v4l2 {

/// What the kernel says of a buffer that it hands out.
struct FrameFacts {
  bool damaged = false;        ///< V4L2_BUF_FLAG_ERROR
  std::size_t bytes = 0;       ///< used
  std::uint32_t sequence = 0;  ///< which frame of the stream; what is lost is counted too
  bool monotonic = true;       ///< the stamp is of CLOCK_MONOTONIC
  bool stamp_is_start = false;
  std::int64_t stamp_ns = 0;
};

enum class Verdict {
  good,
  old,        ///< it began, or may have begun, before the setting or the trigger
  settling,   ///< it began after the setting and may not show it yet
  damaged,    ///< the kernel says so, or not all of it came
  too_quick,  ///< it follows the one before sooner than its exposure lasts
  bad,        ///< nothing can be known of it, or too many were too quick: the exposure is over
};

struct Judgement {
  Verdict verdict = Verdict::good;
  std::string why;         ///< of a bad one
  std::uint32_t lost = 0;  ///< frames missing between this one and the one before
};

/// Told of every frame that comes, in their order. Times are of CLOCK_MONOTONIC.
class FrameSieve {
 public:
  /// `image_bytes`: fewer are a damaged frame. `interval_s`: the longest that the readout of a frame takes.
  FrameSieve(std::size_t image_bytes, double interval_s)
      : image_bytes_(image_bytes), interval_s_(interval_s) {}

  /// A new setting was complete at `at_ns`: of the frames that begin later, the first `settle` are not of it.
  void set(std::int64_t at_ns, double exposure_s, int settle);
  /// Only frames that begin later count.
  void trigger(std::int64_t at_ns) { triggered_ns_ = at_ns; }

  [[nodiscard]] Judgement look(const FrameFacts& facts);

  /// The earliest that its exposure can have begun. A stamp of the start may be of the first data that came,
  /// which is when the exposure ended: drivers differ.
  [[nodiscard]] std::int64_t earliest_ns(const FrameFacts& facts) const;

 private:
  [[nodiscard]] Judgement judge(const FrameFacts& facts);
  [[nodiscard]] bool is_too_quick(const FrameFacts& facts) const;

  const std::size_t image_bytes_;
  const double interval_s_;
  double exposure_s_ = 0;
  double longest_s_ = 0;  // of the exposures that a frame may still have
  std::int64_t set_ns_ = 0, triggered_ns_ = 0;
  int settle_left_ = 0;
  int quick_in_a_row_ = 0;
  std::optional<FrameFacts> last_;
};

}  // namespace rig::drivers::v4l2
