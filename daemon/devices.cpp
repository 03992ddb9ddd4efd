#include "daemon/devices.h"

#include <algorithm>

#include "core/base/units.h"
#include "drivers/host/module_loader.h"

namespace rig::daemon {

namespace fs = std::filesystem;
using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;
using drivers::Device;

namespace {

struct Opened {
  std::string module;
  std::size_t first, last;  // of OpenDevices::devices
};

Device* find_device(OpenDevices& open, const std::vector<Opened>& modules, const machine::DeviceRef& ref) {
  for (const Opened& m : modules) {
    if (m.module != ref.module) continue;
    for (std::size_t i = m.first; i < m.last; ++i) {
      if (open.devices[i].name == ref.device) return &open.devices[i];
    }
  }
  return nullptr;
}

// The device that plays a part, of the right kind, and its worker.
template <typename Kind>
Result<Kind*> cast_part(OpenDevices& open, const std::vector<Opened>& modules, base::Clock& clock,
                        const machine::DeviceRef& ref, const std::string& part, BusWorker** worker) {
  Device* device = find_device(open, modules, ref);
  if (device == nullptr) {
    return fail(ErrorCode::not_found,
                fmt::format("module '{}' offers no device '{}'", ref.module, ref.device), part);
  }
  auto* held = std::get_if<std::unique_ptr<Kind>>(&device->is);
  if (held == nullptr) {
    return fail(ErrorCode::bad_input,
                fmt::format("device '{}' of module '{}' is of another kind", ref.device, ref.module), part);
  }
  auto& made = open.workers[ref.module + "/" + device->bus];
  if (!made) made = std::make_unique<BusWorker>(clock, device->bus);
  *worker = made.get();
  return held->get();
}

Result<void> check_camera(const machine::RigConfig& rig, const drivers::CameraCapabilities& camera) {
  const auto& believed = rig.camera;
  if (camera.width != believed.intrinsics.width || camera.height != believed.intrinsics.height) {
    return fail(ErrorCode::bad_input,
                fmt::format("the camera delivers {} x {} pixels, rig.toml says {} x {}", camera.width,
                            camera.height, believed.intrinsics.width, believed.intrinsics.height),
                "camera");
  }
  if (camera.bayer != geometry::text_from_bayer(believed.bayer)) {
    return fail(ErrorCode::bad_input,
                fmt::format("the camera's pattern is {}, rig.toml says {}", camera.bayer,
                            geometry::text_from_bayer(believed.bayer)),
                "camera");
  }
  if (camera.bits != believed.sensor.bits) {
    return fail(
        ErrorCode::bad_input,
        fmt::format("the camera delivers {} bits, rig.toml says {}", camera.bits, believed.sensor.bits),
        "camera");
  }
  return {};
}

// Nobody knows where an axis stands that is not homed: what moves it goes slowly.
Result<void> check_homing(const machine::AxisConfig& axis, const drivers::AxisCapabilities& can,
                          const std::string& part) {
  if (!can.homing_velocity_rad_s || *can.homing_velocity_rad_s <= axis.jog_velocity_rad_s * (1 + 1e-9)) {
    return {};
  }
  return fail(
      ErrorCode::bad_input,
      fmt::format("it homes at {:.6g} deg/s, faster than its reduced speed, jog_velocity_deg_s = {:.6g}",
                  base::degrees(*can.homing_velocity_rad_s), base::degrees(axis.jog_velocity_rad_s)),
      part, "let its driver home more slowly, or raise jog_velocity_deg_s");
}

// The device of a line, which is one of those that were found before or a new one, and the line's place in
// its readings.
struct FoundLine {
  std::size_t device = 0, line = 0;
};

Result<FoundLine> find_line(OpenDevices& open, const std::vector<Opened>& modules, base::Clock& clock,
                            const machine::LinesConfig& lines, const machine::LinePart& wanted, bool output) {
  LinesDevice found;
  auto io =
      cast_part<drivers::DigitalIo>(open, modules, clock, wanted.line.device, wanted.part, &found.worker);
  if (!io) return pass(io);
  const std::vector<drivers::Line> offered = (*io)->lines();
  const auto line = std::find_if(offered.begin(), offered.end(), [&](const drivers::Line& l) {
    return l.name == wanted.line.line && l.output == output;
  });
  if (line == offered.end()) {
    return fail(ErrorCode::not_found,
                fmt::format("there is no {} line '{}'", output ? "output" : "input", wanted.line.line),
                wanted.part);
  }
  const auto at = static_cast<std::size_t>(line - offered.begin());
  const auto known = std::find_if(open.lines.begin(), open.lines.end(),
                                  [&](const LinesDevice& device) { return device.io == *io; });
  if (known != open.lines.end()) return FoundLine{static_cast<std::size_t>(known - open.lines.begin()), at};
  found.name = machine::lines_name(lines, wanted.line.device);
  found.io = *io;
  found.offered = offered.size();
  open.lines.push_back(std::move(found));
  return FoundLine{open.lines.size() - 1, at};
}

Result<void> open_lines(OpenDevices& open, const std::vector<Opened>& modules, base::Clock& clock,
                        const machine::LinesConfig& lines) {
  const auto find = [&](const std::string& part, const machine::LineRef& line, bool output) {
    return find_line(open, modules, clock, lines, {part, line}, output);
  };
  if (lines.emergency_stop) {
    const auto found = find("lines.emergency_stop", *lines.emergency_stop, false);
    if (!found) return pass(found);
    open.lines[found->device].emergency_stop = found->line;
  }
  if (lines.camera_trigger) {
    const auto found = find("lines.camera_trigger", lines.camera_trigger->line, true);
    if (!found) return pass(found);
    open.trigger = found->device;
  }
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    for (std::size_t end = 0; end < kEnds; ++end) {
      if (!lines.limit[i][end]) continue;
      const auto found = find(machine::limit_part(i, end), *lines.limit[i][end], false);
      if (!found) return pass(found);
      open.lines[found->device].limits[i][end] = found->line;
      open.lines[found->device].has_limits = true;
    }
  }
  return {};
}

void log_from_module(base::LogLevel level, std::string_view text) {
  base::log_line(level, text);
}

}  // namespace

