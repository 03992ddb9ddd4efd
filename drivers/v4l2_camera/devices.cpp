#include "drivers/v4l2_camera/devices.h"

#include "drivers/v4l2_camera/camera.h"
#include "drivers/v4l2_camera/settings.h"

namespace rig::drivers::v4l2 {

using base::Result;

void check_settings(const base::ConfigTable& settings) {
  (void)read_settings(settings);
}

Result<std::vector<Device>> open_devices(const OpenContext& context) {
  Settings settings = read_settings(context.settings);
  if (auto fine = context.settings.noted(); !fine) return base::pass(fine);
  const std::string name = settings.name;
  auto camera = V4l2Camera::open(std::move(settings), context.clock,
                                 [log = context.log](base::LogLevel level, const std::string& text) {
                                   if (log != nullptr) log(level, text);
                                 });
  if (!camera) return base::pass(camera);
  std::vector<Device> devices;
  devices.push_back({name, name, std::move(*camera)});
  return devices;
}

}  // namespace rig::drivers::v4l2
