#include "drivers/aravis_camera/devices.h"

#include "drivers/aravis_camera/camera.h"
#include "drivers/aravis_camera/settings.h"
#include "drivers/common/camera_module.h"

namespace rig::drivers::aravis {

void check_settings(const base::ConfigTable& settings) {
  (void)read_settings(settings);
}

base::Result<std::vector<Device>> open_devices(const OpenContext& context) {
  return open_camera(context, read_settings, &Settings::device, &GenicamCamera::open);
}

}  // namespace rig::drivers::aravis
