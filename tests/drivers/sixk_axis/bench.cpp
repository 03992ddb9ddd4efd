#include "tests/drivers/sixk_axis/bench.h"

#include "core/base/units.h"
#include "drivers/conformance/module_under_test.h"
#include "sim/wire/sixk.h"
#include "tests/core/temporary_folder.h"

namespace rig::drivers::sixk {

namespace {

using base::radians;
using sim::wire::Answers;
using sim::wire::Sixk;

// As in the settings below.
constexpr std::size_t kAxis = 2;
constexpr double kZero_deg = -10;
constexpr double kCountsPerDegree = 200;

constexpr const char* kSettings = R"(
answer_ms = 150
attempts = 4
[axis.turntable]
number = 1
counts_per_deg = 250
max_velocity_deg_s = 60.0
max_acceleration_deg_s2 = 240.0
home_velocity_deg_s = 30.0
[axis.arm]
number = 2
counts_per_deg = 200
reversed = true
zero_deg = -10.0
max_velocity_deg_s = 60.0
max_acceleration_deg_s2 = 240.0
home_velocity_deg_s = 60.0
home_towards = "low"
)";

class Arm final : public conformance::AxisPeer {
 public:
  explicit Arm(Sixk& controller) : controller_(controller) {}
  [[nodiscard]] double position_rad() override {
    return radians(kZero_deg - controller_.position(kAxis) / kCountsPerDegree);
  }
  [[nodiscard]] bool moving() override { return controller_.moving(kAxis); }
  [[nodiscard]] int stops_seen() override { return controller_.stops(kAxis); }
  bool set_limit(bool high, bool active) override {
    controller_.press(kAxis, !high, active);  // reversed
    return true;
  }
  bool set_fault(bool on) override {
    controller_.set_drive_fault(kAxis, on);
    return true;
  }
  bool forget_reference() override {
    controller_.power_cycle();
    return true;
  }

 private:
  Sixk& controller_;
};

class Line final : public conformance::Wire {
 public:
  explicit Line(Sixk& controller) : controller_(controller) {}
  bool cut() override {
    controller_.cut();
    return true;
  }
  bool restore() override {
    controller_.restore();
    return true;
  }
  bool thin_out(int answers) override {
    controller_.spoil(Answers::Spoil::two_of_three, answers);
    return true;
  }
  bool spoil(conformance::Spoil how, int answers) override {
    switch (how) {
      case conformance::Spoil::missing:
        controller_.spoil(Answers::Spoil::missing, answers);
        break;
      case conformance::Spoil::garbage:
        controller_.spoil(Answers::Spoil::garbage, answers);
        break;
      case conformance::Spoil::late:
        controller_.spoil(Answers::Spoil::late, answers);
        break;
      case conformance::Spoil::duplicate:
        controller_.spoil(Answers::Spoil::duplicate, answers);
        break;
    }
    return true;
  }

 private:
  Sixk& controller_;
};

class SixkBench final : public conformance::Bench {
 public:
  SixkBench()
      : controller_(setup(folder_)),
        arm_(controller_),
        line_(controller_),
        module_{"sixk_axis", fmt::format("port = \"{}\"\n{}", controller_.path().string(), kSettings),
                folder_.path()} {}

  [[nodiscard]] std::string name() const override { return "sixk_axis"; }
  [[nodiscard]] base::Result<std::vector<Device>> open() override {
    return conformance::open_module(module_, *clock_);
  }
  [[nodiscard]] base::Result<std::unique_ptr<conformance::Victim>> start_victim(
      const conformance::Task& task) override {
    return conformance::start_victim(module_, task);
  }
  [[nodiscard]] base::Clock& clock() override { return *clock_; }
  void reset() override { controller_.make_fresh(); }
  [[nodiscard]] conformance::Wire& wire() override { return line_; }
  [[nodiscard]] std::optional<conformance::AxisUnderTest> axis() override {
    conformance::AxisUnderTest test;
    test.device = "arm";
    test.peer = &arm_;
    test.low_rad = radians(-30);
    test.high_rad = radians(30);
    test.velocity_rad_s = radians(60);
    test.acceleration_rad_s2 = radians(240);
    test.stop_bound = std::chrono::milliseconds(100);
    return test;
  }

 private:
  static Sixk::Setup setup(const test::TemporaryFolder& folder) {
    Sixk::Setup setup;
    setup.link = folder / "sixk";
    // Later than the driver waits.
    setup.lateness = std::chrono::milliseconds(225);
    return setup;
  }

  test::TemporaryFolder folder_;
  Sixk controller_;
  Arm arm_;
  Line line_;
  const conformance::ModuleUnderTest module_;
  std::unique_ptr<base::Clock> clock_ = base::make_system_clock();
};

}  // namespace

std::unique_ptr<conformance::Bench> make_bench() {
  return std::make_unique<SixkBench>();
}

}  // namespace rig::drivers::sixk
