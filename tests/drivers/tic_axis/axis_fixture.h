// The axes of the module on simulated Tics.
#pragma once

#include <chrono>
#include <gtest/gtest.h>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "core/base/units.h"
#include "drivers/tic_axis/devices.h"
#include "tests/drivers/tic_axis/lab.h"

namespace rig::drivers::tic::test {

using base::radians;
using std::chrono::milliseconds;
using Steady = std::chrono::steady_clock;

// The module's log of the test that runs.
inline std::mutex log_mutex;
inline std::string logged;
inline void keep_log(base::LogLevel /*level*/, std::string_view text) {
  const std::lock_guard lock(log_mutex);
  logged += std::string(text) + "\n";
}
inline std::string log_text() {
  const std::lock_guard lock(log_mutex);
  return logged;
}

class TicAxisTest : public ::testing::Test {
 protected:
  TicAxisTest() {
    const std::lock_guard lock(log_mutex);
    logged.clear();
  }

  // Opens the module on this rig.toml; the axes by their order in it.
  void open(const std::string& text) {
    const auto table = base::ConfigTable::parse(text, "rig.toml");
    ASSERT_TRUE(table.has_value()) << table.error().text();
    auto opened = open_devices({"tic", *table, "/nonexistent", *clock_, &keep_log});
    ASSERT_TRUE(opened.has_value()) << opened.error().text();
    devices_ = std::move(*opened);
  }
  Axis& axis(std::size_t i = 0) { return *std::get<std::unique_ptr<Axis>>(devices_.at(i).is); }
  void close() { devices_.clear(); }

  AxisState state(std::size_t i = 0) {
    const auto now = axis(i).state();
    EXPECT_TRUE(now.has_value()) << now.error().text();
    return now.value_or(AxisState{});
  }
  // As if it had been homed on its reverse switch and driven back: count 0 is at the switch.
  static void reference(sim::wire::Tic& tic) { command(tic, 0xEC, 2500); }
  static void command(sim::wire::Tic& tic, std::uint8_t request, std::int32_t value) {
    const auto bits = static_cast<std::uint32_t>(value);
    const auto answer = tic.control({0x40, request, static_cast<std::uint16_t>(bits & 0xFFFFU),
                                     static_cast<std::uint16_t>(bits >> 16U), 0},
                                    {});
    EXPECT_EQ(answer.kind, sim::wire::ControlAnswer::Kind::done);
  }
  static std::uint32_t variable32(sim::wire::Tic& tic, std::uint16_t offset) {
    const auto answer = tic.control({0xC0, 0xA1, 0, offset, 4}, {});
    EXPECT_EQ(answer.data.size(), 4U);
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) value |= static_cast<std::uint32_t>(answer.data.at(i)) << (8 * i);
    return value;
  }

  template <typename Condition>
  static bool within(milliseconds bound, Condition&& condition) {
    const auto deadline = Steady::now() + bound;
    while (!condition()) {
      if (Steady::now() >= deadline) return false;
      std::this_thread::sleep_for(milliseconds(2));
    }
    return true;
  }
  // Referenced, enabled, and on its way from 0 to 40 degrees at 40 degrees/s, which takes a second.
  void set_off(sim::wire::Tic& tic) {
    reference(tic);
    ASSERT_TRUE(axis().enable(true));
    ASSERT_TRUE(axis().move_to(radians(40), radians(40), radians(400)));
    ASSERT_TRUE(within(milliseconds(500), [&] { return tic.motor_position() > 100; }));
  }
  static bool stands(sim::wire::Tic& tic, milliseconds how_long) {
    const double from = tic.motor_position();
    return !within(how_long, [&] { return tic.velocity() != 0 || tic.motor_position() != from; });
  }

  const std::unique_ptr<base::Clock> clock_ = base::make_system_clock();
  std::vector<Device> devices_;
};

}  // namespace rig::drivers::tic::test
