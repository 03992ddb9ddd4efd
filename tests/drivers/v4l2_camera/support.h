// The driver on a video device behind a socket.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "drivers/v4l2_camera/camera.h"
#include "sim/wire/v4l2_camera.h"
#include "sim/wire/video_pattern.h"
#include "tests/drivers/camera_rig.h"

namespace rig::drivers::v4l2 {

/// The settings that this text says; a mistake in it is thrown.
[[nodiscard]] Settings settings_of(const std::string& text);
/// What is wrong with them; empty: nothing.
[[nodiscard]] std::string faults_of(const std::string& text);

/// Where a device of this process may listen.
[[nodiscard]] std::filesystem::path socket_path();

using test::eventually;
using test::expect_frame;
using test::Said;

/// The driver on these settings; `device` is said before them.
class Rig : public test::CameraRig {
 public:
  Rig(const std::string& device, const std::string& settings);
  /// What the pixels of a simulated device say; nothing where one of them contradicts it.
  [[nodiscard]] std::optional<sim::wire::VideoFacts> painted();
};

/// "unix:..." of a simulated device.
[[nodiscard]] std::string device_of(const std::filesystem::path& socket);

}  // namespace rig::drivers::v4l2
