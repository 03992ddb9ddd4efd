#include "drivers/conformance/task.h"

#include <cstdlib>
#include <optional>

#include "drivers/conformance/waiting.h"

namespace rig::drivers::conformance {

using base::ErrorCode;
using base::fail;
using base::pass;

namespace {

constexpr base::Duration kHomedWithin = std::chrono::seconds(60);
constexpr base::Duration kArrivesWithin = std::chrono::seconds(20);

template <typename... Cases>
struct Overloaded : Cases... {
  using Cases::operator()...;
};
template <typename... Cases>
Overloaded(Cases...) -> Overloaded<Cases...>;

template <typename Kind>
Result<Kind*> find(const std::string& name, std::vector<Device>& devices) {
  for (Device& one : devices) {
    auto* found = std::get_if<std::unique_ptr<Kind>>(&one.is);
    if (one.name == name && found != nullptr && *found != nullptr) return found->get();
  }
  return fail(ErrorCode::not_found, "the module offers no such device of this kind", name);
}

// Until the axis stands, and is homed where that was asked for.
Result<void> wait_until_done(Axis& axis, Waiting& waiting, bool homed, base::Duration within) {
  std::optional<base::Error> error;
  const bool done = waiting.until(
      [&] {
        const auto now = axis.state();
        if (!now) error = now.error();
        return !now || (!now->moving && (now->homed || !homed));
      },
      within);
  if (error) return tl::unexpected<base::Error>(*error);
  if (!done) return fail(ErrorCode::timeout, homed ? "homing takes too long" : "a move takes too long");
  return {};
}

Result<void> start(const MoveTask& move, Axis& axis, base::Clock& clock) {
  Waiting waiting(clock);
  if (auto still = wait_until_done(axis, waiting, false, kArrivesWithin); !still) return still;
  if (auto on = axis.enable(true); !on) return on;
  const auto now = axis.state();
  if (!now) return pass(now);
  if (!now->homed) {
    if (auto begun = axis.home(); !begun) return begun;
    if (auto homed = wait_until_done(axis, waiting, true, kHomedWithin); !homed) return homed;
  }
  const auto go = [&](double target) {
    return axis.move_to(target, move.velocity_rad_s, move.acceleration_rad_s2);
  };
  if (auto back = go(move.from_rad); !back) return back;
  if (auto there = wait_until_done(axis, waiting, false, kArrivesWithin); !there) return there;
  return go(move.to_rad);
}

Result<void> start(const ExposeTask& expose, Camera& camera) {
  if (auto armed = camera.arm(); !armed) return armed;
  return camera.trigger(expose.exposure_s, expose.gain);
}

Result<void> start(const ShineTask& shine, Light& light) {
  if (light.capabilities().has_shutter) {
    if (auto open = light.set_shutter(true); !open) return open;
  }
  return light.set_level(shine.level);
}

Result<void> start(const SetLineTask& set, DigitalIo& io) {
  const auto levels = io.read();
  if (!levels) return pass(levels);
  if (set.line.empty()) return {};
  return io.set(set.line, set.active);
}

// The numbers that follow a task's name.
std::optional<std::vector<double>> numbers_of(std::span<const std::string> words) {
  std::vector<double> numbers;
  for (const std::string& word : words) {
    char* end = nullptr;
    numbers.push_back(std::strtod(word.c_str(), &end));
    if (word.empty() || *end != '\0') return std::nullopt;
  }
  return numbers;
}

}  // namespace

base::Result<void> start(const Task& task, std::vector<Device>& devices, base::Clock& clock) {
  const auto with = [&]<typename Kind>(std::type_identity<Kind>, auto&& call) -> Result<void> {
    auto device = find<Kind>(task.device, devices);
    if (!device) return pass(device);
    return call(**device);
  };
  return std::visit(
      Overloaded{
          [&](const MoveTask& move) {
            return with(std::type_identity<Axis>(), [&](Axis& axis) { return start(move, axis, clock); });
          },
          [&](const ExposeTask& expose) {
            return with(std::type_identity<Camera>(), [&](Camera& camera) { return start(expose, camera); });
          },
          [&](const ShineTask& shine) {
            return with(std::type_identity<Light>(), [&](Light& light) { return start(shine, light); });
          },
          [&](const SetLineTask& set) {
            return with(std::type_identity<DigitalIo>(), [&](DigitalIo& io) { return start(set, io); });
          }},
      task.what);
}

void look_at(const Task& task, std::vector<Device>& devices) {
  for (Device& one : devices) {
    if (one.name != task.device) continue;
    // A camera would hand its frame over.
    std::visit(
        Overloaded{[](std::unique_ptr<Axis>& axis) { (void)axis->state(); }, [](std::unique_ptr<Camera>&) {},
                   [](std::unique_ptr<Light>& light) { (void)light->state(); },
                   [](std::unique_ptr<DigitalIo>& io) { (void)io->read(); }},
        one.is);
  }
}

std::vector<std::string> words_of(const Task& task) {
  std::vector<std::string> words{task.device};
  const auto add = [&](auto... more) { (words.push_back(fmt::format("{}", more)), ...); };
  std::visit(Overloaded{[&](const MoveTask& move) {
                          add("move", move.from_rad, move.to_rad, move.velocity_rad_s,
                              move.acceleration_rad_s2);
                        },
                        [&](const ExposeTask& expose) { add("expose", expose.exposure_s, expose.gain); },
                        [&](const ShineTask& shine) { add("shine", shine.level); },
                        [&](const SetLineTask& set) { add("set_line", set.line, set.active ? 1 : 0); }},
             task.what);
  return words;
}

base::Result<Task> task_of(std::span<const std::string> words) {
  const auto wrong = [] { return fail(ErrorCode::bad_input, "the task is none"); };
  if (words.size() < 3) return wrong();
  Task task;
  task.device = words[0];
  const std::string& what = words[1];
  auto values = words.subspan(2);
  SetLineTask set;
  if (what == "set_line") {
    set.line = values[0];
    values = values.subspan(1);
  }
  const auto numbers = numbers_of(values);
  if (!numbers) return wrong();
  const auto& n = *numbers;
  if (what == "move" && n.size() == 4) {
    task.what = MoveTask{n[0], n[1], n[2], n[3]};
  } else if (what == "expose" && n.size() == 2) {
    task.what = ExposeTask{n[0], n[1]};
  } else if (what == "shine" && n.size() == 1) {
    task.what = ShineTask{n[0]};
  } else if (what == "set_line" && n.size() == 1) {
    set.active = n[0] != 0;
    task.what = set;
  } else {
    return wrong();
  }
  return task;
}

}  // namespace rig::drivers::conformance
