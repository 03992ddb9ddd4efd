// The bench of v4l2_camera on a video device of the kernel: a USB video camera that is simulated at the other
// end of its USB. It needs root, the virtual USB host controller and uvcvideo, which the machine of
// tests/kernel has.
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "drivers/conformance/bench.h"
#include "sim/wire/uvc_plug.h"

namespace rig::drivers::v4l2 {

/// Whether this machine has what the bench needs.
[[nodiscard]] bool has_virtual_usb();

class UvcBench final : public conformance::Bench, private conformance::Wire, private conformance::CameraPeer {
 public:
  /// Where udev puts the camera.
  static constexpr const char* kNode = "/dev/v4l/by-id/usb-rigd_Simulated_UVC_camera_rig42-video-index0";

  UvcBench();
  /// Waits until the kernel has given up the camera: the next bench would find it otherwise.
  ~UvcBench() override;
  UvcBench(const UvcBench&) = delete;
  UvcBench& operator=(const UvcBench&) = delete;

  [[nodiscard]] std::string name() const override { return "v4l2_camera_uvc"; }
  [[nodiscard]] base::Result<std::vector<Device>> open() override;
  [[nodiscard]] base::Clock& clock() override { return *clock_; }
  void reset() override;
  [[nodiscard]] conformance::Wire& wire() override { return *this; }
  [[nodiscard]] std::optional<conformance::CameraUnderTest> camera() override;

  [[nodiscard]] sim::wire::UvcCamera& device() { return camera_; }
  /// [module.settings] for it.
  [[nodiscard]] static std::string settings(const std::string& pixel_format);

 private:
  bool cut() override;
  bool restore() override;
  [[nodiscard]] std::optional<double> exposure_in(std::span<const std::uint16_t> pixels) override;
  bool corrupt_next() override;
  bool drop_next() override;
  // The camera runs free, and each frame of a setting is as good as the one before: all are spoilt for so
  // long as a check waits for one.
  void spoil_all(void (sim::wire::UvcCamera::*how)(int));
  void end_spoiling();

  const std::unique_ptr<base::Clock> clock_ = base::make_system_clock();
  sim::wire::UvcCamera camera_{"rig42", 2};
  sim::wire::UvcPlug plug_{camera_};
  std::mutex mutex_;
  std::condition_variable enough_;
  bool ending_ = false;
  std::thread spoiling_;
};

}  // namespace rig::drivers::v4l2
