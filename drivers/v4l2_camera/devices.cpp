#include "drivers/v4l2_camera/devices.h"

#include "drivers/common/camera_module.h"
#include "drivers/v4l2_camera/camera.h"
#include "drivers/v4l2_camera/settings.h"

namespace rig::drivers::v4l2 {

void check_settings(const base::ConfigTable& settings) {
  (void)read_settings(settings);
}

base::Result<std::vector<Device>> open_devices(const OpenContext& context) {
  return open_camera(context, read_settings, &Settings::name, &V4l2Camera::open);
}

}  // namespace rig::drivers::v4l2
