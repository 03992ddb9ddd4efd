#include "tests/drivers/modbus_axis/bench.h"

#include "core/base/units.h"
#include "drivers/conformance/module_under_test.h"
#include "sim/wire/modbus_leadshine.h"
#include "sim/wire/modbus_line.h"
#include "sim/wire/modbus_oriental.h"
#include "tests/core/temporary_folder.h"
#include "tests/drivers/modbus_axis/opened_module.h"

namespace rig::drivers::modbus {

namespace {

using conformance::AxisUnderTest;
using sim::wire::ModbusDrive;
using sim::wire::ModbusLine;
using std::chrono::milliseconds;

constexpr double kCountsPerDeg = 1000;
// The drive begins in the middle of its travel; its home is off it, so that homing takes a moment.
constexpr double kTravel = 60000, kHome = -20000;

class LineWire final : public conformance::Wire {
 public:
  explicit LineWire(ModbusLine& line) : line_(line) {}
  bool cut() override {
    line_.cut();
    return true;
  }
  bool restore() override {
    line_.restore();
    return true;
  }
  bool spoil(conformance::Spoil how, int answers) override {
    using conformance::Spoil;
    line_.spoil(how == Spoil::missing   ? ModbusLine::Spoil::missing
                : how == Spoil::garbage ? ModbusLine::Spoil::garbage
                : how == Spoil::late    ? ModbusLine::Spoil::late
                                        : ModbusLine::Spoil::duplicate,
                answers);
    return true;
  }
  bool thin_out(int answers) override {
    line_.spoil(ModbusLine::Spoil::two_of_three, answers);
    return true;
  }

 private:
  ModbusLine& line_;
};

class DrivePeer final : public conformance::AxisPeer {
 public:
  DrivePeer(ModbusDrive& drive, bool reversed, bool absolute)
      : drive_(drive), reversed_(reversed), absolute_(absolute) {}
  [[nodiscard]] double position_rad() override {
    return base::radians(drive_.position() / kCountsPerDeg) * (reversed_ ? -1 : 1);
  }
  [[nodiscard]] bool moving() override { return drive_.moving(); }
  [[nodiscard]] int stops_seen() override { return drive_.stops_seen(); }
  bool set_limit(bool high, bool active) override {
    drive_.set_limit(high != reversed_, active);
    return true;
  }
  bool set_fault(bool on) override {
    drive_.set_alarm_cause(on);
    return true;
  }
  bool forget_reference() override {
    // An absolute sensor knows it after a power cycle, too.
    if (!absolute_) drive_.power_cycle();
    return !absolute_;
  }

 private:
  ModbusDrive& drive_;
  const bool reversed_, absolute_;
};

struct Bench final : conformance::Bench {
  Bench(std::string bench_name, std::unique_ptr<ModbusDrive> bench_drive, bool reversed, bool absolute)
      : name_(std::move(bench_name)), drive(std::move(bench_drive)), peer(*drive, reversed, absolute) {}

  [[nodiscard]] std::string name() const override { return name_; }
  [[nodiscard]] base::Clock& clock() override { return *clock_; }
  [[nodiscard]] base::Result<std::vector<Device>> open() override {
    return conformance::open_module(module(), *clock_);
  }
  [[nodiscard]] base::Result<std::unique_ptr<conformance::Victim>> start_victim(
      const conformance::Task& task) override {
    return conformance::start_victim(module(), task);
  }
  void reset() override {
    line->restore();
    line->spoil(ModbusLine::Spoil::missing, 0);
    drive->reset();
  }
  [[nodiscard]] conformance::Wire& wire() override { return *wire_; }
  [[nodiscard]] std::optional<AxisUnderTest> axis() override {
    const double low = base::radians(low_deg);
    return AxisUnderTest{"pan",
                         &peer,
                         low,
                         low + base::radians(60),
                         base::radians(60),
                         base::radians(1000),
                         milliseconds(150)};
  }
  [[nodiscard]] conformance::ModuleUnderTest module() const {
    return {"modbus_axis", settings, folder.path()};
  }
  void put_on(std::unique_ptr<ModbusLine> made) {
    line = std::move(made);
    line->set_lateness(milliseconds(210));
    wire_ = std::make_unique<LineWire>(*line);
  }

  const std::string name_;
  const std::unique_ptr<base::Clock> clock_ = base::make_system_clock();
  const test::TemporaryFolder folder;
  const std::unique_ptr<ModbusDrive> drive;
  DrivePeer peer;
  std::unique_ptr<ModbusLine> line;
  std::unique_ptr<LineWire> wire_;
  std::string settings;
  double low_deg = -10;
};

}  // namespace

std::unique_ptr<conformance::Bench> make_rtu_bench() {
  using sim::wire::LeadshineDrive;
  auto drive = std::make_unique<LeadshineDrive>(
      LeadshineDrive::Setup{kHome, {-kTravel, kTravel}, milliseconds(15), milliseconds(20)});
  auto bench = std::make_unique<Bench>("modbus_axis", std::move(drive), false, false);
  bench->put_on(sim::wire::make_rtu_line(bench->folder / "line", std::chrono::microseconds(1750),
                                         {{1, bench->drive.get()}}));
  bench->settings = fmt::format("port = \"{}\"\nprofile = \"leadshine_pr\"\nanswer_ms = 150\n{}",
                                (bench->folder / "line").string(), axis_settings("pan", 1, R"(
[axis.pan.drive]
home_rpm = 300
low_limit_mask = 0x0008
high_limit_mask = 0x0004
)"));
  return bench;
}

std::unique_ptr<conformance::Bench> make_tcp_bench() {
  using sim::wire::OrientalDrive;
  auto drive = std::make_unique<OrientalDrive>(
      OrientalDrive::Setup{kHome, {-kTravel, kTravel}, milliseconds(15), true});
  auto bench = std::make_unique<Bench>("modbus_axis_tcp", std::move(drive), true, true);
  auto line = sim::wire::make_tcp_line({{5, bench->drive.get()}});
  const int port = line->port();
  bench->put_on(std::move(line));
  bench->low_deg = -50;
  bench->settings =
      fmt::format("host = \"127.0.0.1\"\ntcp_port = {}\nprofile = \"oriental_az\"\nanswer_ms = 150\n{}", port,
                  axis_settings("pan", 5, R"(
reversed = true
[axis.pan.drive]
high_limit_mask = 0x0200
low_limit_mask = 0x0400
)"));
  return bench;
}

}  // namespace rig::drivers::modbus
