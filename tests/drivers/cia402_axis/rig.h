// A bus with simulated drives on it, and the module's axes at its other end.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "drivers/api/module.h"
#include "sim/wire/can_hub.h"
#include "sim/wire/canopen_station.h"
#include "tests/core/temporary_folder.h"

namespace rig::drivers::cia402 {

/// The drives' mechanics count 0 in the middle, 100 to the degree. Their zero, once homed, is the low switch.
inline constexpr double kCountsPerDeg = 100;
inline constexpr double kSwitchDeg = 50;

/// A drive as fast and as wide as the tests want it.
[[nodiscard]] sim::wire::CanopenNode::Settings quick_node(int id);

/// Settings of one axis "pan" on node 1, as in rig.toml; `more_of_module` and `more_of_axis` are further
/// lines.
[[nodiscard]] std::string settings_text(const std::string& interface, const std::string& more_of_module = {},
                                        const std::string& more_of_axis = {});

class TestRig {
 public:
  explicit TestRig(const std::vector<sim::wire::CanopenNode::Settings>& nodes = {quick_node(1)});

  /// The module's devices, through open_devices; what fails is a failure of the test. An earlier opening's
  /// devices end.
  void open(const std::string& more_of_module = {}, const std::string& more_of_axis = {});
  void open_text(const std::string& text);
  void close() { devices_.clear(); }
  [[nodiscard]] Axis& axis(std::size_t i = 0) { return *std::get<std::unique_ptr<Axis>>(devices_.at(i).is); }
  [[nodiscard]] const std::vector<Device>& devices() const { return devices_; }

  [[nodiscard]] sim::wire::CanHub& hub() { return hub_; }
  [[nodiscard]] sim::wire::CanopenStation& station() { return station_; }
  [[nodiscard]] std::string interface() const { return "unix:" + hub_.path().string(); }
  [[nodiscard]] base::Clock& clock() { return *clock_; }

  /// Where the mechanics stand, in the axis' own terms once it is homed.
  [[nodiscard]] double position_deg(int node = 1);
  [[nodiscard]] int stops(int node = 1);

  /// state(), which has to succeed.
  [[nodiscard]] AxisState look(std::size_t i = 0);
  /// Asks until `ready(state)`; a time-out fails the test. The last state.
  template <typename Ready>
  AxisState wait_until(Ready&& ready, std::chrono::milliseconds within = std::chrono::milliseconds(8000)) {
    const auto end = std::chrono::steady_clock::now() + within;
    while (true) {
      const auto state = axis().state();
      if (state && ready(*state)) return *state;
      if (std::chrono::steady_clock::now() > end) {
        fail_late(state);
        return state ? *state : AxisState{};
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }
  /// Enabled, homed, standing.
  void make_ready();
  void move_to_deg(double target);
  /// A move that is started and awaited.
  void arrive_deg(double target);

 private:
  static void fail_late(const Result<AxisState>& last);

  test::TemporaryFolder folder_;
  sim::wire::CanHub hub_;
  sim::wire::CanopenStation station_;
  std::unique_ptr<base::Clock> clock_ = base::make_system_clock();
  std::vector<Device> devices_;
};

/// Every line that the module has logged since the last call.
[[nodiscard]] std::string take_log();

}  // namespace rig::drivers::cia402
