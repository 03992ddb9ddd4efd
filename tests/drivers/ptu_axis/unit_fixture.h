// A unit at the end of a pseudo-terminal, and the module's axes opened on it.
#pragma once

#include <algorithm>
#include <gtest/gtest.h>
#include <memory>
#include <string>
#include <vector>

#include "core/base/units.h"
#include "drivers/conformance/waiting.h"
#include "drivers/ptu_axis/devices.h"
#include "sim/wire/ptu.h"
#include "tests/core/temporary_folder.h"
#include "tests/drivers/settings_at_port.h"

namespace rig::drivers::ptu::testing {

inline constexpr const char* kBothAxes = R"(
[axis.pan]
max_velocity_deg_s = 60.0
max_acceleration_deg_s2 = 240.0
[axis.tilt]
max_velocity_deg_s = 40.0
max_acceleration_deg_s2 = 200.0
)";

/// Of a unit of 185.1428 seconds of arc a step.
inline constexpr double kStepsPerDegree = 3600 / 185.1428;

class UnitTest : public ::testing::Test {
 protected:
  using Ptu = sim::wire::Ptu;

  void start(Ptu::Setup setup = {}) {
    unit_.reset();
    setup.link = folder_ / "ptu";
    unit_ = std::make_unique<Ptu>(std::move(setup));
  }

  base::Result<void> try_open(const std::string& settings = kBothAxes) {
    devices_.clear();
    settings_ = std::make_unique<test::SettingsAtPort>(&open_devices, settings, unit_->path(), folder_);
    auto devices = settings_->open(*clock_);
    if (!devices) return base::pass(devices);
    devices_ = std::move(*devices);
    return {};
  }
  void open(const std::string& settings = kBothAxes) {
    const auto opened = try_open(settings);
    ASSERT_TRUE(opened.has_value()) << opened.error().text();
  }

  Axis& axis(std::size_t i) { return *std::get<std::unique_ptr<Axis>>(devices_.at(i).is); }
  Axis& pan() { return axis(0); }
  Axis& tilt() { return axis(1); }

  AxisState state(Axis& of) {
    auto now = of.state();
    EXPECT_TRUE(now.has_value()) << now.error().text();
    return now ? *now : AxisState{};
  }

  template <typename Ready>
  bool wait_until(Ready&& ready, double within_s = 10) {
    conformance::Waiting waiting(*clock_);
    return waiting.until(ready, base::seconds(within_s), std::chrono::milliseconds(3));
  }
  /// Also through what makes it lost for a moment.
  bool wait_until_homed(Axis& of) {
    return wait_until([&] {
      const auto now = of.state();
      return now && now->homed && !now->moving;
    });
  }
  bool wait_until_still(Axis& of) {
    return wait_until([&] {
      const auto now = of.state();
      return now && !now->moving;
    });
  }
  void make_ready(Axis& of) {
    const auto enabled = of.enable(true);
    ASSERT_TRUE(enabled.has_value()) << enabled.error().text();
    const auto homed = of.home();
    ASSERT_TRUE(homed.has_value()) << homed.error().text();
    ASSERT_TRUE(wait_until_homed(of));
  }
  base::Result<void> go(Axis& of, double target_deg, double velocity_deg_s = 40,
                        double acceleration_deg_s2 = 1e4) {
    return of.move_to(base::radians(target_deg), base::radians(velocity_deg_s),
                      base::radians(acceleration_deg_s2));
  }

  std::size_t times_heard(const std::string& command) {
    const auto heard = unit_->heard();
    return static_cast<std::size_t>(std::count(heard.begin(), heard.end(), command));
  }

  test::TemporaryFolder folder_;
  std::unique_ptr<base::Clock> clock_ = base::make_system_clock();
  std::unique_ptr<Ptu> unit_;
  std::unique_ptr<test::SettingsAtPort> settings_;
  std::vector<Device> devices_;
};

}  // namespace rig::drivers::ptu::testing
