#include "drivers/sixk_axis/devices.h"

#include "drivers/common/prepared.h"
#include "drivers/sixk_axis/controller.h"
#include "drivers/sixk_axis/settings.h"

namespace rig::drivers::sixk {

using base::pass;
using base::Result;
using std::chrono::milliseconds;

namespace {

// A controller and the connection that it comes back on. Its axes share it, and its bus' worker makes all
// calls.
class Box {
 public:
  Box(Settings settings, const OpenContext& context)
      : settings_(std::move(settings)),
        connection_([this, &clock = context.clock] { return connect(clock); }, context.clock, settings_.retry,
                    settings_.serial.path,
                    [this, log = context.log] {
                      log(base::LogLevel::warning,
                          fmt::format("{}: the controller is back and set up again", settings_.serial.path));
                    }) {
    for (const ControllerAxis& axis : settings_.axes) {
      references_.emplace_back(context.state_folder, axis.axis.name, context.log);
    }
  }

  Result<void> open() {
    const auto controller = connection_.wait(milliseconds(0));
    if (!controller) return pass(controller);
    for (std::size_t i = 0; i < settings_.axes.size(); ++i) {
      capabilities_.push_back((*controller)->capabilities(i));
    }
    return {};
  }

  [[nodiscard]] Prepared<Controller>& connection() { return connection_; }
  [[nodiscard]] const AxisCapabilities& capabilities(std::size_t axis) const { return capabilities_[axis]; }
  [[nodiscard]] const Settings& settings() const { return settings_; }

 private:
  Result<std::unique_ptr<Controller>> connect(base::Clock& clock) {
    auto line = SerialLine::open(settings_.serial);
    if (!line) return pass(line);
    Link link(std::move(*line), settings_.retry, settings_.unit, settings_.error_level);
    return std::make_unique<Controller>(settings_, references_, std::move(link), clock);
  }

  const Settings settings_;
  std::vector<Reference> references_;
  std::vector<AxisCapabilities> capabilities_;
  Prepared<Controller> connection_;
};

class ControllersAxis final : public Axis {
 public:
  ControllersAxis(std::shared_ptr<Box> box, std::size_t index) : box_(std::move(box)), index_(index) {}

  [[nodiscard]] AxisCapabilities capabilities() const override { return box_->capabilities(index_); }
  [[nodiscard]] Result<void> enable(bool on) override {
    return box_->connection().use([&](Controller& controller) { return controller.enable(index_, on); });
  }
  [[nodiscard]] Result<void> home() override {
    return box_->connection().use([&](Controller& controller) { return controller.home(index_); });
  }
  [[nodiscard]] Result<void> move_to(double target_rad, double velocity, double acceleration) override {
    return box_->connection().use([&](Controller& controller) {
      return controller.move_to(index_, target_rad, velocity, acceleration);
    });
  }
  [[nodiscard]] Result<void> move_by(double delta_rad, double velocity, double acceleration) override {
    return box_->connection().use([&](Controller& controller) {
      return controller.move_by(index_, delta_rad, velocity, acceleration);
    });
  }
  [[nodiscard]] Result<void> stop() override {
    return box_->connection().use_at_once(
        [&](Controller& controller) { return controller.stop(index_); },
        [&](Controller& controller) { return controller.shout_stop(index_); });
  }
  [[nodiscard]] Result<AxisState> state() override {
    return box_->connection().use([&](Controller& controller) { return controller.state(index_); });
  }

 private:
  const std::shared_ptr<Box> box_;
  const std::size_t index_;
};

}  // namespace

void check_settings(const base::ConfigTable& settings) {
  (void)read_settings(settings);
}

Result<std::vector<Device>> open_devices(const OpenContext& context) {
  Settings settings = read_settings(context.settings);
  if (auto fine = context.settings.noted(); !fine) return pass(fine);
  auto box = std::make_shared<Box>(std::move(settings), context);
  if (auto ok = box->open(); !ok) return pass(ok);
  std::vector<Device> devices;
  for (std::size_t i = 0; i < box->settings().axes.size(); ++i) {
    devices.push_back(
        {box->settings().axes[i].axis.name, "controller", std::make_unique<ControllersAxis>(box, i)});
  }
  return devices;
}

}  // namespace rig::drivers::sixk
