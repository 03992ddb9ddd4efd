// What the tests of the driver share: settings as text, the driver on them, and frames waited for.
#pragma once

#include <gtest/gtest.h>
#include <optional>
#include <string>
#include <vector>

#include "drivers/aravis_camera/camera.h"
#include "sim/wire/gv_camera_process.h"
#include "sim/wire/gv_pattern.h"
#include "tests/drivers/camera_rig.h"

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

using test::eventually;
using test::expect_frame;

/// The driver on these settings; more of them after those of kGige.
class Rig : public test::CameraRig {
 public:
  explicit Rig(const std::string& settings);
  /// What the pixels say; nothing where one of them contradicts it.
  [[nodiscard]] std::optional<sim::wire::PatternFacts> painted();
};

/// Tests that need the network.
class Gige : public testing::Test {
 protected:
  void SetUp() override {
    if (!has_own_network()) GTEST_SKIP() << "this user may not have a network of its own";
  }
};

/// The exposure in Aravis' own ramp of 16 bits, in seconds: its steepness follows from it.
[[nodiscard]] double exposure_in_ramp(const std::vector<std::uint16_t>& pixels, int width);

}  // namespace rig::drivers::aravis
