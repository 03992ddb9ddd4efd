#include "tests/drivers/tic_axis/bench.h"

#include "core/base/units.h"
#include "drivers/conformance/module_under_test.h"
#include "tests/drivers/tic_axis/lab.h"

namespace rig::drivers::tic::test {

namespace {

using base::radians;
using sim::wire::ControlSocket;

constexpr double kCountsPerDeg = 40;

sim::wire::TicSettingBytes bench_settings() {
  sim::wire::TicSettingBytes settings = lab_settings();
  settings[0x08] = 0;  // an error of the motor driver stays until it is cleared
  return settings;
}

class SocketWire final : public TicWire {
 public:
  explicit SocketWire(sim::wire::Tic& tic)
      : socket_(folder_ / "usb", [&tic](const auto& setup, auto out) { return tic.control(setup, out); }) {}
  [[nodiscard]] std::string transport() const override { return "unix:" + socket_.path().string(); }
  void heal() override {
    socket_.spoil(ControlSocket::Spoil::missing, 0);
    socket_.restore();
  }
  bool cut() override {
    socket_.cut();
    return true;
  }
  bool restore() override {
    socket_.restore();
    return true;
  }
  bool spoil(conformance::Spoil how, int answers) override {
    socket_.spoil(as_socket(how), answers);
    return true;
  }
  bool thin_out(int answers) override {
    socket_.spoil(ControlSocket::Spoil::two_of_three, answers);
    return true;
  }

 private:
  static ControlSocket::Spoil as_socket(conformance::Spoil how) {
    switch (how) {
      case conformance::Spoil::missing:
        return ControlSocket::Spoil::missing;
      case conformance::Spoil::garbage:
        return ControlSocket::Spoil::garbage;
      case conformance::Spoil::late:
        return ControlSocket::Spoil::late;
      case conformance::Spoil::duplicate:
        return ControlSocket::Spoil::duplicate;
    }
    return ControlSocket::Spoil::missing;
  }

  rig::test::TemporaryFolder folder_;
  ControlSocket socket_;
};

class TicPeer final : public conformance::AxisPeer {
 public:
  explicit TicPeer(sim::wire::Tic& tic) : tic_(tic) {}
  [[nodiscard]] double position_rad() override { return radians(tic_.motor_position() / kCountsPerDeg); }
  [[nodiscard]] bool moving() override { return tic_.velocity() != 0; }
  [[nodiscard]] int stops_seen() override { return tic_.stops_seen(); }
  bool set_limit(bool high, bool active) override {
    tic_.press_limit(high, active);
    return true;
  }
  bool set_fault(bool on) override {
    tic_.set_driver_error(on);
    return true;
  }
  bool forget_reference() override {
    tic_.power_cycle();
    return true;
  }

 private:
  sim::wire::Tic& tic_;
};

class TicBench final : public conformance::Bench {
 public:
  TicBench(std::string name, const sim::wire::TicWorld& world,
           const std::function<std::unique_ptr<TicWire>(sim::wire::Tic&)>& lay,
           std::chrono::milliseconds stop_bound, const std::string& module_settings)
      : name_(std::move(name)),
        stop_bound_(stop_bound),
        tic_(world, bench_settings()),
        clock_(base::make_system_clock()),
        wire_(lay(tic_)),
        peer_(tic_),
        module_{"tic_axis", module_settings + lab_table(world.serial, wire_->transport()), folder_.path()} {}

  [[nodiscard]] std::string name() const override { return name_; }
  [[nodiscard]] base::Result<std::vector<Device>> open() override {
    return conformance::open_module(module_, *clock_);
  }
  [[nodiscard]] base::Result<std::unique_ptr<conformance::Victim>> start_victim(
      const conformance::Task& task) override {
    return conformance::start_victim(module_, task);
  }
  [[nodiscard]] base::Clock& clock() override { return *clock_; }
  void reset() override {
    wire_->heal();
    tic_.press_limit(true, false);
    tic_.press_limit(false, false);
    tic_.set_driver_error(false);
    tic_.put_motor(0);
    tic_.power_cycle();
  }
  [[nodiscard]] conformance::Wire& wire() override { return *wire_; }
  [[nodiscard]] std::optional<conformance::AxisUnderTest> axis() override {
    conformance::AxisUnderTest test;
    test.device = "arm";
    test.peer = &peer_;
    test.low_rad = radians(-40);
    test.high_rad = radians(40);
    test.velocity_rad_s = radians(50);
    test.acceleration_rad_s2 = radians(300);
    test.stop_bound = stop_bound_;
    return test;
  }

 private:
  const std::string name_;
  const std::chrono::milliseconds stop_bound_;
  rig::test::TemporaryFolder folder_;
  sim::wire::Tic tic_;
  const std::unique_ptr<base::Clock> clock_;
  const std::unique_ptr<TicWire> wire_;
  TicPeer peer_;
  const conformance::ModuleUnderTest module_;
};

}  // namespace

std::unique_ptr<conformance::Bench> make_bench_on(
    const std::string& name, const sim::wire::TicWorld& world,
    const std::function<std::unique_ptr<TicWire>(sim::wire::Tic&)>& lay, std::chrono::milliseconds stop_bound,
    const std::string& module_settings) {
  return std::make_unique<TicBench>(name, world, lay, stop_bound, module_settings);
}

std::unique_ptr<conformance::Bench> make_bench() {
  // A stop waits for the transfer in flight, at the worst for a feeding whose answer does not come: 50 ms.
  constexpr std::chrono::milliseconds kStopBound{100};
  return make_bench_on(
      "tic_axis", {}, [](sim::wire::Tic& tic) { return std::make_unique<SocketWire>(tic); }, kStopBound);
}

}  // namespace rig::drivers::tic::test
