#include "tests/drivers/v4l2_camera/support.h"

#include <atomic>
#include <unistd.h>

namespace rig::drivers::v4l2 {

Settings settings_of(const std::string& text) {
  return test::settings_from(text, read_settings);
}

std::string faults_of(const std::string& text) {
  return test::faults_from(text, read_settings);
}

std::filesystem::path socket_path() {
  static std::atomic<int> number{0};
  return std::filesystem::temp_directory_path() /
         fmt::format("rig-v4l2-{}-{}", static_cast<int>(::getpid()), ++number);
}

std::string device_of(const std::filesystem::path& socket) {
  return "unix:" + socket.string();
}

Rig::Rig(const std::string& device, const std::string& settings)
    : CameraRig([&](base::Clock& clock, const Log& log) {
        return V4l2Camera::open(settings_of("device = \"" + device + "\"\n" + settings), clock, log);
      }) {}

std::optional<sim::wire::VideoFacts> Rig::painted() {
  return sim::wire::read_video(pixels(), width(), capabilities().bits);
}

}  // namespace rig::drivers::v4l2
