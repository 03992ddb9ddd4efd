#include "drivers/ptu_axis/devices.h"

#include "drivers/common/prepared.h"
#include "drivers/ptu_axis/session.h"
#include "drivers/ptu_axis/settings.h"

namespace rig::drivers::ptu {

using base::pass;
using base::Result;

namespace {

// A unit and the connection that it comes back on. Both axes share it, and its bus' worker makes all calls.
class Unit {
 public:
  Unit(Settings settings, base::Clock& clock, void (*log)(base::LogLevel, std::string_view))
      : settings_(std::move(settings)),
        resolutions_(settings_.axes.size()),
        connection_(
            [this, &clock] { return connect(clock); }, clock, settings_.retry, settings_.serial.path,
            [this, log] {
              log(base::LogLevel::warning,
                  fmt::format("{}: the pan-tilt unit is back; it has to be homed", settings_.serial.path));
            }) {}

  // One that is silent may be in the middle of a reset: its own at power-up, or one that was asked for
  // before.
  Result<void> open() {
    const auto session = connection_.wait(settings_.reset_within);
    if (!session) return pass(session);
    for (std::size_t i = 0; i < settings_.axes.size(); ++i) {
      capabilities_.push_back((*session)->capabilities(i));
    }
    return {};
  }

  [[nodiscard]] Prepared<Session>& connection() { return connection_; }
  [[nodiscard]] const AxisCapabilities& capabilities(std::size_t axis) const { return capabilities_[axis]; }
  [[nodiscard]] const Settings& settings() const { return settings_; }

 private:
  Result<std::unique_ptr<Session>> connect(base::Clock& clock) {
    auto line = SerialLine::open(settings_.serial);
    if (!line) return pass(line);
    return std::make_unique<Session>(settings_, resolutions_, Link(std::move(*line), settings_.retry), clock);
  }

  const Settings settings_;
  std::vector<std::optional<double>> resolutions_;
  std::vector<AxisCapabilities> capabilities_;
  Prepared<Session> connection_;
};

class UnitsAxis final : public Axis {
 public:
  UnitsAxis(std::shared_ptr<Unit> unit, std::size_t index) : unit_(std::move(unit)), index_(index) {}

  [[nodiscard]] AxisCapabilities capabilities() const override { return unit_->capabilities(index_); }
  [[nodiscard]] Result<void> enable(bool on) override {
    return unit_->connection().use([&](Session& session) { return session.enable(index_, on); });
  }
  [[nodiscard]] Result<void> home() override {
    return unit_->connection().use([&](Session& session) { return session.home(index_); });
  }
  [[nodiscard]] Result<void> move_to(double target_rad, double velocity, double acceleration) override {
    return unit_->connection().use(
        [&](Session& session) { return session.move_to(index_, target_rad, velocity, acceleration); });
  }
  [[nodiscard]] Result<void> move_by(double delta_rad, double velocity, double acceleration) override {
    return unit_->connection().use(
        [&](Session& session) { return session.move_by(index_, delta_rad, velocity, acceleration); });
  }
  [[nodiscard]] Result<void> stop() override {
    return unit_->connection().use_at_once([&](Session& session) { return session.stop(index_); },
                                           [&](Session& session) { return session.shout_halt(); });
  }
  [[nodiscard]] Result<AxisState> state() override {
    return unit_->connection().use([&](Session& session) { return session.state(index_); });
  }

 private:
  const std::shared_ptr<Unit> unit_;
  const std::size_t index_;
};

}  // namespace

void check_settings(const base::ConfigTable& settings) {
  (void)read_settings(settings);
}

Result<std::vector<Device>> open_devices(const OpenContext& context) {
  Settings settings = read_settings(context.settings);
  if (auto fine = context.settings.noted(); !fine) return pass(fine);
  auto unit = std::make_shared<Unit>(std::move(settings), context.clock, context.log);
  if (auto ok = unit->open(); !ok) return pass(ok);
  std::vector<Device> devices;
  for (std::size_t i = 0; i < unit->settings().axes.size(); ++i) {
    devices.push_back({unit->settings().axes[i].axis.name, "ptu", std::make_unique<UnitsAxis>(unit, i)});
  }
  return devices;
}

}  // namespace rig::drivers::ptu
