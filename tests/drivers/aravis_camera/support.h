// What the tests of the driver share: settings as text, the driver on them, and frames waited for.
#pragma once

#include <filesystem>
#include <gtest/gtest.h>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "core/base/clock.h"
#include "core/base/config.h"
#include "drivers/aravis_camera/camera.h"
#include "sim/wire/gv_camera_process.h"
#include "sim/wire/gv_pattern.h"

namespace rig::drivers::aravis {

/// Every test process has a network of its own, so that they do not share the one port of GigE Vision.
[[nodiscard]] bool has_own_network();

/// The settings that this text says; a mistake in it fails the test.
[[nodiscard]] Settings settings_of(const std::string& text);
/// What is wrong with them; empty: nothing.
[[nodiscard]] std::string faults_of(const std::string& text);

[[nodiscard]] sim::wire::GvCameraProcess start_camera(const std::vector<std::string>& arguments = {});

/// For the simulated camera on loopback, with small frames of many packets.
inline const std::string kGige =
    "address = \"127.0.0.1\"\npacket_size = 1400\nreadout_ms = 0\nwidth = 256\nheight = 128\n";

/// The driver on these settings; more of them after those of kGige.
class Rig {
 public:
  explicit Rig(const std::string& settings);

  [[nodiscard]] Camera& camera() { return *camera_; }
  [[nodiscard]] base::Clock& clock() { return *clock_; }
  [[nodiscard]] std::vector<std::uint16_t>& pixels() { return pixels_; }
  [[nodiscard]] const CameraCapabilities& capabilities() const { return capabilities_; }

  /// Of an exposure that was begun: the frame, in pixels(); nothing within `within`; or the error.
  [[nodiscard]] base::Result<std::optional<FrameInfo>> wait_for_frame(
      std::chrono::milliseconds within = std::chrono::milliseconds(5000));
  /// Triggers and waits.
  [[nodiscard]] base::Result<std::optional<FrameInfo>> take(double exposure_s, double gain = 1);
  /// What the pixels say; nothing where one of them contradicts it.
  [[nodiscard]] std::optional<sim::wire::PatternFacts> painted() const;
  void close() { camera_.reset(); }

 private:
  std::unique_ptr<base::Clock> clock_ = base::make_system_clock();
  std::unique_ptr<GenicamCamera> camera_;
  CameraCapabilities capabilities_;
  std::vector<std::uint16_t> pixels_;
};

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

/// Tests that need the network.
class Gige : public testing::Test {
 protected:
  void SetUp() override {
    if (!has_own_network()) GTEST_SKIP() << "this user may not have a network of its own";
  }
};

/// Triggers; fails the test unless a whole frame of this exposure comes.
void expect_frame(Rig& rig, double exposure_s);

/// The exposure in Aravis' own ramp of 16 bits, in seconds: its steepness follows from it.
[[nodiscard]] double exposure_in_ramp(const std::vector<std::uint16_t>& pixels, int width);

}  // namespace rig::drivers::aravis
