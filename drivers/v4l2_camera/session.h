// One camera from its opening until it is lost or closed: sets it, and takes the frame that was asked for out
// of those that it sends.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "core/base/clock.h"
#include "core/base/result.h"
#include "drivers/api/device.h"
#include "drivers/v4l2_camera/configure.h"
#include "drivers/v4l2_camera/frame_sieve.h"
#include "drivers/v4l2_camera/loss_report.h"
#include "drivers/v4l2_camera/settings.h"
#include "drivers/v4l2_camera/stream.h"

namespace rig::drivers::v4l2 {

/// A frame that was unpacked.
struct Taken {
  FrameInfo info;             ///< its counter is for the caller to set
  std::uint64_t advance = 1;  ///< how many frames the camera has taken since the one before
};

/// Which camera it was, and after how many frames it shows a setting.
struct Settling {
  std::string card;
  int frames = 0;
};

/// Not for several threads at once. No call waits for a frame but open(), which may measure how settings
/// settle.
class Session {
 public:
  /// Configures the camera and starts its stream. `known`: what was found when it was open before; of the
  /// same camera it is not measured again. Settings and clock must outlive the session.
  [[nodiscard]] static base::Result<std::unique_ptr<Session>> open(const Settings& settings,
                                                                   base::Clock& clock, const Log& log,
                                                                   const std::optional<Settling>& known);

  [[nodiscard]] CameraCapabilities capabilities() const;
  [[nodiscard]] const Settling& settling() const { return settling_; }

  /// Sets what changed; the first frame of that setting that begins later is the one.
  [[nodiscard]] base::Result<void> expose(double exposure_s, double gain);
  /// The frame of the last expose(), if it has come, into `pixels`. An error ends the exposure.
  [[nodiscard]] base::Result<std::optional<Taken>> take(std::span<std::uint16_t> pixels);
  /// Ends an exposure, and tells whether the camera is there.
  [[nodiscard]] base::Result<void> rest();

 private:
  Session(const Settings& settings, base::Clock& clock, const Log& log, std::unique_ptr<VideoNode> node,
          Configured made);

  [[nodiscard]] base::Result<void> settle_or_state(const Log& log, const std::optional<Settling>& known);
  [[nodiscard]] base::Result<void> check(double exposure_s, double gain) const;
  [[nodiscard]] base::Result<void> set(double exposure_s, double gain);
  [[nodiscard]] base::Result<void> drop_what_came();
  [[nodiscard]] base::Result<Taken> unpack_frame(const Filled& filled, std::span<std::uint16_t> pixels);
  [[nodiscard]] base::Result<std::optional<Taken>> nothing_yet();
  [[nodiscard]] double most_exposure_s() const;
  [[nodiscard]] base::Time started(const FrameFacts& facts) const;

  const Settings& settings_;
  base::Clock& clock_;
  const std::unique_ptr<VideoNode> node_;
  const Configured made_;
  Settling settling_;
  std::unique_ptr<Stream> stream_;
  FrameSieve sieve_;
  LossReport losses_;

  // Of a control: what was asked for, and what it reads. Nothing: unknown, and set anew.
  struct Value {
    std::int32_t asked = 0, reads = 0;
  };
  [[nodiscard]] base::Result<bool> write(const Control& control, double value, std::optional<Value>& is);
  std::optional<Value> exposure_is_, gain_is_;
  double exposure_s_ = 0, gain_ = 1;  // as the camera has them

  bool was_set_ = false;
  bool exposing_ = false;
  bool was_full_ = false;  // every buffer was: what the camera took meanwhile is gone, and nobody misses it
  std::chrono::steady_clock::time_point heard_at_{};  // of any frame, or the trigger
  std::optional<std::uint32_t> last_sequence_;        // of the frame that was delivered
};

}  // namespace rig::drivers::v4l2
