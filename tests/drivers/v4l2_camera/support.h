// The driver on a video device behind a socket.
#pragma once

#include <chrono>
#include <filesystem>
#include <gtest/gtest.h>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "core/base/clock.h"
#include "drivers/v4l2_camera/camera.h"
#include "sim/wire/v4l2_camera.h"
#include "sim/wire/video_pattern.h"

namespace rig::drivers::v4l2 {

/// The settings that this text says; a mistake in it is thrown.
[[nodiscard]] Settings settings_of(const std::string& text);
/// What is wrong with them; empty: nothing.
[[nodiscard]] std::string faults_of(const std::string& text);

/// Where a device of this process may listen.
[[nodiscard]] std::filesystem::path socket_path();

/// What the driver said.
class Said {
 public:
  [[nodiscard]] Log log();
  [[nodiscard]] bool has(const std::string& part) const;

 private:
  struct Lines {
    std::mutex mutex;
    std::vector<std::string> lines;
  };
  std::shared_ptr<Lines> lines_ = std::make_shared<Lines>();
};

/// The driver on these settings; `device` is said before them.
class Rig {
 public:
  Rig(const std::string& device, const std::string& settings);

  [[nodiscard]] Camera& camera() { return *camera_; }
  [[nodiscard]] std::vector<std::uint16_t>& pixels() { return pixels_; }
  [[nodiscard]] const CameraCapabilities& capabilities() const { return capabilities_; }
  [[nodiscard]] const Said& said() const { return said_; }
  [[nodiscard]] base::Clock& clock() { return *clock_; }

  /// Of an exposure that was begun: the frame, in pixels(); nothing within `within`; or the error.
  [[nodiscard]] base::Result<std::optional<FrameInfo>> wait_for_frame(
      std::chrono::milliseconds within = std::chrono::milliseconds(5000));
  /// Triggers and waits.
  [[nodiscard]] base::Result<std::optional<FrameInfo>> take(double exposure_s, double gain = 1);
  /// What the pixels of a simulated device say; nothing where one of them contradicts it.
  [[nodiscard]] std::optional<sim::wire::VideoFacts> painted() const;

 private:
  std::unique_ptr<base::Clock> clock_ = base::make_system_clock();
  Said said_;
  std::unique_ptr<V4l2Camera> camera_;
  CameraCapabilities capabilities_;
  std::vector<std::uint16_t> pixels_;
};

/// "unix:..." of a simulated device.
[[nodiscard]] std::string device_of(const std::filesystem::path& socket);

/// Looks at `ready` until it is true; false: not within `within`.
template <typename Ready>
[[nodiscard]] bool eventually(Ready&& ready, std::chrono::milliseconds within = std::chrono::seconds(20)) {
  const auto until = std::chrono::steady_clock::now() + within;
  while (!ready()) {
    if (std::chrono::steady_clock::now() >= until) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

/// Triggers; fails the test unless a whole frame of this exposure comes, which no pixel contradicts.
void expect_frame(Rig& rig, double exposure_s);

}  // namespace rig::drivers::v4l2
