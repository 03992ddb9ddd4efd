// A camera on GigE Vision or USB3 Vision, through Aravis 0.8: area cameras that speak GenICam.
//
// Frames and triggers are counted: a trigger makes one frame, and that frame alone is delivered for it. After
// an exposure was ended the next one waits until the camera can send nothing of it any more. Frames that are
// incomplete, of another format or region, out of sequence, or of another exposure than was set (where the
// camera says it) are refused with a `device` error. A frame that does not come at all is not waited for
// here: rigd's deadline notices it.
#pragma once

#include <chrono>
#include <memory>
#include <optional>

#include "core/base/clock.h"
#include "core/base/result.h"
#include "drivers/api/device.h"
#include "drivers/aravis_camera/keeper.h"
#include "drivers/aravis_camera/settings.h"

namespace rig::drivers::aravis {

class GenicamCamera final : public Camera {
 public:
  /// Returns once it is open and configured. Errors: lost (not found in time), device, bad_input.
  [[nodiscard]] static base::Result<std::unique_ptr<GenicamCamera>> open(Settings settings,
                                                                         base::Clock& clock, const Log& log);

  [[nodiscard]] CameraCapabilities capabilities() const override { return capabilities_; }
  [[nodiscard]] base::Result<void> arm() override;
  [[nodiscard]] base::Result<void> trigger(double exposure_s, double gain) override;
  [[nodiscard]] base::Result<void> await_trigger(double exposure_s, double gain) override;
  [[nodiscard]] base::Result<std::optional<FrameInfo>> fetch(std::span<std::uint16_t> pixels) override;
  [[nodiscard]] base::Result<void> abort() override;
  [[nodiscard]] base::Result<std::optional<double>> temperature_c() override;

 private:
  GenicamCamera(Settings settings, base::Clock& clock, const Log& log);
  [[nodiscard]] base::Result<void> expose(double exposure_s, double gain, bool by_line);
  void probe_where_overdue();

  // Which opening of the camera exposes, and when its frame should have come.
  struct Pending {
    int opened = 0;
    bool by_line = false;
    std::chrono::steady_clock::time_point due;
  };

  const Settings settings_;
  base::Clock& clock_;
  std::unique_ptr<Keeper> keeper_;
  CameraCapabilities capabilities_;
  std::optional<Pending> pending_;
  std::uint64_t counter_ = 0;
};

}  // namespace rig::drivers::aravis
