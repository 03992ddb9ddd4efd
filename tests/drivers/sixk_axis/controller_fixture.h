// A controller at the end of a pseudo-terminal, and the module's axes opened on it.
#pragma once

#include <algorithm>
#include <gtest/gtest.h>
#include <memory>
#include <string>
#include <vector>

#include "core/base/units.h"
#include "drivers/conformance/waiting.h"
#include "drivers/sixk_axis/devices.h"
#include "sim/wire/sixk.h"
#include "tests/core/temporary_folder.h"
#include "tests/drivers/settings_at_port.h"

namespace rig::drivers::sixk::testing {

/// 200 counts a degree, 25000 counts a turn: 125 degrees a turn.
inline constexpr const char* kArm = R"([axis.arm]
number = 1
counts_per_deg = 200
max_velocity_deg_s = 100.0
max_acceleration_deg_s2 = 500.0
home_velocity_deg_s = 60.0
)";

class ControllerTest : public ::testing::Test {
 protected:
  using Sixk = sim::wire::Sixk;

  void start(Sixk::Setup setup = {}) {
    controller_.reset();
    setup.link = folder_ / "sixk";
    controller_ = std::make_unique<Sixk>(std::move(setup));
  }

  base::Result<void> try_open(const std::string& settings = kArm) {
    devices_.clear();
    settings_ = std::make_unique<test::SettingsAtPort>(&open_devices, settings, controller_->path(), folder_);
    auto devices = settings_->open(*clock_);
    if (!devices) return base::pass(devices);
    devices_ = std::move(*devices);
    return {};
  }
  void open(const std::string& settings = kArm) {
    const auto opened = try_open(settings);
    ASSERT_TRUE(opened.has_value()) << opened.error().text();
  }

  Axis& axis(std::size_t i = 0) { return *std::get<std::unique_ptr<Axis>>(devices_.at(i).is); }

  AxisState state(std::size_t i = 0) {
    auto now = axis(i).state();
    EXPECT_TRUE(now.has_value()) << now.error().text();
    return now ? *now : AxisState{};
  }

  template <typename Ready>
  bool wait_until(Ready&& ready, double within_s = 10) {
    conformance::Waiting waiting(*clock_);
    return waiting.until(ready, base::seconds(within_s), std::chrono::milliseconds(3));
  }
  bool wait_until_still(std::size_t i = 0) {
    return wait_until([&] { return !state(i).moving; });
  }
  void make_ready(std::size_t i = 0) {
    const auto enabled = axis(i).enable(true);
    ASSERT_TRUE(enabled.has_value()) << enabled.error().text();
    const auto homed = axis(i).home();
    ASSERT_TRUE(homed.has_value()) << homed.error().text();
    ASSERT_TRUE(wait_until([&] { return state(i).homed && !state(i).moving; }));
  }
  base::Result<void> go(double target_deg, double velocity_deg_s = 100, double acceleration_deg_s2 = 500,
                        std::size_t i = 0) {
    return axis(i).move_to(base::radians(target_deg), base::radians(velocity_deg_s),
                           base::radians(acceleration_deg_s2));
  }

  test::TemporaryFolder folder_;
  std::unique_ptr<base::Clock> clock_ = base::make_system_clock();
  std::unique_ptr<Sixk> controller_;
  std::unique_ptr<test::SettingsAtPort> settings_;
  std::vector<Device> devices_;
};

}  // namespace rig::drivers::sixk::testing
