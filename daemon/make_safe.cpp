#include "daemon/make_safe.h"

#include <algorithm>
#include <condition_variable>
#include <map>
#include <mutex>
#include <thread>

#include "core/base/units.h"
#include "daemon/devices.h"

namespace rig::daemon {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;
using drivers::Device;

namespace {

constexpr double kLookEvery_s = 0.02;
// Stops of axes that share a wire go out one after the other; each must not wait for the last to stand.
constexpr const char* kLight = "light";

std::string axis_part(std::size_t axis) {
  return fmt::format("axis {}", machine::kAxisNames[axis]);
}

std::string outputs_part(const std::string& module) {
  return fmt::format("outputs of '{}'", module);
}

// What the threads report to; shared with those that are left behind.
struct Board {
  std::mutex mutex;
  std::condition_variable changed;
  std::map<std::string, Result<std::string>> told;

  void tell(SafePart part) {
    {
      const std::lock_guard lock(mutex);
      told.emplace(std::move(part.name), std::move(part.state));
    }
    changed.notify_all();
  }
};

Device* device_named(std::vector<Device>& devices, const std::string& name) {
  const auto found =
      std::find_if(devices.begin(), devices.end(), [&](const Device& d) { return d.name == name; });
  return found == devices.end() ? nullptr : &*found;
}

template <typename Kind>
Result<Kind*> part_of(std::vector<Device>& devices, const machine::DeviceRef& ref) {
  Device* device = device_named(devices, ref.device);
  auto* held = device == nullptr ? nullptr : std::get_if<std::unique_ptr<Kind>>(&device->is);
  if (held == nullptr) {
    return fail(ErrorCode::not_found,
                fmt::format("module '{}' offers no such device '{}'", ref.module, ref.device));
  }
  return held->get();
}

Result<std::string> light_made_safe(drivers::Light& light, double safe_level) {
  const bool has_shutter = light.capabilities().has_shutter;
  if (auto ok = has_shutter ? light.set_shutter(false) : light.set_level(safe_level); !ok) return pass(ok);
  const auto state = light.state();
  if (!state) return pass(state);
  constexpr double kLevelOff = 0.01;
  if (has_shutter ? state->shutter_open : state->level > safe_level + kLevelOff) {
    return fail(ErrorCode::device, has_shutter ? std::string("the shutter is still open")
                                               : fmt::format("it still shines at level {}", state->level));
  }
  return has_shutter ? std::string("shutter closed") : fmt::format("level {}", safe_level);
}

// Looks until the axis stands; the bound is the caller's.
Result<std::string> rest_of(drivers::Axis& axis, base::Clock& clock, base::WaitSlot& slot) {
  while (true) {
    const auto state = axis.state();
    if (!state) return pass(state);
    if (!state->moving) return fmt::format("stands at {:.4f} deg", base::degrees(state->position_rad));
    clock.wait(slot, clock.now() + base::seconds(kLookEvery_s), base::WaitFor::rig);
  }
}

// Sets the outputs that have a state of rest to it, each whatever became of the one before, and reads them
// back. Says what each is; nothing where there is no output.
Result<std::string> rest_outputs(drivers::DigitalIo& io) {
  const std::vector<drivers::Line> lines = io.lines();
  const auto is_output = [](const drivers::Line& line) { return line.output; };
  if (std::none_of(lines.begin(), lines.end(), is_output)) return std::string();
  Result<void> outcome;
  for (const drivers::Line& line : lines) {
    if (!line.output || !line.at_rest) continue;
    auto set = io.set(line.name, *line.at_rest);
    if (!set && outcome) outcome = std::move(set);
  }
  if (!outcome) return pass(outcome);
  const auto levels = io.read();
  if (!levels) return pass(levels);
  if (levels->size() != lines.size())
    return fail(ErrorCode::device, fmt::format("a reading of {} lines of {}", levels->size(), lines.size()));
  std::string told;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const drivers::Line& line = lines[i];
    if (!line.output) continue;
    const char* is = (*levels)[i] ? "active" : "inactive";
    if (line.at_rest && (*levels)[i] != *line.at_rest)
      return fail(ErrorCode::device, fmt::format("{} is still {}", line.name, is));
    told += fmt::format("{}{} {}{}", told.empty() ? "" : ", ", line.name, is,
                        line.at_rest ? "" : ", left as it is");
  }
  return told;
}

Result<std::string> outputs_at_rest(std::vector<Device>& devices) {
  std::string told;
  Result<std::string> outcome;
  for (Device& device : devices) {
    auto* io = std::get_if<std::unique_ptr<drivers::DigitalIo>>(&device.is);
    if (io == nullptr) continue;
    auto rest = rest_outputs(**io);
    if (rest) {
      told += (told.empty() || rest->empty() ? "" : ", ") + *rest;
    } else if (outcome) {
      outcome = std::move(rest);
    }
  }
  if (!outcome) return outcome;
  return told;
}

}  // namespace

