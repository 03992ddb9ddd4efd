#include "drivers/ptu_axis/devices.h"

#include <thread>

#include "drivers/common/connection.h"
#include "drivers/ptu_axis/session.h"
#include "drivers/ptu_axis/settings.h"

namespace rig::drivers::ptu {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;
using std::chrono::milliseconds;

namespace {

// A unit and the connection that it comes back on. Both axes share it, and its bus' worker makes all calls.
class Unit {
 public:
  Unit(Settings settings, base::Clock& clock, void (*log)(base::LogLevel, std::string_view))
      : settings_(std::move(settings)),
        resolutions_(settings_.axes.size()),
        clock_(clock),
        log_(log),
        connection_([this] { return connect(); }, clock) {}

  // Waits until the unit is set up. One that is silent may be in the middle of a reset, its own at power-up
  // or one that another process asked for.
  Result<void> open() {
    constexpr milliseconds kWait{20};
    const auto enough = std::chrono::steady_clock::now() + settings_.reset_within;
    while (true) {
      const bool was_open = connection_.is_open();
      const int before = connection_.times_opened();
      const auto done = set_up(kWait);
      if (done && *done) break;
      const bool has_line = was_open || connection_.times_opened() > before;
      const bool silent = !done && done.error().code == ErrorCode::lost && has_line;
      if (!done && (!silent || std::chrono::steady_clock::now() >= enough)) return pass(done);
      std::this_thread::sleep_for(milliseconds(done ? 1 : 50));
    }
    Session& session = **connection_.get();
    for (std::size_t i = 0; i < settings_.axes.size(); ++i) capabilities_.push_back(session.capabilities(i));
    return {};
  }

  // With the session once it is set up, a part of which is done at each call; until then the unit is lost.
  template <typename Use>
  auto use(Use&& use) -> decltype(use(std::declval<Session&>())) {
    const auto ready = set_up(milliseconds(0));
    if (!ready) return pass(ready);
    if (!*ready) return fail(ErrorCode::lost, "the pan-tilt unit is being set up", settings_.serial.path);
    return connection_.use(use);
  }

  Result<void> stop(std::size_t axis) {
    const auto session = connection_.get();
    if (!session) return pass(session);
    if ((*session)->is_set_up()) return connection_.use([&](Session& s) { return s.stop(axis); });
    if (auto ok = (*session)->shout_halt(); !ok) {
      connection_.close();
      return ok;
    }
    return fail(ErrorCode::lost, "the pan-tilt unit is being set up; it was told to halt",
                settings_.serial.path);
  }

  [[nodiscard]] const AxisCapabilities& capabilities(std::size_t axis) const { return capabilities_[axis]; }
  [[nodiscard]] const Settings& settings() const { return settings_; }

 private:
  // True: it is set up. One that cannot be begins anew with the next call.
  Result<bool> set_up(milliseconds wait) {
    auto session = connection_.get();
    if (!session) return pass(session);
    if ((*session)->is_set_up()) return true;
    auto done = (*session)->progress(wait);
    if (!done) {
      connection_.close();
    } else if (*done && connection_.times_opened() > 1) {
      log_(base::LogLevel::warning,
           fmt::format("{}: the pan-tilt unit is back; it has to be homed", settings_.serial.path));
    }
    return done;
  }

  Result<std::unique_ptr<Session>> connect() {
    auto line = SerialLine::open(settings_.serial);
    if (!line) return pass(line);
    return std::make_unique<Session>(settings_, resolutions_, Link(std::move(*line), settings_.retry),
                                     clock_);
  }

  const Settings settings_;
  std::vector<std::optional<double>> resolutions_;
  base::Clock& clock_;
  void (*const log_)(base::LogLevel, std::string_view);
  std::vector<AxisCapabilities> capabilities_;
  Connection<Session> connection_;
};

class UnitsAxis final : public Axis {
 public:
  UnitsAxis(std::shared_ptr<Unit> unit, std::size_t index) : unit_(std::move(unit)), index_(index) {}

  [[nodiscard]] AxisCapabilities capabilities() const override { return unit_->capabilities(index_); }
  [[nodiscard]] Result<void> enable(bool on) override {
    return unit_->use([&](Session& session) { return session.enable(index_, on); });
  }
  [[nodiscard]] Result<void> home() override {
    return unit_->use([&](Session& session) { return session.home(index_); });
  }
  [[nodiscard]] Result<void> move_to(double target_rad, double velocity, double acceleration) override {
    return unit_->use(
        [&](Session& session) { return session.move_to(index_, target_rad, velocity, acceleration); });
  }
  [[nodiscard]] Result<void> stop() override { return unit_->stop(index_); }
  [[nodiscard]] Result<AxisState> state() override {
    return unit_->use([&](Session& session) { return session.state(index_); });
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
