// One camera from its opening until it is lost or closed: sets, triggers, and takes frames off its stream.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <span>

#include "core/base/clock.h"
#include "core/base/result.h"
#include "drivers/api/device.h"
#include "drivers/aravis_camera/camera_clock.h"
#include "drivers/aravis_camera/configure.h"
#include "drivers/aravis_camera/frame_judge.h"
#include "drivers/aravis_camera/frame_stream.h"
#include "drivers/aravis_camera/settings.h"
#include "drivers/common/camera_module.h"

namespace rig::drivers::aravis {

using Log = CameraLog;

/// A frame that was unpacked.
struct Taken {
  FrameInfo info;             ///< its counter is the camera's own number, which may begin anew
  std::uint64_t advance = 1;  ///< how many frames the camera has taken since the one before
};

/// Not for several threads at once. Every call but take() and is_lost() talks with the camera and may take
/// as long as Aravis has patience with one that is silent (2.5 s and more); so does the destructor.
class Session {
 public:
  /// Finds and configures it, and starts its stream. `on_lost` is called from a thread of Aravis.
  [[nodiscard]] static base::Result<std::unique_ptr<Session>> open(const Settings& settings,
                                                                   base::Clock& clock, const Log& log,
                                                                   std::function<void()> on_lost);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  [[nodiscard]] const CameraCapabilities& capabilities() const { return made_.capabilities; }
  /// The wire says that it is gone, or that somebody else controls it.
  [[nodiscard]] bool is_lost() const { return *lost_; }
  /// As if the wire had said so: it is not talked with again.
  void give_up() { *lost_ = true; }

  /// Sets what changed; then triggers it, or leaves it to the pulse.
  [[nodiscard]] base::Result<void> expose(double exposure_s, double gain, bool by_line);
  /// The frame of the last expose(), if it has come, into `pixels`. An error ends the exposure.
  [[nodiscard]] base::Result<std::optional<Taken>> take(std::span<std::uint16_t> pixels);
  [[nodiscard]] bool is_exposing() const { return exposing_; }

  /// A new bracket: nothing is exposing afterwards.
  [[nodiscard]] base::Result<void> arm();
  /// Ends an exposure; one that does not expose is only asked whether it answers.
  [[nodiscard]] base::Result<void> abort();
  [[nodiscard]] base::Result<void> answer();
  [[nodiscard]] base::Result<std::optional<double>> temperature_c();

 private:
  Session(const Settings& settings, base::Clock& clock, Log log, Owned<ArvCamera> camera, Configured made);

  /// Ends taking frames and begins anew, with an empty stream.
  [[nodiscard]] base::Result<void> restart();
  /// Ends the exposure, too.
  [[nodiscard]] base::Result<void> cut_short();
  [[nodiscard]] base::Result<void> end_what_another_began();
  /// Until nothing of an exposure that was ended can come any more. Errors: busy, where that is long.
  [[nodiscard]] base::Result<void> outlast_old_exposure();
  [[nodiscard]] base::Result<void> listen_to(bool line);
  [[nodiscard]] base::Result<void> set_exposure(double exposure_s);
  /// The gain feature's value for a factor.
  [[nodiscard]] double feature_for(double gain) const;
  [[nodiscard]] base::Result<void> set_gain(double gain);
  [[nodiscard]] base::Result<void> drop_what_came();
  /// What asking again has mended is said, too: it costs time, and a network that gets worse begins so.
  void tell_resent();
  [[nodiscard]] base::Result<void> wait_until_ready();
  [[nodiscard]] Expected expected() const;
  /// By the camera's own clock, where it is known.
  [[nodiscard]] std::optional<base::Time> told_start(ArvBuffer* buffer) const;
  [[nodiscard]] base::Time started(ArvBuffer* buffer) const;
  [[nodiscard]] base::Result<std::optional<Taken>> refuse(base::ErrorCode code, const std::string& why);

  const Settings& settings_;
  base::Clock& clock_;
  const Log log_;
  // Shared with Aravis' threads, which may still be in the handler when this ends.
  std::shared_ptr<std::atomic<bool>> lost_ = std::make_shared<std::atomic<bool>>(false);
  Owned<ArvCamera> camera_;
  gulong handler_ = 0;
  const Configured made_;
  Owned<ArvChunkParser> chunks_;
  CameraClock camera_clock_;
  std::optional<FrameStream> stream_;

  bool by_line_;                                // what it listens to
  std::optional<double> asked_s_, asked_gain_;  // last written; nothing: unknown
  double exposure_s_ = 0, gain_ = 1;            // as the camera rounded them
  bool exposing_ = false;
  bool suspect_ = false;  // its stream may hold what belongs to no exposure: begun anew before the next one
  std::optional<std::chrono::steady_clock::time_point>
      old_until_;  // so long a frame may come of one that was ended
  base::Time triggered_{};
  std::int64_t triggered_ns_ = 0;  // of the wall clock that Aravis stamps frames with
  std::optional<std::uint64_t> last_id_;
  std::uint64_t told_resent_ = 0;
};

}  // namespace rig::drivers::aravis
