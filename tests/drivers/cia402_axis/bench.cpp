#include "tests/drivers/cia402_axis/bench.h"

#include "core/base/units.h"
#include "drivers/conformance/module_under_test.h"
#include "tests/drivers/cia402_axis/rig.h"

namespace rig::drivers::cia402 {

namespace {

using sim::wire::CanHub;
using sim::wire::CanopenNode;
using sim::wire::CanopenStation;
using Time = CanopenNode::Time;

constexpr int kNode = 1;
constexpr canid_t kAnswers = 0x580 + kNode;
constexpr std::uint16_t kOverload = 0x2350;
constexpr std::chrono::milliseconds kLate{150};  // answer_ms is 100

class CanWire final : public conformance::Wire {
 public:
  CanWire(CanHub& hub, CanopenStation& station) : hub_(hub), station_(station) {}
  bool cut() override {
    station_.unplug(true);
    return true;
  }
  bool restore() override {
    station_.unplug(false);
    return true;
  }
  bool thin_out(int answers) override {
    hub_.heal();
    hub_.spoil(CanHub::Fault::drop_two_of_three, kAnswers, answers);
    return true;
  }
  bool spoil(conformance::Spoil how, int answers) override {
    switch (how) {
      case conformance::Spoil::missing:
        hub_.spoil(CanHub::Fault::drop, kAnswers, answers);
        break;
      case conformance::Spoil::garbage:
        hub_.spoil(CanHub::Fault::garble, kAnswers, answers);
        break;
      case conformance::Spoil::late:
        hub_.spoil(CanHub::Fault::delay, kAnswers, answers, kLate);
        break;
      case conformance::Spoil::duplicate:
        hub_.spoil(CanHub::Fault::duplicate, kAnswers, answers);
        break;
    }
    return true;
  }

 private:
  CanHub& hub_;
  CanopenStation& station_;
};

class DrivePeer final : public conformance::AxisPeer {
 private:
  template <typename Use>
  auto with(Use&& use) {
    return station_.with(kNode, [&](CanopenNode& node, Time now) {
      node.drive().tick(now);
      return use(node.drive());
    });
  }

 public:
  explicit DrivePeer(CanopenStation& station) : station_(station) {}
  double position_rad() override {
    return base::radians(with([](auto& drive) { return drive.position(); }) / kCountsPerDeg);
  }
  bool moving() override {
    return with([](auto& drive) { return drive.moving(); });
  }
  int stops_seen() override {
    return with([](auto& drive) { return drive.stops_seen(); });
  }
  bool set_limit(bool high, bool active) override {
    with([&](auto& drive) { drive.press_limit(high, active); });
    return true;
  }
  bool set_fault(bool on) override {
    with([&](auto& drive) { on ? drive.trip(kOverload, 0x03) : drive.cause_gone(); });
    return true;
  }
  bool forget_reference() override {
    station_.power_cycle(kNode);
    return true;
  }

 private:
  CanopenStation& station_;
};

class Cia402Bench final : public conformance::Bench {
 public:
  Cia402Bench() { reset(); }

  [[nodiscard]] std::string name() const override { return "cia402_axis"; }
  [[nodiscard]] Result<std::vector<Device>> open() override {
    return conformance::open_module(module_, *clock_);
  }
  [[nodiscard]] base::Result<std::unique_ptr<conformance::Victim>> start_victim(
      const conformance::Task& task) override {
    return conformance::start_victim(module_, task);
  }
  [[nodiscard]] base::Clock& clock() override { return *clock_; }
  void reset() override {
    wire_.reset();
    peer_.reset();
    station_.reset();
    hub_.reset();
    hub_ = std::make_unique<CanHub>(folder_ / "can");
    station_ = std::make_unique<CanopenStation>(hub_->attach(), std::vector{quick_node(kNode)});
    station_->power_cycle(kNode);
    wire_ = std::make_unique<CanWire>(*hub_, *station_);
    peer_ = std::make_unique<DrivePeer>(*station_);
  }
  [[nodiscard]] conformance::Wire& wire() override { return *wire_; }
  [[nodiscard]] std::optional<conformance::AxisUnderTest> axis() override {
    conformance::AxisUnderTest test;
    test.device = "pan";
    test.peer = peer_.get();
    test.low_rad = base::radians(-40);
    test.high_rad = base::radians(40);
    test.velocity_rad_s = base::radians(200);
    test.acceleration_rad_s2 = base::radians(1000);
    test.stop_bound = std::chrono::milliseconds(100);
    return test;
  }

 private:
  test::TemporaryFolder folder_;
  const conformance::ModuleUnderTest module_{
      "cia402_axis", settings_text("unix:" + (folder_ / "can").string(), "call_ms = 1000"), folder_.path()};
  std::unique_ptr<base::Clock> clock_ = base::make_system_clock();
  std::unique_ptr<CanHub> hub_;
  std::unique_ptr<CanopenStation> station_;
  std::unique_ptr<CanWire> wire_;
  std::unique_ptr<DrivePeer> peer_;
};

}  // namespace

std::unique_ptr<conformance::Bench> make_bench() {
  return std::make_unique<Cia402Bench>();
}

}  // namespace rig::drivers::cia402
