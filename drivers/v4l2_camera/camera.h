// A camera on Video4Linux: UVC cameras and sensors whose frames are raw, grey or Bayer.
//
// Such a camera runs free: it sends frames all the time, and a setting shows some frames after it was made. A
// trigger sets what changed and takes the first whole frame that began afterwards, by its time stamp, and
// after as many frames as the setting takes to show, which is measured when the camera is opened. Frames that
// are damaged or lost on their way are passed over: another of the same setting takes their place.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "core/base/clock.h"
#include "core/base/result.h"
#include "drivers/api/device.h"
#include "drivers/common/connection.h"
#include "drivers/v4l2_camera/session.h"
#include "drivers/v4l2_camera/settings.h"

namespace rig::drivers::v4l2 {

class V4l2Camera final : public Camera {
 public:
  /// Returns once it is open and configured. Errors: lost (not there in time), busy, device, bad_input, io.
  [[nodiscard]] static base::Result<std::unique_ptr<V4l2Camera>> open(Settings settings, base::Clock& clock,
                                                                      const Log& log);

  [[nodiscard]] CameraCapabilities capabilities() const override { return capabilities_; }
  [[nodiscard]] base::Result<void> arm() override;
  [[nodiscard]] base::Result<void> trigger(double exposure_s, double gain) override;
  [[nodiscard]] base::Result<std::optional<FrameInfo>> fetch(std::span<std::uint16_t> pixels) override;
  [[nodiscard]] base::Result<void> abort() override;

 private:
  V4l2Camera(Settings settings, base::Clock& clock, const Log& log);
  [[nodiscard]] base::Result<std::unique_ptr<Session>> open_session();
  [[nodiscard]] base::Result<void> open_within();
  template <typename Use>
  [[nodiscard]] auto use(Use&& use) -> decltype(use(std::declval<Session&>()));

  const Settings settings_;
  base::Clock& clock_;
  const Log log_;
  CameraCapabilities capabilities_;
  std::optional<Settling> settling_;  // of the camera that was there first
  std::optional<base::ErrorCode> failed_with_;
  Connection<Session> connection_;
  bool said_lost_ = false;
  std::optional<int> exposing_;  // in which opening of the camera
  std::uint64_t counter_ = 0;
};

}  // namespace rig::drivers::v4l2