std::vector<SafePart> work_within(std::vector<SafeWork> works, std::chrono::milliseconds within) {
  const auto board = std::make_shared<Board>();
  std::vector<std::string> names;
  for (SafeWork& work : works) {
    names.insert(names.end(), work.parts.begin(), work.parts.end());
    std::thread([board, run = std::move(work.run)] {
      run([board](SafePart part) { board->tell(std::move(part)); });
    }).detach();
  }
  std::unique_lock lock(board->mutex);
  const auto complete = [&] {
    return std::all_of(names.begin(), names.end(),
                       [&](const auto& name) { return board->told.contains(name); });
  };
  board->changed.wait_for(lock, within, complete);
  std::vector<SafePart> parts;
  for (const std::string& name : names) {
    const auto found = board->told.find(name);
    if (found != board->told.end() && found->second && found->second->empty()) continue;
    parts.push_back(
        {name, found != board->told.end()
                   ? found->second
                   : Result<std::string>(fail(ErrorCode::timeout,
                                              fmt::format("no answer within {} ms", within.count()), {},
                                              "cut its power by hand"))});
  }
  return parts;
}

std::vector<SafePart> make_safe(const std::shared_ptr<const machine::RigConfig>& rig,
                                const std::shared_ptr<base::Clock>& clock,
                                const std::filesystem::path& state_folder, std::chrono::milliseconds within) {
  std::vector<SafeWork> works;
  const std::vector<machine::LinePart> lines = machine::line_parts(rig->lines);
  for (const machine::ModuleConfig& module : rig->modules) {
    SafeWork work;
    std::vector<std::size_t> axes;
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      if (rig->axes[i].device.module == module.name) axes.push_back(i);
    }
    const bool has_light = rig->light.device.module == module.name;
    for (const std::size_t axis : axes) work.parts.push_back(axis_part(axis));
    if (has_light) work.parts.emplace_back(kLight);
    const bool has_camera = rig->camera.device.module == module.name;
    const bool has_lines = std::any_of(lines.begin(), lines.end(), [&](const machine::LinePart& part) {
      return part.line.device.module == module.name;
    });
    // A camera alone harms nobody. What else a module offers is only known once it is open.
    if (work.parts.empty() && has_camera && !has_lines) continue;
    work.parts.push_back(outputs_part(module.name));
    work.run = [rig, clock, state_folder, &module, axes, has_light, parts = work.parts,
                member = std::make_shared<base::ClockMember>(*clock)](const auto& tell) {
      auto devices = open_module(module, *clock, state_folder);
      if (!devices) {
        for (const std::string& part : parts) tell({part, pass(devices)});
        return;
      }
      std::map<std::size_t, drivers::Axis*> stopped;
      for (const std::size_t i : axes) {
        const auto axis = part_of<drivers::Axis>(*devices, rig->axes[i].device);
        const auto done = axis ? (*axis)->stop() : Result<void>(pass(axis));
        if (done) {
          stopped[i] = *axis;
        } else {
          tell({axis_part(i), pass(done)});
        }
      }
      if (has_light) {
        const auto light = part_of<drivers::Light>(*devices, rig->light.device);
        tell({kLight,
              light ? light_made_safe(**light, rig->light.safe_level) : Result<std::string>(pass(light))});
      }
      tell({outputs_part(module.name), outputs_at_rest(*devices)});
      base::WaitSlot slot;
      for (const auto& [i, axis] : stopped) tell({axis_part(i), rest_of(*axis, *clock, slot)});
    };
    works.push_back(std::move(work));
  }
  return work_within(std::move(works), within);
}

}  // namespace rig::daemon
