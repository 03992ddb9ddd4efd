// What the modules of cameras share: each offers one.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/log.h"
#include "core/base/result.h"
#include "drivers/api/module.h"

namespace rig::drivers {

/// Where a camera's driver says what an operator should know.
using CameraLog = std::function<void(base::LogLevel, const std::string&)>;

/// The open_devices() of such a module: `read` makes settings of its table, `name` of them is the device's,
/// and `open` makes the camera: (settings, clock, log).
template <typename Settings, typename Open>
[[nodiscard]] base::Result<std::vector<Device>> open_camera(const OpenContext& context,
                                                            Settings (*read)(const base::ConfigTable&),
                                                            std::string Settings::*name, Open open) {
  Settings settings = read(context.settings);
  if (auto fine = context.settings.noted(); !fine) return base::pass(fine);
  const std::string device = settings.*name;
  auto camera = open(std::move(settings), context.clock,
                     CameraLog([log = context.log](base::LogLevel level, const std::string& text) {
                       if (log != nullptr) log(level, text);
                     }));
  if (!camera) return base::pass(camera);
  std::vector<Device> devices;
  devices.push_back({device, device, std::move(*camera)});
  return devices;
}

}  // namespace rig::drivers
