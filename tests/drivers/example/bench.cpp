#include "tests/drivers/example/bench.h"

#include "core/base/units.h"
#include "drivers/conformance/module_under_test.h"
#include "tests/core/temporary_folder.h"
#include "tests/drivers/example/turner.h"

namespace rig::drivers::turner {

using base::radians;
using conformance::Spoil;
using sim::wire::Turner;

namespace {

class TurnerWire final : public conformance::Wire {
 public:
  explicit TurnerWire(Turner& turner) : turner_(turner) {}
  bool cut() override {
    turner_.cut();
    return true;
  }
  bool restore() override {
    turner_.restore();
    return true;
  }
  bool thin_out(int answers) override {
    turner_.spoil(Turner::Answers::two_of_three, answers);
    return true;
  }
  bool spoil(Spoil how, int answers) override {
    switch (how) {
      case Spoil::missing:
        turner_.spoil(Turner::Answers::missing, answers);
        break;
      case Spoil::garbage:
        turner_.spoil(Turner::Answers::garbage, answers);
        break;
      case Spoil::late:
        turner_.spoil(Turner::Answers::late, answers);
        break;
      case Spoil::duplicate:
        turner_.spoil(Turner::Answers::doubled, answers);
        break;
    }
    return true;
  }

 private:
  Turner& turner_;
};

class TurnerPeer final : public conformance::AxisPeer {
 public:
  explicit TurnerPeer(Turner& turner) : turner_(turner) {}
  [[nodiscard]] double position_rad() override {
    return radians(turner_.true_counts() / Turner::kCountsPerDegree);
  }
  [[nodiscard]] bool moving() override { return turner_.moving(); }
  [[nodiscard]] int stops_seen() override { return turner_.stops_seen(); }
  bool set_limit(bool high, bool active) override {
    turner_.press_limit(high, active);
    return true;
  }
  bool set_fault(bool on) override {
    turner_.set_fault(on);
    return true;
  }
  bool forget_reference() override {
    turner_.power_up();
    return true;
  }

 private:
  Turner& turner_;
};

class TurnerBench final : public conformance::Bench {
 public:
  [[nodiscard]] std::string name() const override { return "example"; }
  [[nodiscard]] base::Clock& clock() override { return *clock_; }
  [[nodiscard]] conformance::Wire& wire() override { return wire_; }
  void reset() override { turner_.reset(); }

  [[nodiscard]] base::Result<std::vector<Device>> open() override {
    return conformance::open_module(module_, *clock_);
  }
  [[nodiscard]] base::Result<std::unique_ptr<conformance::Victim>> start_victim(
      const conformance::Task& task) override {
    return conformance::start_victim(module_, task);
  }

  [[nodiscard]] std::optional<conformance::AxisUnderTest> axis() override {
    return conformance::AxisUnderTest{
        "pan", &axis_, radians(-12), radians(13), radians(50), radians(500), std::chrono::milliseconds(50)};
  }

 private:
  test::TemporaryFolder folder_;
  const std::unique_ptr<base::Clock> clock_ = base::make_system_clock();
  Turner turner_{folder_ / "line"};
  TurnerWire wire_{turner_};
  TurnerPeer axis_{turner_};
  const conformance::ModuleUnderTest module_{
      "turner",
      fmt::format("port = \"{}\"\nanswer_ms = 100\n[axis.pan]\ncounts_per_deg = 100\n"
                  "max_velocity_deg_s = 90\nmax_acceleration_deg_s2 = 900\n",
                  (folder_ / "line").string()),
      folder_.path()};
};

}  // namespace

std::unique_ptr<conformance::Bench> make_bench() {
  return std::make_unique<TurnerBench>();
}

}  // namespace rig::drivers::turner
