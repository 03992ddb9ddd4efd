#include "sim/devices.h"

#include "sim/camera.h"
#include "sim/machine.h"

namespace rig::sim {

using base::ErrorCode;
using base::fail;
using base::Result;
using drivers::Device;

namespace {

using Shared = std::shared_ptr<Machine>;

class VirtualAxis final : public drivers::Axis {
 public:
  VirtualAxis(Shared machine, std::size_t index) : machine_(std::move(machine)), index_(index) {}

  [[nodiscard]] drivers::AxisCapabilities capabilities() const override {
    const AxisWorld& a = machine_->world().axes[index_];
    return {a.resolution_rad,       a.max_velocity_rad_s, a.max_acceleration_rad_s2, true, true,
            a.homing_velocity_rad_s};
  }
  [[nodiscard]] Result<void> enable(bool on) override {
    if (auto reached = reach(); !reached) return reached;
    return machine_->enable(index_, on);
  }
  [[nodiscard]] Result<void> home() override {
    if (auto reached = reach(); !reached) return reached;
    return machine_->home(index_);
  }
  [[nodiscard]] Result<void> move_to(double target_rad, double velocity, double acceleration) override {
    if (auto reached = reach(); !reached) return reached;
    return machine_->move(index_, target_rad, velocity, acceleration);
  }
  [[nodiscard]] Result<void> move_by(double delta_rad, double velocity, double acceleration) override {
    if (auto reached = reach(); !reached) return reached;
    return machine_->jog(index_, delta_rad, velocity, acceleration);
  }
  [[nodiscard]] Result<void> stop() override {
    if (auto reached = reach(); !reached) return reached;
    return machine_->stop(index_);
  }
  [[nodiscard]] Result<drivers::AxisState> state() override {
    if (auto reached = reach(); !reached) return base::pass(reached);
    return machine_->axis_state(index_);
  }

 private:
  [[nodiscard]] Result<void> reach() { return machine_->reach(kAxisNames[index_]); }

  Shared machine_;
  std::size_t index_;
};

class VirtualLight final : public drivers::Light {
 public:
  explicit VirtualLight(Shared machine) : machine_(std::move(machine)) {}

  [[nodiscard]] drivers::LightCapabilities capabilities() const override {
    return {true, true, machine_->world().light.warm_up_s};
  }
  [[nodiscard]] Result<void> set_level(double level) override {
    if (auto reached = machine_->reach("light"); !reached) return reached;
    return machine_->set_level(level);
  }
  [[nodiscard]] Result<void> set_shutter(bool open) override {
    if (auto reached = machine_->reach("light"); !reached) return reached;
    machine_->set_shutter(open);
    return {};
  }
  [[nodiscard]] Result<drivers::LightState> state() override {
    if (auto reached = machine_->reach("light"); !reached) return base::pass(reached);
    return machine_->light_state();
  }

 private:
  Shared machine_;
};

class VirtualLines final : public drivers::DigitalIo {
 public:
  explicit VirtualLines(Shared machine) : machine_(std::move(machine)) {}

  [[nodiscard]] std::vector<drivers::Line> lines() const override {
    std::vector<drivers::Line> all{{"emergency_stop", false}, {"camera_trigger", true, false}};
    for (const char* axis : kAxisNames) {
      for (const char* end : {"low", "high"}) all.push_back({fmt::format("{}_{}", axis, end), false});
    }
    return all;
  }
  [[nodiscard]] Result<std::vector<bool>> read() override {
    if (auto reached = machine_->reach("lines"); !reached) return base::pass(reached);
    if (machine_->strike(FaultKind::garbage, "lines")) return std::vector<bool>();
    std::vector<bool> levels{machine_->emergency_stop(), false};
    for (const auto& axis : machine_->limit_lines()) levels.insert(levels.end(), axis.begin(), axis.end());
    return levels;
  }
  [[nodiscard]] Result<void> set(const std::string& line, bool active) override {
    if (auto reached = machine_->reach("lines"); !reached) return reached;
    if (line == "camera_trigger") {
      if (active) machine_->pulse_trigger_line();
      return {};
    }
    return fail(ErrorCode::bad_input, fmt::format("there is no output line '{}'", line), "lines");
  }

 private:
  Shared machine_;
};

}  // namespace

void check_settings(const base::ConfigTable& settings) {
  (void)read_world(settings);
}

Result<std::vector<Device>> open_devices(const drivers::OpenContext& context) {
  const World world = read_world(context.settings);
  if (auto fine = context.settings.noted(); !fine) return base::pass(fine);
  auto machine = Machine::open(
      world, context.clock, context.state_folder,
      [log = context.log](const std::string& complaint) { log(base::LogLevel::warning, complaint); });
  if (!machine) return base::pass(machine);
  std::vector<Device> devices;
  for (std::size_t i = 0; i < kAxes; ++i) {
    devices.push_back({kAxisNames[i], "axes", std::make_unique<VirtualAxis>(*machine, i)});
  }
  devices.push_back({"camera", "camera", std::make_unique<VirtualCamera>(*machine)});
  devices.push_back({"light", "light", std::make_unique<VirtualLight>(*machine)});
  devices.push_back({"lines", "light", std::make_unique<VirtualLines>(*machine)});
  return devices;
}

}  // namespace rig::sim
