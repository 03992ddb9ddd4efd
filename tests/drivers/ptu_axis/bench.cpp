#include "tests/drivers/ptu_axis/bench.h"

#include "core/base/units.h"
#include "drivers/conformance/module_under_test.h"
#include "sim/wire/ptu.h"
#include "tests/core/temporary_folder.h"

namespace rig::drivers::ptu {

namespace {

using base::radians;
using sim::wire::Answers;
using sim::wire::Ptu;

// As in the settings below, for a unit of 185.1428 seconds of arc a step.
constexpr double kZero_deg = 5;
constexpr double kCountsPerDegree = 3600 / 185.1428;

constexpr const char* kSettings = R"(
answer_ms = 150
attempts = 4
[axis.pan]
reversed = true
zero_deg = 5.0
max_velocity_deg_s = 60.0
max_acceleration_deg_s2 = 240.0
[axis.tilt]
max_velocity_deg_s = 40.0
max_acceleration_deg_s2 = 200.0
)";

class Pan final : public conformance::AxisPeer {
 public:
  explicit Pan(Ptu& unit) : unit_(unit) {}
  [[nodiscard]] double position_rad() override {
    return radians(kZero_deg - unit_.position(Ptu::pan) / kCountsPerDegree);
  }
  [[nodiscard]] bool moving() override { return unit_.moving(Ptu::pan); }
  [[nodiscard]] int stops_seen() override { return unit_.halts(Ptu::pan); }
  // The unit tells only that it ran into an end stop, and not whether it stands on one.
  [[nodiscard]] bool reports_faults() override { return false; }
  bool forget_reference() override {
    unit_.power_cycle();
    return true;
  }

 private:
  Ptu& unit_;
};

class Line final : public conformance::Wire {
 public:
  explicit Line(Ptu& unit) : unit_(unit) {}
  bool cut() override {
    unit_.cut();
    return true;
  }
  bool restore() override {
    unit_.restore();
    return true;
  }
  bool thin_out(int answers) override {
    unit_.spoil(Answers::Spoil::two_of_three, answers);
    return true;
  }
  bool spoil(conformance::Spoil how, int answers) override {
    switch (how) {
      case conformance::Spoil::missing:
        unit_.spoil(Answers::Spoil::missing, answers);
        break;
      case conformance::Spoil::garbage:
        unit_.spoil(Answers::Spoil::garbage, answers);
        break;
      case conformance::Spoil::late:
        unit_.spoil(Answers::Spoil::late, answers);
        break;
      case conformance::Spoil::duplicate:
        unit_.spoil(Answers::Spoil::duplicate, answers);
        break;
    }
    return true;
  }

 private:
  Ptu& unit_;
};

class PtuBench final : public conformance::Bench {
 public:
  PtuBench()
      : unit_(setup(folder_)),
        pan_(unit_),
        line_(unit_),
        module_{"ptu_axis", fmt::format("port = \"{}\"\n{}", unit_.path().string(), kSettings),
                folder_.path()} {}

  [[nodiscard]] std::string name() const override { return "ptu_axis"; }
  [[nodiscard]] base::Result<std::vector<Device>> open() override {
    return conformance::open_module(module_, *clock_);
  }
  [[nodiscard]] base::Result<std::unique_ptr<conformance::Victim>> start_victim(
      const conformance::Task& task) override {
    return conformance::start_victim(module_, task);
  }
  [[nodiscard]] base::Clock& clock() override { return *clock_; }
  void reset() override { unit_.make_fresh(); }
  [[nodiscard]] conformance::Wire& wire() override { return line_; }
  [[nodiscard]] std::optional<conformance::AxisUnderTest> axis() override {
    conformance::AxisUnderTest test;
    test.device = "pan";
    test.peer = &pan_;
    test.low_rad = radians(-30);
    test.high_rad = radians(30);
    test.velocity_rad_s = radians(60);
    test.acceleration_rad_s2 = radians(240);
    test.stop_bound = std::chrono::milliseconds(100);
    return test;
  }

 private:
  static Ptu::Setup setup(const test::TemporaryFolder& folder) {
    Ptu::Setup setup;
    setup.link = folder / "ptu";
    setup.reset_speed = 60000;
    // Later than the driver waits.
    setup.lateness = std::chrono::milliseconds(225);
    return setup;
  }

  test::TemporaryFolder folder_;
  Ptu unit_;
  Pan pan_;
  Line line_;
  const conformance::ModuleUnderTest module_;
  std::unique_ptr<base::Clock> clock_ = base::make_system_clock();
};

}  // namespace

std::unique_ptr<conformance::Bench> make_bench() {
  return std::make_unique<PtuBench>();
}

}  // namespace rig::drivers::ptu