Result<void> check_modules(const machine::RigConfig& rig) {
  for (const auto& module : rig.modules) {
    const auto entry = drivers::load_module(module.file, drivers::module_search_path());
    if (!entry) return pass(entry);
    const std::size_t before = module.settings.errors();
    (*entry)->check(module.settings);
    if (module.settings.errors() > before) return module.settings.noted();
  }
  return {};
}

Result<std::vector<Device>> open_module(const machine::ModuleConfig& module, base::Clock& clock,
                                        const fs::path& state_folder) {
  const auto entry = drivers::load_module(module.file, drivers::module_search_path());
  if (!entry) return pass(entry);
  const fs::path folder = state_folder / module.name;
  std::error_code error;
  fs::create_directories(folder, error);
  if (error)
    return fail(ErrorCode::io, fmt::format("cannot make the folder: {}", error.message()), folder.string());
  return (*entry)->open({module.name, module.settings, folder, clock, &log_from_module});
}

Result<std::unique_ptr<OpenDevices>> open_devices(const machine::RigConfig& rig, base::Clock& clock,
                                                  const fs::path& state_folder) {
  if (auto ok = check_modules(rig); !ok) return pass(ok);
  auto open = std::make_unique<OpenDevices>();
  std::vector<Opened> modules;
  for (const auto& module : rig.modules) {
    auto devices = open_module(module, clock, state_folder);
    if (!devices) return pass(devices);
    const std::size_t first = open->devices.size();
    for (Device& device : *devices) open->devices.push_back(std::move(device));
    modules.push_back({module.name, first, open->devices.size()});
  }
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const std::string part = fmt::format("axis.{}", machine::kAxisNames[i]);
    auto axis =
        cast_part<drivers::Axis>(*open, modules, clock, rig.axes[i].device, part, &open->axis_workers[i]);
    if (!axis) return pass(axis);
    open->axes[i] = *axis;
    const auto can = (*axis)->capabilities();
    if (can.max_velocity_rad_s < rig.axes[i].max_velocity_rad_s * (1 - 1e-9)) {
      return fail(
          ErrorCode::bad_input,
          fmt::format("the drive reaches {} deg/s, max_velocity_deg_s is {}",
                      base::degrees(can.max_velocity_rad_s), base::degrees(rig.axes[i].max_velocity_rad_s)),
          part);
    }
    if (auto ok = check_homing(rig.axes[i], can, part); !ok) return pass(ok);
  }
  auto camera =
      cast_part<drivers::Camera>(*open, modules, clock, rig.camera.device, "camera", &open->camera_worker);
  if (!camera) return pass(camera);
  open->camera = *camera;
  if (auto ok = check_camera(rig, open->camera->capabilities()); !ok) return pass(ok);
  auto light =
      cast_part<drivers::Light>(*open, modules, clock, rig.light.device, "light", &open->light_worker);
  if (!light) return pass(light);
  open->light = *light;
  if (auto ok = open_lines(*open, modules, clock, rig.lines); !ok) return pass(ok);
  return open;
}

}  // namespace rig::daemon
